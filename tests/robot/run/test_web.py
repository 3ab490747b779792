"""Where the web server of a run is started, and what the robot does when it fails."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import Any

import pytest

from actors import Child, Node, Supervisor, System
from actors.testing import Rig
from robot.nodes import process_care
from robot.run.errands import UsageError
from robot.run.options import parse
from robot.run.web import CRASHES, start


class Worker(Node):
    """Stands for the robot."""


class Server(Node):
    """Stands for a web server."""


class Serve:
    """Starts a `Server` where it is told to."""

    def __init__(self, error: Exception | None = None) -> None:
        self._error = error
        self.apart = False

    async def __call__(
        self, system: System, /, *, apart: Callable[[Child], Awaitable[object]] | None, **where: Any
    ) -> None:
        self.apart = apart is not None
        if self._error is not None:
            raise self._error
        if apart is None:
            await system.join(Child(Server))
        else:
            await apart(Child(Server))


@pytest.fixture(autouse=True)
def no_stepping_aside(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(process_care, "step_aside", lambda: "stays")  # simulated processes are this one


async def running(rig: Rig) -> System:
    await rig.start(Supervisor("robot", children=[Child(Worker)]))
    return rig.system


async def test_where_the_robot_runs_in_one_process_the_server_is_in_it(rig: Rig) -> None:
    serve = Serve()
    await start(await running(rig), parse([]), serve)
    assert not serve.apart and rig.state("server").process == 0


async def test_where_the_robot_runs_in_processes_the_server_has_one_of_its_own(rig: Rig) -> None:
    await start(await running(rig), parse(["--processes"]), Serve())
    server, care = rig.state("server"), rig.state("web_process")
    assert server.process == care.process != 0
    assert server.path == ("robot", "web", "page", "server")


async def test_a_process_of_the_server_that_dies_is_started_anew_and_when_it_dies_for_good_the_robot_goes_on(
    rig: Rig,
) -> None:
    system = await running(rig)
    await start(system, parse(["--processes"]), Serve())
    with rig.expect_failure(node="page"):
        for life in range(1, CRASHES + 1):
            rig.kill_process("server")
            await rig.until(
                lambda life=life: rig.incarnation("server") == life + 1 and rig.state("server").state == "running"
            )  # type: ignore[misc]
        rig.kill_process("server")
        await rig.until(lambda: all(record.identity.name != "server" for record in system.nodes.values()))

    await rig.advance(10.0)
    assert system.running and rig.incarnation("worker") == 1


async def test_a_server_that_cannot_be_had_ends_the_run_only_if_it_was_asked_for(rig: Rig) -> None:
    system, broken = await running(rig), Serve(OSError("no ports left"))
    await start(system, parse([]), broken)
    assert any(line.event == "no web page" for line in system.records)
    with pytest.raises(UsageError, match="--web: no ports left"):
        await start(system, parse(["--web", "8765"]), broken)


async def test_there_is_none_where_it_is_switched_off(rig: Rig) -> None:
    serve = Serve(AssertionError("it was started"))
    await start(await running(rig), parse(["--no-web", "--processes"]), serve)
    assert not serve.apart
