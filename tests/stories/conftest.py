"""Programs as a user starts them, each in a process of its own, at a meeting point of the test's own."""

from __future__ import annotations

import asyncio
import os
import sys
from collections.abc import AsyncGenerator, Awaitable, Callable
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

import pytest
import pytest_asyncio

from actors import Child, Node, System, run
from actors.transport import transport_from_environment
from tests.actors.transport.zenoh.wires import free_port
from tests.wires import meeting_place

if TYPE_CHECKING:
    from tests.stories.hosts import Hosts

ROOT = Path(__file__).parents[2]
PATIENCE = 30.0
"""Seconds after which a test gives up waiting."""


class Program:
    """A program that runs, and the lines that it has written to its output, errors among them."""

    def __init__(self, process: asyncio.subprocess.Process) -> None:
        self.process = process
        self.lines: list[str] = []
        self._news = asyncio.Event()
        self._reading = asyncio.create_task(self._read())

    async def _read(self) -> None:
        assert self.process.stdout is not None
        async for line in self.process.stdout:
            self.lines.append(line.decode().rstrip())
            self._news.set()

    @property
    def text(self) -> str:
        return "\n".join(self.lines)

    async def says(self, part: str, since: int = 0) -> str:
        """The first line with `part`, from the line with number `since` on; waits for it."""
        try:
            async with asyncio.timeout(PATIENCE):
                while True:
                    self._news.clear()
                    found = next((line for line in self.lines[since:] if part in line), None)
                    if found is not None:
                        return found
                    await self._news.wait()
        except TimeoutError:
            pytest.fail(f"waited {PATIENCE:g} s in vain for {part!r}; it said:\n{self.text}")

    async def ended(self) -> int:
        """Its exit code; waits for the end."""
        async with asyncio.timeout(PATIENCE):
            code = await self.process.wait()
            await self._reading
        return code

    async def kill(self) -> None:
        """End it at once, without a farewell; harmless if it has ended."""
        if self.process.returncode is None:
            self.process.kill()
        await self.ended()


Start: TypeAlias = Callable[..., Awaitable[Program]]


async def until(system: System, condition: Callable[[], object]) -> None:
    """Wait until the graph, as `system` sees it, meets a condition."""
    changed = asyncio.Event()
    forget = system.graph.on_change(changed.set)
    try:
        async with asyncio.timeout(PATIENCE):
            while not condition():
                changed.clear()
                await changed.wait()
    finally:
        forget()


def nodes(system: System) -> set[str]:
    """The names of all nodes in the graph."""
    return {node.name for node in system.snapshot().nodes}


@pytest.fixture
def port() -> int:
    return free_port()


@pytest.fixture
def wire() -> str:
    """How processes meet. A test for both wires has it as a parameter; see `tests.wires`."""
    return "zenoh"


@pytest_asyncio.fixture
async def start(wire: str, port: int) -> AsyncGenerator[Start]:
    """``await start("robot.tutorials", "ring")``: start ``python -m ...``. It is killed after the test."""
    own = {**meeting_place(wire, port), "PYTHONPATH": str(ROOT)}
    programs: list[Program] = []

    async def one(*words: str, **environment: str) -> Program:
        process = await asyncio.create_subprocess_exec(
            sys.executable, "-m", *words, cwd=ROOT, env={**os.environ, **own, **environment},
            stdout=asyncio.subprocess.PIPE, stderr=asyncio.subprocess.STDOUT,
        )  # fmt: skip
        programs.append(Program(process))
        return programs[-1]

    yield one
    for program in programs:
        await program.kill()


@pytest_asyncio.fixture
async def observer(wire: str, port: int) -> AsyncGenerator[System]:
    """A system of this process, whose node /observer takes part in the same graph."""
    transport = transport_from_environment(meeting_place(wire, port))
    async with run(Child(Node, name="observer"), transport=transport, signals=False, sinks=()) as system:
        yield system


@pytest_asyncio.fixture
async def hosts(request: pytest.FixtureRequest) -> AsyncGenerator[Hosts]:
    """Three machines, or as many as the test's parameter says."""
    from tests.stories.hosts import Hosts, NotAllowed  # late: they import this module

    try:
        made = Hosts(getattr(request, "param", 3))
    except NotAllowed as error:
        pytest.skip(f"no network namespaces with TUN interfaces here: {error}")
    yield made
    await made.close()
