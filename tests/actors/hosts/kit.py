"""Two agents of a fleet as programs of this machine, and nodes for their processes."""

from __future__ import annotations

import asyncio
import os
import socket
import sys
from collections.abc import AsyncGenerator, Callable
from contextlib import asynccontextmanager
from pathlib import Path

from actors import Node, Topic, every, publishes
from actors.interfaces.std_msgs.msg import UInt64
from actors.transport.security import Security, load_security
from actors.transport.security.authority import create
from tests.actors.processes.kit import alive

ACTED = Topic(UInt64, "acted")


class Worker(Node):
    """Acts 50 times a second, and says which life of it did."""

    out = publishes(ACTED)

    @every(hz=50)
    def act(self) -> None:
        self.out(UInt64(data=self.fencing_token))


class Hearer(Node):
    """Keeps when it has heard which life of the worker act."""

    async def on_start(self) -> None:
        self.heard: list[tuple[float, int]] = []

    @ACTED.on()
    def hear(self, message: UInt64) -> None:
        self.heard.append((asyncio.get_running_loop().time(), message.data))


def placement(token: int) -> int:
    """The number of the placement in a fencing token."""
    return token >> 20 & 0xFFFFF


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port


class AgentProgram:
    """``robactor agent`` as a program."""

    def __init__(self, process: asyncio.subprocess.Process) -> None:
        self.process = process
        self.lines: list[str] = []
        self._reading = asyncio.create_task(self._read())

    async def _read(self) -> None:
        assert self.process.stdout is not None
        async for line in self.process.stdout:
            self.lines.append(line.decode().rstrip())

    def launched(self) -> list[int]:
        """The ids of the processes that it has launched."""
        return [int(line.split()[1]) for line in self.lines if line.startswith("process ")]

    async def end(self) -> int:
        """Have it end in order; its exit code."""
        if self.process.returncode is None:
            self.process.terminate()
        await self.process.wait()
        await self._reading
        assert [pid for pid in self.launched() if alive(pid)] == []
        assert self.process.returncode is not None
        return self.process.returncode


class Fleet:
    """Certificates for a robot, a base, a spare and a stranger, and the ports at which they are found."""

    def __init__(self, folder: Path) -> None:
        names: list[str] = ["robot", "base", "spare", "stranger"]
        self.files: dict[str, Path] = dict(zip(names, create(folder, names, days=1, passwords=False), strict=True))
        self.ports: dict[str, int] = {name: free_port() for name in names}
        self.agents: dict[str, AgentProgram] = {}

    def security(self, name: str) -> Security:
        return load_security(self.files[name])

    def address(self, name: str) -> str:
        return f"127.0.0.1:{self.ports[name]}"

    async def start(self, name: str, *more: str) -> AgentProgram:
        """Start the agent of a machine; returns when it waits for trees."""
        point = str(free_port())  # each machine has its own
        environment = {**os.environ, "RMW_IMPLEMENTATION": "", "ROBACTOR_GOSSIP_PORT": point}
        command = (
            *(sys.executable, "-m", "robot", "agent", "--owner", "robot", "--at", self.address(name)),
            *("--connect", f"tls/{self.address('robot')}", "--security", str(self.files[name]), *more),
        )
        process = await asyncio.create_subprocess_exec(
            *command, env=environment, stdout=asyncio.subprocess.PIPE, stderr=asyncio.subprocess.STDOUT
        )
        self.agents[name] = program = AgentProgram(process)
        await until(lambda: any("waits at" in line for line in program.lines), program)
        return program


async def until(condition: Callable[[], object], program: AgentProgram | None = None, seconds: float = 60.0) -> None:
    """Wait for a condition."""
    loop = asyncio.get_running_loop()
    end = loop.time() + seconds
    while not condition():
        said = "" if program is None else "\n".join(program.lines)
        assert loop.time() < end, f"waited {seconds:g} s in vain; the agent said:\n{said}"
        await asyncio.sleep(0.005)


@asynccontextmanager
async def fleet(folder: Path) -> AsyncGenerator[Fleet]:
    """A fleet; at the end of the block nothing of its agents runs any more."""
    made = Fleet(folder)
    try:
        yield made
    finally:
        for agent in made.agents.values():
            await agent.end()
