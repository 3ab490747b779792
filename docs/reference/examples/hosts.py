"""Children on other machines: simulated machines in tests, and a `Hosts` of your own."""

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from actors import Child, Intensity, Supervisor, run
from actors.hosts import LEASE_SECONDS, HostLost, Hosts, TlsHosts, Wire
from actors.testing import Rig, SimulatedHosts
from actors.transport.security import load_security
from actors.transport.security.authority import create
from actors.transport.zenoh import ZenohConfig, ZenohTransport
from robot.tutorials.talker_listener import Listener, Talker

tree = Supervisor(
    "demo",
    intensity=Intensity(3, within=60.0),
    children=[
        Child(Listener),
        Child(Talker, hosts=["base", "spare"]),              # on the first of them that can be reached
        Supervisor("second", host="base", children=[Child(Talker, name="other")]),
    ],
)

# -- on each of the machines: an agent

fleet = create(Path(tempfile.mkdtemp()), ["robot", "base", "spare"], days=30, passwords=False)
security = load_security(fleet[0])
transport = ZenohTransport(ZenohConfig(listen=("tls/0.0.0.0:7448",), security=security))
hosts = TlsHosts({"base": "192.168.1.6:7450", "spare": "192.168.1.7:7450"}, security=security)


async def main() -> None:
    async with run(tree, transport=transport, hosts=hosts) as system:
        await system.wait()

# -- in tests

async def test_the_spare_takes_over(rig: Rig) -> None:
    await rig.start(tree)
    with rig.expect_failure(HostLost):
        rig.hosts.cut("base")  # or crash("base"); heal and reboot undo it
        await rig.advance(4.0)
    assert rig.incarnation("talker") == 2

async def test_nobody_takes_over_while_no_machine_is_up(rig: Rig) -> None:
    await rig.start(tree)
    machines: SimulatedHosts = rig.hosts
    with rig.expect_failure(HostLost):
        machines.crash("base")
        machines.crash("spare")
        await rig.advance(LEASE_SECONDS + 5.0)
        assert rig.incarnation("talker") == 1
        machines.reboot("spare")
        await rig.advance(LEASE_SECONDS)
    assert rig.incarnation("talker") == 2

class Dialed:
    """The machines of another `Hosts`, with a list of those that the tree has called."""

    def __init__(self, machines: Hosts) -> None:
        self.machines = machines
        self.lease = machines.lease
        self.names = machines.names
        self.dialed: list[str] = []

    async def dial(self, host: str, take: Callable[[Any], None], lost: Callable[[], None]) -> Wire:
        self.dialed.append(host)
        return await self.machines.dial(host, take, lost)

    def count_run(self) -> int:
        return self.machines.count_run()


watched: Hosts = Dialed(hosts)
