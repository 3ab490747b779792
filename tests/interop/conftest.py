"""Programs of the packages of PyPI beside a system of ours, on a port of their own."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable
from pathlib import Path

import pytest
import pytest_asyncio

import actors.interfaces
from tests.actors.transport.zenoh.wires import free_port
from tests.interop.environment import NotHere, foreign_python
from tests.interop.parties import Ours, Program, our_system

DEFINITIONS = Path(actors.interfaces.__file__).parent / "share"


@pytest.fixture(scope="session")
def python() -> Path:
    """The Python of the programs that we did not write."""
    try:
        return foreign_python()
    except NotHere as missing:
        pytest.skip(f"the environment of the foreign programs cannot be made: {missing}")


@pytest_asyncio.fixture
async def ours() -> AsyncIterator[Ours]:
    async with our_system(free_port()) as one:
        yield one


StartProgram = Callable[[str], Awaitable[Program]]


@pytest_asyncio.fixture
async def start(python: Path, ours: Ours) -> AsyncIterator[StartProgram]:
    """Starts a program that finds our system, and ends it after the test."""
    started: list[Program] = []

    async def one(name: str) -> Program:
        more = (DEFINITIONS,) if name == "with_zenoh_ros2_sdk" else ()
        started.append(await Program.start(python, name, ours.port, *more))
        return started[-1]

    yield one
    await asyncio.gather(*(program.end() for program in started))
