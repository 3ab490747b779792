"""Agents as programs of their own, mutual TLS, real processes, real time. The figures are printed: pytest -m realtime -s."""

from __future__ import annotations

import asyncio
import signal
from pathlib import Path

import pytest

from actors import Child, Intensity, Supervisor, run
from actors.hosts import HostLost, TlsHosts
from actors.logs import LogRecord
from actors.transport.zenoh import ZenohConfig, ZenohTransport
from tests.actors.hosts.kit import Fleet, Hearer, Worker, fleet, placement, until
from tests.actors.processes.kit import alive

pytestmark = pytest.mark.realtime

LEASE = 2.0


def transport(machines: Fleet) -> ZenohTransport:
    listen = (f"tls/{machines.address('robot')}",)
    return ZenohTransport(ZenohConfig(listen=listen, gossip_port=0, security=machines.security("robot")))


def hosts(machines: Fleet) -> TlsHosts:
    addresses = {name: machines.address(name) for name in ("base", "spare")}
    return TlsHosts(addresses, security=machines.security("robot"), lease=LEASE)


def tree(*names: str, process: bool = False) -> Supervisor:
    away = Supervisor("away", hosts=names, children=[Child(Worker, process=process)])
    return Supervisor("robot", intensity=Intensity(5, within=10.0), children=[Child(Hearer), away])


async def test_when_an_agent_is_killed_its_processes_end_and_the_spare_acts_within_the_lease_and_a_second(
    tmp_path: Path,
) -> None:
    async with fleet(tmp_path) as machines:
        base, spare = await machines.start("base"), await machines.start("spare")
        async with run(tree("base", "spare"), sinks=(), transport=transport(machines), hosts=hosts(machines)) as system:
            hearer = system.node(Hearer)
            assert isinstance(hearer, Hearer)
            await until(lambda: hearer.heard, base)
            (old,) = base.launched()

            killed = asyncio.get_running_loop().time()
            base.process.send_signal(signal.SIGKILL)
            await until(lambda: not alive(old))
            gone = asyncio.get_running_loop().time() - killed
            await until(lambda: placement(hearer.heard[-1][1]) == 2, spare)
            acts = hearer.heard[-1][0] - killed

            failed = [
                report for report in system.reports if isinstance(getattr(report.reason, "error", None), HostLost)
            ]
            assert len(failed) == 1
            assert spare.launched()
        print(
            f"its processes were gone after {1e3 * gone:.0f} ms; the spare acts after {acts:.2f} s, lease {LEASE:g} s"
        )

    assert gone < 1.0
    assert acts <= LEASE + 1.0
    assert not [pid for agent in machines.agents.values() for pid in agent.launched() if alive(pid)]
    tokens = [token for _, token in hearer.heard]
    assert tokens == sorted(tokens)


async def test_a_process_below_one_of_a_killed_agent_ends_with_it(tmp_path: Path) -> None:
    async with fleet(tmp_path) as machines:
        base = await machines.start("base")
        whole = tree("base", process=True)
        async with run(whole, sinks=(), transport=transport(machines), hosts=hosts(machines)) as system:
            record = system.nodes["robot", "away", "worker"]
            (top,), nested = base.launched(), record.process
            assert record.state == "running"
            assert nested != top

            base.process.send_signal(signal.SIGKILL)

            await until(lambda: not alive(top) and not alive(nested), seconds=3.0)


async def test_an_agent_that_stands_still_loses_its_lease_and_is_killed_by_the_kernel_when_it_goes_on(
    tmp_path: Path,
) -> None:
    async with fleet(tmp_path) as machines:
        base, spare = await machines.start("base"), await machines.start("spare")
        async with run(tree("base", "spare"), sinks=(), transport=transport(machines), hosts=hosts(machines)) as system:
            hearer = system.node(Hearer)
            assert isinstance(hearer, Hearer)
            await until(lambda: hearer.heard, base)
            (old,) = base.launched()

            base.process.send_signal(signal.SIGSTOP)
            await until(lambda: placement(hearer.heard[-1][1]) == 2, spare)
            base.process.send_signal(signal.SIGCONT)
            await until(lambda: not alive(old))
            code = await base.process.wait()

    assert code == -signal.SIGALRM


async def test_an_agent_that_is_asked_to_end_stops_its_nodes_in_order_and_the_spare_takes_over_at_once(
    tmp_path: Path,
) -> None:
    async with fleet(tmp_path) as machines:
        base, spare = await machines.start("base"), await machines.start("spare")
        async with run(tree("base", "spare"), sinks=(), transport=transport(machines), hosts=hosts(machines)) as system:
            hearer = system.node(Hearer)
            assert isinstance(hearer, Hearer)
            await until(lambda: hearer.heard, base)

            code = await base.end()
            await until(lambda: placement(hearer.heard[-1][1]) == 2, spare)

            reasons = [str(report.reason) for report in system.reports if report.context == "child_terminated"]
            assert code == 128 + signal.SIGTERM
            assert reasons == ["it stopped: the agent of its machine ends"]
        assert not alive(spare.launched()[0])


async def test_when_the_tree_is_left_what_it_had_elsewhere_stops_in_order(tmp_path: Path) -> None:
    lines: list[LogRecord] = []
    async with fleet(tmp_path) as machines:
        base = await machines.start("base")
        async with run(
            tree("base"), sinks=(lines.append,), transport=transport(machines), hosts=hosts(machines)
        ) as system:
            hearer = system.node(Hearer)
            assert isinstance(hearer, Hearer)
            await until(lambda: hearer.heard, base)
        (pid,) = base.launched()

        assert not alive(pid)
        assert base.process.returncode is None
        assert not [line for line in lines if line.event == "child terminated"]


async def test_a_stranger_and_the_wrong_machine_are_refused(tmp_path: Path) -> None:
    lines: list[LogRecord] = []
    async with fleet(tmp_path) as machines:
        base = await machines.start("base")
        stranger = TlsHosts({"base": machines.address("base")}, security=machines.security("stranger"))
        wrong = TlsHosts({"spare": machines.address("base")}, security=machines.security("robot"))
        for places, name in ((stranger, "base"), (wrong, "spare")):
            child = Supervisor("robot", children=[Child(Worker, host=name, stop=0.5)])
            with pytest.raises(TimeoutError):
                async with asyncio.timeout(3.0):
                    async with run(child, sinks=(lines.append,), transport=transport(machines), hosts=places):
                        raise AssertionError("it was taken")
        assert base.launched() == []
        assert any("'stranger' has been refused: it is none of robot" in line for line in base.lines)
    because = [str(line.fields["because"]) for line in lines if line.event == "a host cannot be reached"]
    assert "its agent ended the connection" in because[0]
    assert "'base', not 'spare', by its certificate" in because[1]
