"""Where the web server of a run is started, and what the robot does when it fails."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import Any

import pytest

from actors import Child, Node, Supervisor, System
from actors.testing import Rig
from cli.command import UsageError
from robot.nodes import process_care
from robot.run.options import parse
from robot.run.web import start


class Worker(Node):
    """Stands for the robot."""


class Server(Node):
    """Stands for a web server."""


class Serve:
    """Starts a `Server`."""

    def __init__(self, error: Exception | None = None) -> None:
        self._error = error

    async def __call__(self, system: System, /, *, apart: Callable[[Child], Awaitable[object]], **where: Any) -> None:
        if self._error is not None:
            raise self._error
        await apart(Child(Server))


@pytest.fixture(autouse=True)
def no_stepping_aside(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(process_care, "step_aside", lambda: "stays")  # simulated processes are this one


async def running(rig: Rig) -> System:
    await rig.start(Supervisor("robot", children=[Child(Worker)]))
    return rig.system


@pytest.mark.parametrize("arguments", [[], ["--processes"]])
async def test_the_server_has_a_process_of_its_own_wherever_the_robot_runs(rig: Rig, arguments: list[str]) -> None:
    await start(await running(rig), parse(arguments), Serve())
    server, care = rig.state("server"), rig.state("web_process")
    assert server.process == care.process != 0 == rig.state("worker").process
    assert server.path == ("robot", "web", "page", "server")


async def test_a_process_of_the_server_that_dies_again_and_again_comes_back_and_the_robot_goes_on(rig: Rig) -> None:
    system = await running(rig)
    await start(system, parse([]), Serve())
    with rig.expect_failure(node="page"):
        for life in range(1, 13):
            rig.kill_process("server")
            await rig.until(
                lambda life=life: rig.incarnation("server") == life + 1 and rig.state("server").state == "running"
            )  # type: ignore[misc]
    assert system.running and rig.incarnation("worker") == 1


async def test_a_server_that_cannot_be_had_ends_the_run_only_if_it_was_asked_for(rig: Rig) -> None:
    system, broken = await running(rig), Serve(OSError("no ports left"))
    await start(system, parse([]), broken)
    assert any(line.event == "no web page" for line in system.records)
    with pytest.raises(UsageError, match="--web: no ports left"):
        await start(system, parse(["--web", "8765"]), broken)


async def test_there_is_none_where_it_is_switched_off(rig: Rig) -> None:
    await start(await running(rig), parse(["--no-web"]), Serve(AssertionError("it was started")))
