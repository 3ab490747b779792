"""What a user asks of a running system: a node by its class or name, a crash on demand, and to be told of what happens."""

from __future__ import annotations

import asyncio

import pytest

from actors import Child, Node, Supervisor, System, run, temporary
from actors.errors import NotStarted
from actors.logs import LogRecord
from actors.runtime.incarnation import incarnation_of
from actors.runtime.node import ErrorVerdict
from actors.supervision.report import Report
from actors.system import system_of
from actors.testing import Rig


class Patrol(Node):
    """Notes the errors that it is asked about."""

    async def on_start(self) -> None:
        self.errors: list[tuple[str, str]] = []

    def on_error(self, error: Exception, handler: str) -> ErrorVerdict:
        self.errors.append((str(error), handler))
        return "continue" if str(error) == "a trifle" else None


class NightPatrol(Patrol):
    """Another kind of it."""


async def test_a_node_is_the_object_of_its_class_or_of_its_name(rig: Rig) -> None:
    system = await rig.start(NightPatrol, Child(Node, name="base", namespace="/home"))
    patrol = system.node(Patrol)
    assert isinstance(patrol, NightPatrol)
    assert system.node("night_patrol") is system.node("/night_patrol") is system.node(NightPatrol) is patrol
    assert system.node("/home/base").name == "base"
    assert system_of(patrol) is system
    assert system.nodes["system", "night_patrol"].node is patrol
    assert repr(system.nodes["system", "night_patrol"]) == "<record of /night_patrol, running, incarnation 1>"


async def test_none_and_several_are_refused_with_what_there_is(rig: Rig) -> None:
    system = await rig.start(Child(Patrol, name="left"), Child(Patrol, name="right"))
    with pytest.raises(LookupError) as none:
        system.node("lefft")
    there = "there are: /left (Patrol), /right (Patrol)"
    assert none.value.args == (f"no node in this system is called 'lefft'; {there}; did you mean 'left'?",)
    with pytest.raises(LookupError, match="2 nodes are a Patrol: say which one by its full name: /left, /right"):
        system.node(Patrol)
    with pytest.raises(LookupError, match=r"no node in this system is a NightPatrol; .*; did you mean 'Patrol'\?"):
        system.crash(NightPatrol, RuntimeError("never"))


async def test_one_that_has_ended_is_known_and_not_running(rig: Rig) -> None:
    system = await rig.start(Child(Patrol, restart=temporary), Node)
    patrol = rig.node(Patrol)
    patrol.stop("done")
    await rig.settled()
    with pytest.raises(NotStarted, match=r"^Patrol is not running now$"):
        system.node(Patrol)
    with pytest.raises(NotStarted, match=r"^/patrol is not running: it cannot crash now$"):
        system.crash("patrol", RuntimeError("never"))
    joined = await system.join(Child(Node, name="eye"))
    assert joined.node.name == "eye"
    await system.leave(joined)
    with pytest.raises(NotStarted, match=r"^/eye is not running$"):
        joined.node  # noqa: B018


async def test_a_crash_is_as_if_a_handler_had_raised(rig: Rig) -> None:
    system = await rig.start(Patrol)
    patrol = system.node(Patrol)
    system.crash(Patrol, OSError("a trifle"))
    await rig.settled()
    assert patrol.errors == [("a trifle", "crash")]
    assert system.node(Patrol) is patrol
    rig.expect_failure(OSError)
    system.crash("patrol", OSError("a loose wire"))
    await rig.settled()
    assert system.node(Patrol) is not patrol
    assert system.node(Patrol).incarnation == 2


@pytest.mark.virtual
async def test_observers_hear_of_reports_lines_and_the_end_in_the_order_in_which_they_asked() -> None:
    heard: list[str] = []

    class Observer:
        def attach(self, system: System) -> None:
            system.observe(reports=self.report, lines=self.line)
            system.observe(end=lambda: heard.append("end"))
            system.observe(end=lambda: heard.append("and the other's"))

        def report(self, report: Report) -> None:
            heard.append(f"report {report.context}")

        def line(self, record: LogRecord) -> None:
            heard.append(f"line {record.event}")

    async with run(Child(Patrol), sinks=(), observers=(Observer(),)) as system:
        system.log.info("under way")
    assert heard == ["report progress", "line under way", "end", "and the other's"]


@pytest.mark.virtual
async def test_what_runs_a_node_is_known_from_its_start_and_its_system_until_that_ends() -> None:
    with pytest.raises(NotStarted, match=r"^Patrol has not been started yet$"):
        incarnation_of(Patrol())
    async with run(Supervisor("s", children=[Child(Patrol)]), sinks=()) as system:
        patrol = system.node(Patrol)
        assert incarnation_of(patrol) is system.nodes["s", "patrol"].life
        async with run(Child(Patrol, name="other"), sinks=()) as second:
            assert system_of(second.node("other")) is second
            assert system_of(patrol) is system
    with pytest.raises(NotStarted, match=r"its system has ended$"):
        system_of(patrol)
    assert asyncio.all_tasks() == {asyncio.current_task()}
