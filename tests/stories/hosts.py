"""Several machines on one: each a network namespace, joined by `cables` of this process.

Nothing outside the namespaces is changed, and no packet leaves them but by a cable. Where namespaces or TUN interfaces are not allowed, tests
with the fixture `hosts` are skipped, and say why.
"""

from __future__ import annotations

import array
import asyncio
import os
import socket
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Final

from actors.transport.simulated.link import Conditions
from tests.stories.cables import Cable, Cables
from tests.stories.conftest import ROOT, Program

WIRE: Final = Conditions(delay=0.0001)
"""A good cable."""
MTU: Final = 1500


def address(host: int) -> str:
    """The address of a host on the cables."""
    return f"10.77.0.{host}"


def endpoint(host: int, by: str = "tcp") -> str:
    """Where programs of a host listen, in Zenoh's form."""
    return f"{by}/{address(host)}:7448"


class NotAllowed(Exception):
    """This kernel, or this account, makes no namespaces or no interfaces."""


def _privileged() -> list[str]:
    """The options by which an ordinary account gets a namespace."""
    return [] if os.geteuid() == 0 else ["--user", "--map-root-user"]


class Machine:
    """One namespace, held by a process."""

    def __init__(self, number: int, folder: Path) -> None:
        path = str(folder / f"machine{number}")
        with socket.socket(socket.AF_UNIX) as door:
            door.bind(path)
            door.listen(1)
            door.settimeout(10.0)
            command = ["unshare", "--net", *_privileged(), sys.executable, "-m", "tests.stories.machine"]
            self.process = subprocess.Popen(
                [*command, path, address(number), str(MTU)], cwd=ROOT, stdin=subprocess.PIPE, stderr=subprocess.PIPE, text=True
            )  # fmt: skip
            self.end = self._take_end(door)

    def _take_end(self, door: socket.socket) -> int:
        while True:
            door.settimeout(0.05)
            try:
                way, _ = door.accept()
            except TimeoutError:
                if self.process.poll() is not None:
                    _, error = self.process.communicate()
                    raise NotAllowed(error.strip().splitlines()[-1] if error.strip() else "unshare fails") from None
                continue
            with way:
                _, ancillary, _, _ = way.recvmsg(1, socket.CMSG_SPACE(4))
            return array.array("i", ancillary[0][2][:4])[0]

    @property
    def entering(self) -> list[str]:
        """The command that runs another one within the machine."""
        user = [] if os.geteuid() == 0 else ["--user", "--preserve-credentials"]
        return ["nsenter", "--target", str(self.process.pid), "--net", *user, "--"]

    def close(self) -> None:
        self.process.communicate()


class Hosts:
    """Machines by number, from 1 on, and what runs on them."""

    def __init__(self, count: int) -> None:
        self._folder = tempfile.TemporaryDirectory()
        self._machines: dict[int, Machine] = {}
        self._programs: list[Program] = []
        try:
            for number in range(1, count + 1):
                self._machines[number] = Machine(number, Path(self._folder.name))
        except (OSError, NotAllowed) as error:
            self._end_machines()
            raise NotAllowed(str(error)) from None
        self.cables = Cables({number: machine.end for number, machine in self._machines.items()}, WIRE)

    def cable(self, one: int, other: int) -> Cable:
        """The cable from one host to another."""
        return self.cables.of[one, other]

    async def start(self, host: int, *words: str, **environment: str) -> Program:
        """Start ``python -m ...`` on a host. It is killed after the test."""
        own = {"ROBACTOR_GOSSIP_PORT": "7447", "RMW_IMPLEMENTATION": "", "PYTHONPATH": str(ROOT)}
        command = [*self._machines[host].entering, sys.executable, "-m", *words]
        process = await asyncio.create_subprocess_exec(
            *command, cwd=ROOT, env={**os.environ, **own, **environment},
            stdin=asyncio.subprocess.PIPE, stdout=asyncio.subprocess.PIPE, stderr=asyncio.subprocess.STDOUT,
        )  # fmt: skip
        self._programs.append(Program(process))
        return self._programs[-1]

    async def far(
        self, host: int, nodes: str, *settings: str, meets: tuple[int, ...] = (), by: str = "tcp", **more: str
    ) -> Program:
        """Run nodes of `tests.stories.far` on a host that listens, and connects to the hosts that it `meets`."""
        listen, connect = endpoint(host, by), ",".join(endpoint(other, by) for other in meets)
        return await self.start(host, "tests.stories.far", nodes, listen, connect, *settings, **more)

    def sent_again(self, host: int) -> int:
        """How many segments the TCP of a host has sent a second time, by the count of its kernel."""
        text = Path(f"/proc/{self._machines[host].process.pid}/net/snmp").read_text()
        names, values = (line.split() for line in text.splitlines() if line.startswith("Tcp:"))
        return int(values[names.index("RetransSegs")])

    async def end_programs(self) -> None:
        """End at once all that was started."""
        for program in self._programs:
            await program.kill()
        self._programs.clear()

    async def close(self) -> None:
        await self.end_programs()
        self.cables.close()
        self._end_machines()

    def _end_machines(self) -> None:
        for machine in self._machines.values():
            machine.close()
        self._folder.cleanup()
