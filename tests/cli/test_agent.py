"""`agent`: what it refuses before it listens. What it does is in tests/actors/hosts."""

from __future__ import annotations

import asyncio
import signal
import socket
from pathlib import Path

import pytest

from cli.command import CommandFailed, UsageError
from cli.verbs import agent
from tests.actors.transport.security.fleet import Fleet
from tests.cli.conftest import Start


@pytest.fixture
def fleet(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Fleet:
    for name in ("ROBACTOR_SECURITY", "ROBACTOR_AGENT_LISTEN", "ROBACTOR_AGENT_CONNECT"):
        monkeypatch.setenv(name, "")
    monkeypatch.setenv("RMW_IMPLEMENTATION", "")
    return Fleet(tmp_path, "base", "robot")


def test_an_agent_without_a_security_file_does_not_start(fleet: Fleet) -> None:
    with pytest.raises(CommandFailed, match=r"must know who they are: --security FILE, or ROBACTOR_SECURITY=FILE"):
        agent.COMMAND.main(["--owner", "robot"])


def test_an_agent_for_nobody_does_not_start(fleet: Fleet) -> None:
    with pytest.raises(UsageError, match="--owner"):
        agent.COMMAND.main(["--security", str(fleet.file("base"))])


def test_an_agent_without_mutual_tls_does_not_start(fleet: Fleet) -> None:
    tls = {"authority": "authority.pem", "certificate": "certificate.pem", "key": "key.pem", "mutual": False}
    file = fleet.written("base", tls=tls, access=None)

    with pytest.raises(CommandFailed, match=r"agents need tls\.mutual"):
        agent.COMMAND.main(["--owner", "robot", "--security", str(file)])


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (("--at", "here:there"), "'here:there' is no address"),
        (("--security", "missing.yaml"), "missing.yaml"),
    ],
)
def test_a_mistake_shows_before_the_first_child_comes(fleet: Fleet, words: tuple[str, ...], text: str) -> None:
    with pytest.raises(CommandFailed) as failed:
        agent.COMMAND.main(["--owner", "robot", "--security", str(fleet.file("base")), *words])

    assert text in str(failed.value)


def test_an_address_that_is_taken_is_named(fleet: Fleet) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        at = f"127.0.0.1:{taken.getsockname()[1]}"
        with pytest.raises(CommandFailed, match=f"cannot listen at {at}: "):
            agent.COMMAND.main(["--owner", "robot", "--security", str(fleet.file("base")), "--at", at])


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
async def test_an_agent_waits_until_it_is_asked_to_end(
    fleet: Fleet, number: signal.Signals, code: int, start: Start
) -> None:
    words = ("--owner", "robot", "--owner", "desk", "--security", str(fleet.file("base")), "--at", "127.0.0.1:0")
    program = await start("agent", *words)
    async with asyncio.timeout(60):
        line = (await program.stdout.readline()).decode()
        program.send_signal(number)
        await program.wait()

    assert line.startswith("the agent waits at 127.0.0.1:")
    assert line.endswith(" for trees of robot, desk; Ctrl-C ends it\n")
    assert program.returncode == code
