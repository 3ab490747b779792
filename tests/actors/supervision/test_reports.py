"""What a supervisor tells, keeps and survives: reports, memory, scale, nonsense, links and monitors."""

from __future__ import annotations

import asyncio
import contextvars
import cProfile
import gc
import weakref
from collections.abc import Callable
from typing import Any

import pytest

from actors.checks import create
from actors.supervision.child import Child
from actors.supervision.child_task import ChildTask
from actors.supervision.declarations import DynamicSupervisor, Supervisor
from actors.supervision.errors import SupervisorGaveUp
from actors.supervision.policy import Backoff, Intensity, rest_for_one, temporary, transient
from actors.supervision.reasons import Failed, Gone, Killed, Leaked, Returned, Skip, Stop, Stopped, is_abnormal
from actors.supervision.refs import ChildRef, Down
from actors.supervision.report import Report
from actors.supervision.running import RunningSupervisor
from tests.actors.supervision.kit import Script, World, child, node, run_virtual, running, settle, state, virtual

OFTEN = Intensity(1000, within=1.0)


@virtual
async def test_one_structured_report_per_event() -> None:
    crashed, refused, jammed = OSError("crashed"), OSError("refused"), OSError("jammed")
    world = World(b=[Script(), Script(refuse=refused), Script()], c=[Script(), Script(cleanup=100), Script()])
    children = [child("a"), child("b"), child("c", stop=2.0)]
    tree = Supervisor("root", strategy=rest_for_one, intensity=Intensity(3, within=100), children=children)
    async with running(world, tree) as supervisor:
        refs = [supervisor.which(name) for name in "abc"]
        assert [(each.context, each.child) for each in world.reports] == [("progress", ref) for ref in refs]
        world.reports.clear()
        world.crash("b", crashed)
        await asyncio.sleep(1)
        told = [(each.context, each.child.id, each.child.incarnation, each.reason) for each in world.reports]
        assert told == [
            ("child_terminated", "b", 1, Failed(crashed)),
            ("start_error", "b", 2, Failed(refused)),
            ("progress", "b", 3, None),
            ("progress", "c", 2, None),
        ]
        world.reports.clear()
        world.crash("a", jammed)
        await asyncio.sleep(3)
        assert [(each.context, each.child.id, each.at) for each in world.reports] == [
            ("child_terminated", "a", 1.0),
            ("shutdown_error", "c", 3.0),
            ("progress", "a", 3.0),
            ("progress", "b", 3.0),
            ("progress", "c", 3.0),
        ]
        assert world.reports[1].reason == Killed(2.0)
        world.reports.clear()
        world.crash("a")
        with pytest.raises(SupervisorGaveUp):
            await world.host
        assert world.errors() == ["child_terminated a", "shutdown a"]
        assert all(each.supervisor == ("root",) and each.restart == "permanent" for each in world.reports)


def test_reports_and_reasons_read_well() -> None:
    ref = ChildRef(("robot", "gaits", "walk"), 3)
    report = Report("child_terminated", ("robot", "gaits"), ref, "permanent", 1.0, Failed(OSError("no encoder")))
    assert str(report) == "robot/gaits: child_terminated: walk (incarnation 3): it raised OSError: no encoder"
    assert str(Report("progress", ("robot",), ref, "permanent", 1.0)) == "robot: progress: walk (incarnation 3)"
    assert str(Down(ref, Returned())) == "robot/gaits/walk#3: it returned"
    assert [
        str(reason) for reason in (Stopped("SIGTERM"), Killed(5.0), Killed(0.0), Killed(None), Leaked(1.0), Gone())
    ] == [
        "it stopped: SIGTERM",
        "it was killed after 5 s of clean-up",
        "it was killed",
        "it was cancelled by somebody other than its supervisor",
        "it refused to die within 1 s after the kill and was abandoned; its task may still run",
        "it had ended before it was watched",
    ]
    assert [is_abnormal(reason) for reason in (Returned(), Stopped(), Failed(OSError()), Killed(1.0), Leaked(1.0))] == [
        *(False, False, True, True, True)
    ]
    assert str(Stop()) == "shutdown"


def test_a_stop_and_a_skip_that_are_caught_say_why() -> None:
    assert (str(Stop("battery empty")), str(Stop()), str(Skip("no camera"))) == (
        "battery empty",
        "shutdown",
        "no camera",
    )


@virtual
async def test_what_a_debugger_shows_reads_well() -> None:
    async with running(World(), Supervisor("root", children=[child("a")])) as supervisor:
        entry = supervisor._children["a"]
        assert repr(entry) == "<entry a running#1>"
        assert repr(entry.now) == "<incarnation root/a#1>"
        assert entry.now is not None
        assert entry.now.task.get_name() == "root/a#1"


@virtual
async def test_a_report_hook_that_raises_does_not_keep_the_supervisor_from_its_work() -> None:
    class Deaf(World):
        def report(self, report: Report) -> None:
            super().report(report)
            raise ValueError("the log is full")

    complaints: list[dict[str, Any]] = []
    asyncio.get_running_loop().set_exception_handler(lambda _, context: complaints.append(context))
    world = Deaf()
    async with running(world, Supervisor("root", children=[child("a")])):
        world.crash("a")
        await settle()
        assert world["a"].incarnation == 2
    assert len(complaints) == 3
    assert complaints[0]["message"] == "supervisor root: report() raised; the supervisor goes on"
    assert str(complaints[0]["exception"]) == "the log is full"


@virtual
async def test_a_report_hook_may_stop_the_supervisor_and_take_back_a_watch() -> None:
    class Alarmed(World):
        def report(self, report: Report) -> None:
            super().report(report)
            if report.context == "child_terminated":
                watch.cancel()
                supervisor.stop("alarm")
                supervisor.stop("second thoughts")

    complaints: list[dict[str, Any]] = []
    asyncio.get_running_loop().set_exception_handler(lambda _, context: complaints.append(context))
    world = Alarmed()
    async with running(world, Supervisor("root", children=[child("a"), child("b")])) as supervisor:
        ref = supervisor.which("a")
        assert ref is not None
        watch = asyncio.ensure_future(supervisor.watch(ref))
        world.crash("a")
        await world.host
        assert watch.cancelled()
        assert world.events("start") == ["start a", "start b", "start a"], "the event under way is finished first"
        assert set(world.reasons) == {"alarm"}
    assert complaints == []


@virtual
async def test_the_runtime_hears_which_children_only_a_request_will_start_again() -> None:
    world = World(a=[Script(), Script(start=1)], d=Script(refuse=Skip()))
    backoff = Backoff(10.0, 10.0)
    tree = Supervisor(
        "root",
        intensity=OFTEN,
        children=[child("a"), child("b", restart=transient), child("c", backoff=backoff), child("d"), child("e")],
    )
    async with running(world, tree) as supervisor:
        assert world.gone_for_good == ["root/d"]
        world.crash("a")
        world.finish("b")
        world.crash("c")
        await settle()
        assert world.gone_for_good == ["root/d", "root/b"], "a and c come back by themselves"
        await supervisor.terminate_child("c")
        await supervisor.terminate_child("e")
        await supervisor.restart_child("e")
        assert world.gone_for_good == ["root/d", "root/b", "root/c", "root/e"]
    assert world.gone_for_good == ["root/d", "root/b", "root/c", "root/e"], "not while all end"
    assert world.forgotten == []


@virtual
async def test_the_runtime_hears_which_children_nobody_can_start_again() -> None:
    world = World()
    tree = Supervisor("root", children=[child("declared", restart=temporary)])
    async with running(world, tree) as supervisor:
        await supervisor.start_child(child("added"))
        await supervisor.start_child(child("passing", restart=temporary))
        for name in ("declared", "added", "passing"):
            await supervisor.terminate_child(name)
        assert world.gone_for_good == ["root/declared", "root/added", "root/passing"]
        assert world.forgotten == ["root/passing"]


@virtual
async def test_a_supervisor_that_breaks_kills_its_children_and_says_why() -> None:
    class Wrong(World):
        @property
        def rng(self) -> Any:
            raise LookupError("no randomness here")

        @rng.setter
        def rng(self, value: object) -> None: ...

    world = Wrong()
    backoff = Backoff(1.0, 2.0)
    tree = Supervisor("root", children=[child("a", backoff=backoff), child("b"), child("c", backoff=backoff)])
    async with running(world, tree):
        world.crash("a")
        world.crash("c")
        with pytest.raises(LookupError, match="no randomness here"):
            await world.host
        assert world.events("cancelled") == ["cancelled b"]
        assert asyncio.get_running_loop().time() == 0


class Cargo:
    """Something large, whose memory can be seen to go."""


@pytest.mark.parametrize("dynamic", [True, False])
@virtual
async def test_nothing_is_kept_for_ended_temporary_children(dynamic: bool) -> None:
    class Carrier:
        def __init__(self, child: Child) -> None:
            self.child = child

        async def run(self, started: Callable[[], None]) -> None:
            started()
            error = OSError("with cargo")
            error.cargo = self.child.args[0]  # type: ignore[attr-defined]
            raise error

        def stop(self, reason: str) -> None: ...

    class Runtime(World):
        def life(self, task: ChildTask) -> Carrier:  # type: ignore[override]
            assert isinstance(task.entry.spec, Child)
            return Carrier(task.entry.spec)

        def report(self, report: Report) -> None: ...

    world, cargo = Runtime(), list[weakref.ref[Cargo]]()
    template = child("a", restart=temporary)
    tree = DynamicSupervisor("pool", template) if dynamic else Supervisor("root")
    async with running(world, tree) as supervisor:
        for number in range(1_000):
            load = Cargo()
            cargo.append(weakref.ref(load))
            if dynamic:
                await supervisor.spawn(load)
            else:
                await supervisor.start_child(template.replace(name=f"a_{number}", args=(load,)))
        del load
        await settle()
        gc.collect()
        assert supervisor.counts().specs == 0
        assert sum(ref() is not None for ref in cargo) == 0
        assert len(asyncio.all_tasks()) == 2, "the host and this test"


def calls_of(story: Callable[[], Any]) -> int:
    """How many functions a story calls, on virtual time: its cost, without a clock."""
    profile = cProfile.Profile()
    profile.enable()
    try:
        run_virtual(story())
    finally:
        profile.disable()
    return sum(entry.callcount for entry in profile.getstats())


@pytest.mark.parametrize("kind", ["static", "dynamic"])
def test_linear_start_and_stop(kind: str) -> None:
    def story(number: int) -> Callable[[], Any]:
        async def grow_and_shrink() -> None:
            world, names = World(), [f"a_{n}" for n in range(1, number + 1)]
            children = [child(name, restart=transient) for name in names]
            dynamic = kind == "dynamic"
            tree = DynamicSupervisor("root", child("a")) if dynamic else Supervisor("root", children=children)
            supervisor = create(RunningSupervisor, tree, world)
            ready = asyncio.Event()
            host = asyncio.ensure_future(supervisor.run(ready.set))
            await ready.wait()
            world.alive = set_of_lives()  # type: ignore[assignment]
            for name in names if kind == "dynamic" else ():
                await supervisor.spawn(name=name)
            for name in names if kind == "dynamic" else ():
                await supervisor.terminate_child(name)
            supervisor.stop()
            await host

        return grow_and_shrink

    small, large = (calls_of(story(number)) / number for number in (50, 2_000))
    assert large < 2 * small


class set_of_lives(dict[Any, None]):
    def append(self, life: object) -> None:
        self[life] = None

    def remove(self, life: object) -> None:
        self.pop(life, None)


@virtual
async def test_unknown_input_is_not_fatal() -> None:
    world = World()
    async with running(world, Supervisor("root", children=[child("a")])) as supervisor:
        first = world["a"]
        first.started()
        assert world.errors() == ["unexpected a"]
        world.crash("a")
        await settle()
        first.started()
        assert world.errors() == ["unexpected a", "child_terminated a", "unexpected a"]
        assert "once more" in world.reports[1].note
        assert state(supervisor, "a") == "running"


@virtual
async def test_children_run_in_the_supervisors_context_whoever_starts_them() -> None:
    name = contextvars.ContextVar[str]("name")
    seen: list[str] = []

    class Curious(World):
        def life(self, *args: Any) -> Any:
            seen.append(name.get())
            name.set("changed by the child")
            return super().life(*args)

    name.set("owner")
    world = Curious()
    async with running(world, Supervisor("root", children=[child("a")])) as supervisor:
        name.set("caller")
        await supervisor.start_child(child("b"))
        world.crash("b")
        await settle()
        assert seen == ["owner"] * 3


@virtual
async def test_a_started_callback_that_raises_is_told_to_the_loop() -> None:
    complaints: list[str] = []
    asyncio.get_running_loop().set_exception_handler(lambda _, context: complaints.append(context["message"]))
    supervisor = create(RunningSupervisor, Supervisor("root"), World())

    def started() -> None:
        raise ValueError

    host = asyncio.ensure_future(supervisor.run(started))
    await settle()
    assert complaints == ["supervisor root: started() raised; the supervisor goes on"]
    supervisor.stop()
    await host


def test_a_backoff_is_not_asked_for_randomness_unless_it_is_needed() -> None:
    class Dull(World):
        @property
        def rng(self) -> Any:
            raise AssertionError("nobody asked for a backoff")

        @rng.setter
        def rng(self, value: object) -> None: ...

    async def story() -> None:
        world = Dull()
        async with running(world, Supervisor("root", intensity=OFTEN, children=[Child(node, name="a")])):
            world.crash("a")
            await settle()
            assert world["a"].incarnation == 2

    run_virtual(story())
    assert Backoff(1.0, 2.0).jitter == 0.2
