"""A graph of another process to look at, at a meeting point of its own."""

from __future__ import annotations

import asyncio
import contextlib
import io
import os
import socket
import threading
from collections.abc import AsyncGenerator, Awaitable, Callable
from contextlib import AbstractAsyncContextManager, AsyncExitStack, asynccontextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
import pytest_asyncio

from actors import Child, Node, Supervisor, System, run
from actors.transport import transport_from_environment
from cli.command import run_command
from tests import warm
from tests.wires import meeting_place

ROOT = warm.ROOT


@dataclass(frozen=True)
class Finished:
    code: int
    out: str
    err: str


Command = Callable[..., Awaitable[Finished]]
Start = Callable[..., Awaitable[warm.Process]]
SystemOf = Callable[..., AbstractAsyncContextManager[System]]


@pytest.fixture
def port() -> int:
    """A free port of the loopback interface, so that no other graph of this machine is met."""
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])


@pytest.fixture
def wire() -> str:
    """How processes meet. A test for both wires has it as a parameter; see `tests.wires`."""
    return "zenoh"


@pytest.fixture
def place(wire: str, port: int) -> dict[str, str]:
    """The variables by which processes meet each other and nobody else."""
    return {**meeting_place(wire, port), "ROS_DOMAIN_ID": "7"}


@pytest.fixture
def environment(place: dict[str, str]) -> dict[str, str]:
    return {**os.environ, **place, "PYTHONPATH": str(ROOT)}


@pytest.fixture
def robot(environment: dict[str, str]) -> Command:
    """``await robot("node", "list")``: run a command in a process of its own until it ends."""

    async def run_it(*words: str) -> Finished:
        program = warm.Program(*words, env=environment)
        try:
            done = await asyncio.to_thread(program.wait, 60.0)
        except asyncio.CancelledError:
            program.kill()
            raise
        return Finished(done.returncode, done.stdout, done.stderr)

    return run_it


@pytest_asyncio.fixture
async def start(environment: dict[str, str]) -> AsyncGenerator[Start]:
    """``await start("topic", "echo", "/chatter")``: a command in a process of its own that runs beside the test. It is killed after the test."""
    async with AsyncExitStack() as stack:

        async def one(*words: str, cwd: Path | None = None) -> warm.Process:
            process = await warm.start(*words, env=environment, cwd=cwd)
            stack.push_async_callback(process.close)
            return process

        yield one


@pytest.fixture
def meeting(place: dict[str, str], port: int, monkeypatch: pytest.MonkeyPatch) -> int:
    """The port at which a system of this process and commands of this process meet, and the variables that say so."""
    for name, value in place.items():
        monkeypatch.setenv(name, value)
    monkeypatch.delenv("AMENT_PREFIX_PATH", raising=False)
    return port


@pytest.fixture
def command(meeting: int) -> Command:
    """``await command("node", "list")``: run a command in another thread of this process, which is quicker than in another process."""

    def run_it(words: tuple[str, ...], ended: Callable[[int], object]) -> None:
        try:
            code = run_command(words[0], words[1:])
        except SystemExit as exit:  # argparse's
            code = int(exit.code or 0)
        ended(code)

    async def run_beside(*words: str) -> Finished:
        loop = asyncio.get_running_loop()
        future: asyncio.Future[int] = loop.create_future()

        def ended(code: int) -> None:
            loop.call_soon_threadsafe(future.set_result, code)

        out, err = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            # a daemon, so that a command that does not end fails its test, and no more
            threading.Thread(target=run_it, args=(words, ended), daemon=True).start()
            async with asyncio.timeout(30):
                code = await future
        return Finished(code, out.getvalue(), err.getvalue())

    return run_beside


@pytest.fixture
def system_of(meeting: int) -> SystemOf:
    """``async with system_of(Child(Talker)) as system``: nodes of this process, which commands find."""

    @asynccontextmanager
    async def started(
        *tree: Child | Supervisor | type[Node], observers: tuple[Any, ...] = ()
    ) -> AsyncGenerator[System]:
        transport = transport_from_environment(os.environ)
        async with run(*tree, transport=transport, signals=False, sinks=(), observers=observers) as system:
            yield system

    return started
