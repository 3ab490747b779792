"""A graph of another process to look at, at a meeting point of its own."""

from __future__ import annotations

import asyncio
import os
import socket
import sys
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@dataclass(frozen=True)
class Finished:
    code: int
    out: str
    err: str


Command = Callable[..., Awaitable[Finished]]


@pytest.fixture
def port() -> int:
    """A free port of the loopback interface, so that no other graph of this machine is met."""
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])


@pytest.fixture
def environment(port: int) -> dict[str, str]:
    own = {"ROBACTOR_GOSSIP_PORT": str(port), "RMW_IMPLEMENTATION": "", "PYTHONPATH": str(ROOT), "ROS_DOMAIN_ID": "7"}
    return {**os.environ, **own}


@pytest.fixture
def robot(environment: dict[str, str]) -> Command:
    """``await robot("node", "list")``: run a command in a process of its own until it ends."""

    async def run_it(*words: str) -> Finished:
        process = await asyncio.create_subprocess_exec(
            sys.executable, "-m", "robot", *words, env=environment, stdout=-1, stderr=-1
        )
        try:
            async with asyncio.timeout(60):
                out, err = await process.communicate()
        finally:
            if process.returncode is None:
                process.kill()
                await process.wait()
        assert process.returncode is not None
        return Finished(process.returncode, out.decode(), err.decode())

    return run_it
