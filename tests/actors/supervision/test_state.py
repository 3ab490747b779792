"""What the books of a supervisor say of its children, for those who show it: states, tasks, supervisors below."""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine
from typing import Any

import pytest

from actors.checks import create
from actors.supervision.child_task import GRACE, ChildTask
from actors.supervision.declarations import DynamicSupervisor, Supervisor
from actors.supervision.entry import Entry
from actors.supervision.errors import NotFound, StartFailed, SupervisorDown, SupervisorGaveUp
from actors.supervision.policy import Backoff, Intensity
from actors.supervision.report import Report
from actors.supervision.running import RunningSupervisor
from actors.supervision.steps import Steps
from tests.actors.supervision.kit import Script, World, child, launch, running, settle, virtual

SLOW = Backoff(5.0, 5.0, jitter=0.0)


@virtual
async def test_the_state_of_a_child_from_its_start_to_its_end() -> None:
    world = World(a=[Script(start=1.0, cleanup=1.0), Script(start=1.0, cleanup=1.0), Script(cleanup=1.0)])
    supervisor = await launch(world, Supervisor("root", children=[child("a", backoff=SLOW)]))
    assert supervisor.state_of("a") == "starting"
    await world.ready.wait()
    assert supervisor.state_of("a") == "running"
    world.crash("a")
    await asyncio.sleep(1.5)
    assert supervisor.state_of("a") == "restarting"
    await asyncio.sleep(5.0)
    assert world["a"].incarnation == 2
    assert supervisor.state_of("a") == "restarting", "it is in its start phase"
    await asyncio.sleep(5.0)
    assert supervisor.state_of("a") == "running"
    terminated = asyncio.ensure_future(supervisor.terminate_child("a"))
    await settle()
    assert supervisor.state_of("a") == "stopping"
    await terminated
    assert supervisor.state_of("a") == "stopped"
    assert supervisor.state_of("nobody") == "stopped"
    supervisor.stop()
    await world.host


@virtual
async def test_a_child_that_cleans_up_after_an_end_of_its_own_is_stopping() -> None:
    world = World(a=[Script(cleanup=1.0)])
    async with running(world, Supervisor("root", children=[child("a")])) as supervisor:
        task = supervisor.incarnation("a")
        assert task is not None
        assert task.state == "running"
        task.bound()
        assert task.state == supervisor.state_of("a") == "stopping"
        world.crash("a")
        await asyncio.sleep(1.5)
        assert task.state == "stopped"
        assert supervisor.state_of("a") == "running"


@virtual
async def test_the_state_below_a_supervisor_that_does_not_run_is_that_supervisors() -> None:
    world = World()
    sub = Supervisor("sub", backoff=SLOW, children=[child("a"), child("b")])
    async with running(world, Supervisor("root", children=[sub])) as root:
        assert root.state_of("sub/a") == root.state_of(("sub", "b")) == "running"
        assert root.state_of("sub") == "running"
        assert root.state_of("sub/nobody") == "stopped"
        below = root.life("sub")
        assert isinstance(below, RunningSupervisor)
        assert list(root.below()) == [root, below]
        for _ in range(4):
            world.crash("a")
            await settle()
        assert root.state_of("sub") == root.state_of("sub/a") == "restarting"
        assert root.which("sub/a") is None
        assert root.life("sub/a") is None
        assert root.incarnation("sub/a") is None
        assert list(root.below()) == [root]
        await asyncio.sleep(5.5)
        assert root.state_of("sub/a") == "running"
        with pytest.raises(NotFound, match="a is not a running supervisor"):
            root.life("sub/a/x")


@virtual
async def test_a_life_that_has_not_come_to_its_first_step_is_starting() -> None:
    world = World()
    supervisor = create(RunningSupervisor, Supervisor("root", children=[child("a")]), world)
    host = asyncio.ensure_future(supervisor.run(lambda: None))
    assert (supervisor.phase, supervisor.state_of("a")) == ("new", "stopped")
    await asyncio.sleep(0)
    task = supervisor.incarnation("a")
    assert task is not None
    assert (task.state, task.life) == ("starting", None)
    assert supervisor.lives() == [None]
    supervisor.stop()
    await host
    assert world.log == []
    assert world.errors() == [], "a child that is stopped so early has been shut down as any other"


@virtual
async def test_statuses() -> None:
    world = World()
    async with running(world, Supervisor("root", children=[child("a"), child("b", backoff=SLOW)])) as supervisor:
        world.crash("a")
        world.crash("b")
        await settle()
        statuses = supervisor.statuses()
        assert [(name, status.state, status.number) for name, status in statuses.items()] == [
            ("a", "running", 2),
            ("b", "restarting", 1),
        ]
        assert statuses["a"].task is world["a"].task
        assert statuses["b"].task is None
        assert supervisor.recent_restarts == 2


@virtual
async def test_a_request_that_is_taken_back_before_its_turn_is_answered_to_nobody() -> None:
    class Busy(World):
        def report(self, report: Report) -> None:
            super().report(report)
            for story in self.stories:
                withdrawn: Any = story.send(None)  # it waits for its turn, which comes after this report
                withdrawn.cancel()
                story.close()
            self.stories.clear()

        stories: list[Coroutine[Any, Any, Any]] = []

    world = Busy()
    async with running(world, DynamicSupervisor("pool", child("a"))) as pool:
        world.stories += [pool.start_child(child("b")), pool.reconfigure(pool.spec)]
        await pool.spawn()
        await settle()
        assert [each.id for each in pool.children()] == ["a_1"]
        assert pool.phase == "running"


@virtual
async def test_a_request_out_of_the_report_that_the_supervisor_gives_up_starts_nothing() -> None:
    class Hopeful(World):
        def report(self, report: Report) -> None:
            super().report(report)
            if report.context == "shutdown":
                self.story = supervisor.start_child(child("b"))
                self.request: asyncio.Future[Any] = self.story.send(None)

    world = Hopeful()
    async with running(world, Supervisor("root", intensity=Intensity(0), children=[child("a")])) as supervisor:
        world.crash("a")
        await settle()
        assert isinstance(world.request.exception(), SupervisorDown)
        world.story.close()
        assert isinstance(world.host.exception(), SupervisorGaveUp)
        assert world.events("start") == ["start a"]


@virtual
async def test_a_child_that_was_terminated_in_its_first_start_stays_known_whatever_becomes_of_its_next() -> None:
    world = World(b=[Script(start=1.0), Script(refuse=OSError("dead"))])
    async with running(world, Supervisor("root", children=[child("a")])) as supervisor:
        starting = asyncio.ensure_future(supervisor.start_child(child("b")))
        await settle()
        await supervisor.terminate_child("b")
        with pytest.raises(StartFailed, match="terminated before it had started"):
            await starting
        with pytest.raises(StartFailed, match="dead"):
            await supervisor.restart_child("b")
        assert supervisor.state_of("b") == "stopped"
        assert supervisor.child_spec("b").name == "b"


@virtual
async def test_a_child_that_is_being_killed_gets_no_more_time_whatever_becomes_of_it_meanwhile() -> None:
    world = World(a=[Script(stubborn=True), Script()])
    async with running(world, Supervisor("root", children=[child("a", stop=100.0)])) as supervisor:
        task = supervisor.incarnation("a")
        assert task is not None
        task.kill()
        task.fail(OSError("too late"), 100.0)
        assert task.imposed is None
        task.bound()
        await asyncio.sleep(GRACE + 0.5)
        assert task.state == "stopped"
        assert [leaked.ref for leaked in supervisor.leaked] == [task.ref]
        world.released.set()


# -- work in order --------------------------------------------------------------------------------------------------------


def planned(*names: str) -> tuple[Steps, list[Entry]]:
    """Steps that are to start these children, the first one first."""
    entries = [Entry(child(name), position) for position, name in enumerate(names)]
    for entry in entries:
        entry.intent = "start"
    steps = Steps()
    steps.plan(entries)
    return steps, entries


def test_there_is_work_as_long_as_a_start_waits_or_is_under_way() -> None:
    steps, (a,) = planned("a")
    assert steps.busy, "a waits for its start"
    assert steps.next_start() is a
    assert steps.busy, "a is being started"
    steps.current = None
    assert not steps.busy


def test_there_is_work_as_long_as_a_stop_waits() -> None:
    steps, (a,) = planned("a")
    a.intent, a.marked = "", True
    steps.plan([a])
    assert steps.busy, "a waits for its stop"
    assert steps.next_stop() is a
    steps.current = None
    assert not steps.busy


def test_a_child_is_queued_as_long_as_its_start_waits() -> None:
    steps, entries = planned("a", "b", "c")
    assert [entry.queued for entry in entries] == [True, True, True]
    steps.next_start()
    assert [entry.queued for entry in entries] == [False, True, True]
    steps.clear()
    assert [entry.queued for entry in entries] == [False, False, False]
    assert not steps.busy


@virtual
async def test_the_task_of_a_childs_life_is_told_from_all_others() -> None:
    world = World()
    async with running(world, Supervisor("root", children=[child("a")])) as supervisor:
        life = supervisor.incarnation(("a",))
        assert life is not None
        of_lives = [task for task in asyncio.all_tasks() if ChildTask.runs_in(task)]
        assert of_lives == [life.task]
        assert not ChildTask.runs_in(world.host)
