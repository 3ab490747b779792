"""In a Rig each child with ``process=True`` is a simulated process: another system on the same virtual clock, reached by a transport."""

from __future__ import annotations

import asyncio
import io
import json
from types import SimpleNamespace, TracebackType
from typing import Any, cast

import pytest
import structlog

from actors import (
    Child,
    DynamicSupervisor,
    ExitReason,
    Intensity,
    LifecycleNode,
    Node,
    Service,
    ServiceFailed,
    Skip,
    StartFailed,
    Stop,
    Supervisor,
    SupervisorGaveUp,
    Topic,
    every,
    parameter,
    publishes,
    run,
    temporary,
    transient,
)
from actors.errors import NotStarted, ProcessDied
from actors.interfaces.lifecycle_msgs.msg import Transition
from actors.interfaces.lifecycle_msgs.srv import ChangeState, GetState
from actors.interfaces.std_msgs.msg import Int32
from actors.interfaces.std_srvs.srv import Trigger
from actors.logs import LogRecord, console_sink, json_sink, structlog_sink
from actors.places import traceback_of, users_trace
from actors.processes.child_processes import SimulatedProcess
from actors.processes.messages import StopAsked
from actors.processes.parent import KNOWN_SECONDS, ParentSide
from actors.processes.pickling import pack, unpack
from actors.supervision import Killed, Stopped
from actors.supervision.errors import NotFound
from actors.supervision.refs import ChildRef
from actors.testing import Rig
from tests.actors.processes.test_life import Stage
from tests.actors.supervision.kit import virtual
from tests.facts import lacks

COUNT = Topic(Int32, "count")
DO = Service(Trigger, "do")


class Counter(Node):
    """Counts, and leaves its count to its next life."""

    step = parameter(1)
    out = publishes(COUNT)

    def __init__(self) -> None:
        super().__init__()
        self.count = 0

    def resume(self, state: Any) -> None:
        self.count = state

    @every(hz=10)
    def tick(self) -> None:
        self.count += self.step
        self.checkpoint(self.count)
        self.out(Int32(data=self.count))

    async def on_stop(self, reason: ExitReason) -> None:
        self.log.info("stopping", why=str(reason))


class Doer(Node):
    """Does what it was made for when it is asked to."""

    def __init__(self, what: str) -> None:
        super().__init__()
        self.what = what

    @DO.serve()
    async def do(self, request: Any) -> Any:
        if self.what == "stop":
            self.create_task(self._stop())
        elif self.what == "exit":
            raise SystemExit(4)
        elif self.what == "odd checkpoint":
            self.checkpoint(lambda: 1)
        else:
            raise OSError(self.what)
        return Trigger.Response(success=True, message="")

    async def _stop(self) -> None:
        raise Stop("enough")


class Slow(Node):
    """Takes its time: to start, and to stop."""

    def __init__(self, start: float = 0.0, stop: float = 0.0) -> None:
        super().__init__()
        self.times = start, stop

    async def on_start(self) -> None:
        await self.clock.sleep(self.times[0])

    async def on_stop(self, reason: ExitReason) -> None:
        self.log.info("stopping")
        await asyncio.sleep(self.times[1])
        self.log.info("stopped")


class Refusing(Node):
    async def on_start(self) -> None:
        raise OSError("no device")


class Declining(Node):
    async def on_start(self) -> None:
        raise Skip("no device today")


class Managed(LifecycleNode):
    """A managed node."""


def lines(rig: Rig, event: str) -> list[tuple[str, int]]:
    """The log lines with this event: who wrote them, in which process."""
    return [(line.node, line.fields.get("process", 0)) for line in rig.logs if line.event == event]


def kinds(rig: Rig) -> list[str]:
    return [f"{each.context} {each.child.id}" for each in rig.reports if each.context != "progress"]


async def test_a_node_of_another_process_is_seen_as_a_node_of_this_one(rig: Rig) -> None:
    await rig.start(Supervisor("top", children=[Child(Counter, process=True, parameters={"step": 5})]))
    counts = rig.probe(COUNT)
    await rig.advance(1.0)
    assert [each.data for each in counts.messages][-3:] == [40, 45, 50]
    record = rig.state("counter")
    assert (record.state, record.incarnation, record.path) == ("running", 1, ("top", "counter"))
    assert record.process > 0
    assert [
        (node.name, node.state, node.process) for node in rig.system.snapshot().nodes if node.name == "/counter"
    ] == [("/counter", "running", record.process)]
    with pytest.raises(NotStarted, match="runs in process"):
        rig.node("counter")


@virtual
async def test_a_process_whose_nodes_are_not_reached_is_told_and_then_has_not_started(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(ParentSide, "_missing", lambda parent: {"/counter"})
    told: list[LogRecord] = []
    with pytest.raises(StartFailed, match=r"the transport has not reached /counter for 20 s: .* ROBACTOR_GOSSIP_PORT"):
        async with run(Supervisor("top", children=[Child(Counter, process=True)]), sinks=(told.append,)):
            pass
    (warned,) = [line for line in told if line.event == "waiting for a process that is ready, and not reached yet"]
    assert (warned.time, warned.fields["nodes"]) == (pytest.approx(KNOWN_SECONDS, abs=0.1), ["/counter"])


@virtual
async def test_a_process_that_is_reached_late_has_started(monkeypatch: pytest.MonkeyPatch) -> None:
    missing, told = {"/counter"}, list[LogRecord]()
    parents: list[Any] = []

    def still_missing(parent: ParentSide) -> set[str]:
        parents.append(parent)
        return missing

    def reach() -> None:
        missing.clear()
        parents[-1]._looking.wake_all()

    monkeypatch.setattr(ParentSide, "_missing", still_missing)
    asyncio.get_running_loop().call_later(5.0, reach)
    async with run(Supervisor("top", children=[Child(Counter, process=True)]), sinks=(told.append,)) as system:
        assert system.clock.now() == pytest.approx(5.0, abs=0.1)
    assert [line.event for line in told].count("waiting for a process that is ready, and not reached yet") == 1


@virtual
async def test_a_process_of_another_machine_is_not_waited_for_longer_than_two_seconds() -> None:
    loop = asyncio.get_running_loop()
    graph = SimpleNamespace(on_change=lambda listener: lambda: None)
    parent: Any = ParentSide(
        cast("Any", SimpleNamespace(graph=graph, enter=lambda spec, path: None)),
        cast("Any", None),
        cast(
            "Any",
            SimpleNamespace(
                entry=SimpleNamespace(spec=Child(Counter, name="far", host="far")), ref=ChildRef(("far",), 1)
            ),
        ),
        cast("Any", None),
    )
    parent._missing = lambda: {"/far"}
    begun = loop.time()
    await parent.known()
    assert loop.time() - begun == pytest.approx(KNOWN_SECONDS, abs=0.1)


async def test_a_killed_process_is_restarted_and_its_node_goes_on_from_its_checkpoint(rig: Rig) -> None:
    await rig.start(Supervisor("top", children=[Child(Counter, process=True)]))
    counts = rig.probe(COUNT)
    await rig.advance(1.0)
    first = rig.state("counter").process
    with rig.expect_failure(ProcessDied, node="counter", match="SIGKILL"):
        rig.kill_process("counter")
        await rig.advance(1.0)
    assert rig.incarnation("counter") == 2
    assert rig.state("counter").process != first
    ((_, why),) = rig.state("counter").restarts
    assert lacks(why, f"ProcessDied {first} SIGKILL") == []
    data = [each.data for each in counts.messages]
    assert data[-1] > 15 and data == sorted(data)
    assert lines(rig, "stopping") == []


async def test_a_crash_is_planned_in_whichever_process_the_node_runs(rig: Rig) -> None:
    inner = Supervisor("inner", process=True, children=[Child(Counter), Child(Counter, name="other", process=True)])
    await rig.start(Supervisor("top", children=[inner]))
    rig.crash("counter", OSError("broken"))
    await rig.advance(0.5)
    rig.crash("other", OSError("broken, too"))
    await rig.advance(0.5)
    assert kinds(rig) == ["child_terminated counter", "child_terminated other"]
    assert [rig.incarnation(name) for name in ("counter", "other")] == [2, 2]
    assert [rig.state(name).restart_count for name in ("counter", "other")] == [1, 1]


async def test_what_cannot_crash_or_be_killed_is_refused(rig: Rig) -> None:
    await rig.start(
        Supervisor("top", children=[Child(Counter, name="here"), Child(Counter, process=True, restart=transient)])
    )
    with pytest.raises(NotStarted, match="has no process of its own"):
        rig.kill_process("here")
    supervisor = rig.system.supervisor
    assert supervisor is not None
    await supervisor.terminate_child("counter")
    with pytest.raises(NotStarted, match="cannot crash now"):
        rig.crash("counter")
    rig.kill_process("counter")  # its process has ended: nothing happens
    rig.system.runtime.processes.crash(("top", "counter"), OSError())
    await rig.advance(0.1)
    assert kinds(rig) == []


async def test_the_children_of_a_subtree_are_supervised_there_and_seen_here(rig: Rig) -> None:
    inner = Supervisor(
        "inner",
        process=True,
        intensity=Intensity(1, within=60.0),
        children=[Child(Counter), Child(Doer, args=("sick",))],
    )
    await rig.start(Supervisor("top", children=[inner]))
    (process,) = {rig.state(name).process for name in ("counter", "doer")}
    supervisor = rig.system.supervisor
    assert supervisor is not None
    assert [rig.state(name).state for name in ("counter", "doer")] == ["running", "running"]
    with pytest.raises(NotFound, match="inner runs in another process"):
        supervisor.which("inner/counter")
    assert supervisor.state_of("inner/nobody") == "stopped"
    rig.crash("doer")
    await rig.advance(0.5)
    assert kinds(rig) == ["child_terminated doer"]
    assert lines(rig, "child terminated") == [("top/inner", process)]
    assert rig.state("doer").restarts[0][0] < rig.now
    with rig.expect_failure(SupervisorGaveUp, node="inner"):
        rig.crash("doer")
        await rig.advance(0.5)
    assert kinds(rig)[1:] == ["child_terminated doer", "shutdown doer", "child_terminated inner"]
    assert {rig.state(name).state for name in ("counter", "doer")} == {"running"}
    assert rig.incarnation("doer") == 3
    assert rig.incarnation("counter") == 2
    assert rig.state("counter").process != process


async def test_the_death_of_a_process_takes_its_subtree_with_it_and_processes_below_it(rig: Rig) -> None:
    inner = Supervisor("inner", process=True, children=[Child(Counter), Child(Counter, name="deep", process=True)])
    await rig.start(Supervisor("top", children=[inner]))
    outer, deep = rig.state("counter").process, rig.state("deep").process
    assert outer != deep
    with rig.expect_failure(ProcessDied, node="inner"):
        rig.kill_process("counter")
        await rig.advance(0.5)
    assert len({outer, deep, rig.state("counter").process, rig.state("deep").process}) == 4
    assert [rig.incarnation(name) for name in ("counter", "deep")] == [2, 2]


async def test_errors_of_a_service_keep_their_meaning_and_the_process_goes_on_if_its_node_does(rig: Rig) -> None:
    await rig.start(Supervisor("top", children=[Child(Doer, args=("sick",), process=True)]))
    with pytest.raises(ServiceFailed, match="sick"):
        await rig.call(DO, Trigger.Request())
    assert rig.incarnation("doer") == 1


async def test_an_orderly_end_by_itself_is_one(rig: Rig) -> None:
    await rig.start(Supervisor("top", children=[Child(Doer, args=("stop",), process=True, restart=transient)]))
    await rig.call(DO, Trigger.Request())
    await rig.advance(0.5)
    assert rig.state("doer").state == "stopped"
    assert kinds(rig) == []


async def test_a_node_that_exits_the_program_ends_the_whole_tree(rig: Rig) -> None:
    system = await rig.start(Supervisor("top", children=[Child(Counter), Child(Doer, args=("exit",), process=True)]))
    with rig.expect_failure(BaseException, node="doer"), pytest.raises(Exception, match="doer"):
        await rig.call(DO, Trigger.Request())
    await system.wait()
    assert system.exit_code == 4


async def test_a_checkpoint_that_cannot_be_copied_is_logged_and_lost(rig: Rig) -> None:
    await rig.start(Supervisor("top", children=[Child(Doer, args=("odd checkpoint",), process=True)]))
    await rig.call(DO, Trigger.Request())
    rig.crash("doer")
    await rig.advance(0.5)
    assert lines(rig, "a checkpoint cannot cross to another process") != []
    assert rig.incarnation("doer") == 2


async def test_a_managed_node_is_brought_back_to_the_state_that_was_asked_of_it(rig: Rig) -> None:
    await rig.start(Supervisor("top", children=[Child(Managed, process=True)]))
    change = Service(ChangeState, "/managed/change_state")
    for transition in (Transition.TRANSITION_CONFIGURE, Transition.TRANSITION_ACTIVATE):
        assert (await rig.call(change, ChangeState.Request(transition=Transition(id=transition)))).success
    with rig.expect_failure(ProcessDied):
        rig.kill_process("managed")
        await rig.advance(1.0)
    answer = await rig.call(Service(GetState, "/managed/get_state"), GetState.Request())
    assert answer.current_state.label == "active"


async def test_a_failed_start_has_its_cause(rig: Rig) -> None:
    with pytest.raises(StartFailed, match="no device") as caught, rig.expect_failure(OSError):
        await rig.start(Supervisor("top", children=[Child(Counter), Child(Refusing, process=True)]))
    assert isinstance(caught.value.__cause__, OSError)


async def test_a_child_may_decline_to_start(rig: Rig) -> None:
    await rig.start(Supervisor("top", children=[Child(Declining, process=True), Child(Counter)]))
    assert rig.state("counter").state == "running"
    supervisor = rig.system.supervisor
    assert supervisor is not None
    assert supervisor.children()[0].state == "stopped"
    assert kinds(rig) == []


async def test_a_clean_up_that_takes_too_long_is_cut_short(rig: Rig) -> None:
    await rig.start(Supervisor("top", children=[Child(Slow, args=(0.0, 60.0), process=True, stop=2.0)]))
    begun = rig.now
    await rig.stop()
    assert rig.now - begun == pytest.approx(2.0, abs=0.5)
    assert rig.reports[-1].reason == Killed(2.0)
    assert len(lines(rig, "stopping")) == 1
    assert lines(rig, "stopped") == []


async def test_a_process_that_ends_by_itself_may_not_clean_up_for_ever(rig: Rig) -> None:
    await rig.start(
        Supervisor("top", children=[Child(Slow, args=(0.0, 60.0), process=True, stop=2.0, restart=temporary)])
    )
    with rig.expect_failure():
        rig.crash("slow")
        await rig.advance(5.0)
    assert rig.reports[-1].reason == Killed(2.0)


async def test_a_start_is_broken_off_when_the_child_is_to_stop(rig: Rig) -> None:
    await rig.start(Supervisor("top", children=[]))
    supervisor = rig.system.supervisor
    assert supervisor is not None
    starting = asyncio.ensure_future(supervisor.start_child(Child(Slow, args=(60.0,), process=True)))
    await rig.advance(1.0)
    await supervisor.terminate_child("slow")
    with pytest.raises(StartFailed, match="terminated before it had started"):
        await starting
    assert rig.now < 2.0


@pytest.mark.parametrize("stop", ["kill", 5.0])
async def test_a_start_may_be_stopped_or_killed_before_its_process_runs(rig: Rig, stop: Any) -> None:
    await rig.start(Supervisor("top", children=[]))
    supervisor = rig.system.supervisor
    assert supervisor is not None
    starting = asyncio.ensure_future(supervisor.start_child(Child(Slow, process=True, stop=stop)))
    await asyncio.sleep(0)
    await asyncio.sleep(0)
    await supervisor.terminate_child("slow")
    with pytest.raises(StartFailed):
        await starting
    await rig.advance(1.0)


async def test_a_foreign_cancellation_ends_the_child_in_order(rig: Rig) -> None:
    await rig.start(Supervisor("top", children=[Child(Slow, process=True)]))
    supervisor = rig.system.supervisor
    assert supervisor is not None
    task = supervisor.incarnation("slow")
    assert task is not None
    with rig.expect_failure():
        task.task.cancel()
        await rig.advance(1.0)
    assert rig.reports[-2].reason == Killed(None)
    assert len(lines(rig, "stopped")) == 1
    assert rig.incarnation("slow") == 2


async def test_a_killed_system_leaves_nothing(rig: Rig) -> None:
    inner = Supervisor("inner", process=True, children=[Child(Counter), Child(Slow, process=True)])
    await rig.start(Supervisor("top", children=[inner]))
    rig.kill()
    await rig.stop()
    assert lines(rig, "stopping") == []


async def test_instances_of_a_template_have_processes_of_their_own(rig: Rig) -> None:
    await rig.start(DynamicSupervisor("top", Child(Doer, process=True)))
    supervisor = rig.system.supervisor
    assert supervisor is not None
    await supervisor.spawn("sick", name="one")
    await supervisor.spawn("stop", name="two")
    assert rig.state("one").process != rig.state("two").process
    with pytest.raises(TypeError, match=r"instance 'three'.*args\[0\]"):
        await supervisor.spawn(lambda: 1, name="three")


async def test_options_of_the_run_reach_nodes_of_other_processes(rig: Rig) -> None:
    child = Child(Counter, process=True, namespace="/robot", remap={"count": "steps"})
    await rig.start(
        Supervisor("top", children=[child]), parameters={"/robot/counter": {"step": 7}}, clock_offset=1000.0
    )
    steps = rig.probe(COUNT, name="/robot/steps")
    await rig.advance(0.3)
    assert steps.messages[-1].data % 7 == 0
    assert rig.state("counter").identity.fqn == "/robot/counter"


async def test_the_same_seed_gives_the_same_course() -> None:
    def story() -> list[str]:
        async def run() -> list[str]:
            rig = Rig()
            inner = Supervisor("inner", process=True, children=[Child(Counter), Child(Doer, args=("sick",))])
            await rig.start(Supervisor("top", children=[inner, Child(Slow, process=True)]), seed=5)
            await rig.advance(0.7)
            rig.crash("doer")
            await rig.advance(0.3)
            with rig.expect_failure(ProcessDied):
                rig.kill_process("slow")
                await rig.advance(1.0)
            await rig.close()
            return [repr(line) for line in rig.logs]

        from actors.time.virtual_loop import VirtualLoop

        with asyncio.Runner(loop_factory=VirtualLoop) as runner:
            return runner.run(run())

    first = await asyncio.to_thread(story)
    assert len(first) > 5
    assert await asyncio.to_thread(story) == first


class Foreman(Node):
    """Adds a child that only its own process knows how to make."""

    async def on_start(self) -> None:
        from actors import system_of

        supervisor = system_of(self).supervisor
        assert supervisor is not None
        self.create_task(self._hire(supervisor))

    async def _hire(self, supervisor: Any) -> None:
        await supervisor.life("inner").start_child(Child(lambda: Counter(), name="hired"))


async def test_what_is_added_within_a_process_is_seen_outside_though_its_factory_is_not(rig: Rig) -> None:
    await rig.start(Supervisor("top", children=[Supervisor("inner", process=True, children=[Child(Foreman)])]))
    await rig.advance(0.5)
    assert rig.state("hired").state == "running"
    assert rig.state("hired").child.factory is Node


async def test_a_child_that_stops_before_its_end_was_asked_for_says_why(rig: Rig) -> None:
    await rig.start(Supervisor("top", children=[Child(Doer, args=("stop",), process=True, restart=temporary)]))
    supervisor = rig.system.supervisor
    assert supervisor is not None
    ref = supervisor.which("doer")
    assert ref is not None
    down = supervisor.watch(ref)
    await rig.call(DO, Trigger.Request())
    assert (await down).reason == Stopped("enough")


class Gatherer(Node):
    """Lets an instance of a template come and go in its own process."""

    async def on_start(self) -> None:
        self.create_task(self._gather())

    async def _gather(self) -> None:
        from actors import system_of

        supervisor: Any = system_of(self).supervisor
        crew = supervisor.life("inner/crew")
        await crew.spawn("sick", name="guest")
        await self.clock.sleep(1.0)
        await crew.terminate_child("guest")


async def test_an_instance_that_is_forgotten_in_its_process_is_forgotten_here(rig: Rig) -> None:
    inner = Supervisor("inner", process=True, children=[DynamicSupervisor("crew", Child(Doer)), Child(Gatherer)])
    await rig.start(Supervisor("top", children=[inner]))
    await rig.advance(0.5)
    assert rig.state("guest").state == "running"
    await rig.advance(1.0)
    assert ("top", "inner", "crew", "guest") not in rig.system.nodes
    rig.crash("gatherer")
    await rig.advance(0.5)
    assert rig.incarnation("guest") == 1


async def test_a_simulated_process_that_has_ended_takes_no_signals_and_no_requests() -> None:
    class Nothing:
        async def run(self) -> None: ...

        def take(self, request: object) -> None:
            raise AssertionError

        def terminate(self) -> None:
            raise AssertionError

        kill = terminate

    process = SimulatedProcess(7, lambda tell: Nothing(), lambda event: None, lambda: None)
    assert str(await process.ended) == "process 7 has ended: exit code 0"
    process.terminate()
    process.kill()
    process.send(StopAsked("too late"))
    await asyncio.sleep(0)


async def test_a_simulated_process_that_breaks_has_died() -> None:
    class Broken:
        async def run(self) -> None:
            raise OSError("broken")

    process = SimulatedProcess(7, lambda tell: cast("Any", Broken()), lambda event: None, lambda: None)
    assert lacks(str(await process.ended), "7 1 OSError broken") == []


class Lost(Node):
    """Its task is canceled by code that does not own it."""

    async def on_start(self) -> None:
        task = asyncio.current_task()
        assert task is not None
        asyncio.get_running_loop().call_later(0.5, task.cancel)


async def test_a_node_that_is_canceled_by_others_in_its_process_counts_as_killed(rig: Rig) -> None:
    await rig.start(Supervisor("top", children=[Child(Lost, process=True, restart=temporary)]))
    with rig.expect_failure():
        await rig.advance(1.0)
    assert rig.reports[-1].reason == Killed(None)


async def test_a_child_that_is_ready_can_be_stopped_before_its_nodes_are_known_here(rig: Rig) -> None:
    await rig.start(Supervisor("top", children=[]))
    supervisor = rig.system.supervisor
    assert supervisor is not None
    starting = asyncio.ensure_future(supervisor.start_child(Child(Slow, process=True)))
    await rig.until(lambda: any(record.process for record in rig.system.nodes.values()))
    await rig.quiet()
    await supervisor.terminate_child("slow")
    with pytest.raises(StartFailed, match="terminated before it had started"):
        await starting
    assert len(lines(rig, "stopped")) == 1


def test_the_traceback_of_a_line_of_another_process_is_shown_by_every_sink() -> None:
    line = LogRecord(
        1.0, 40, "/camera", 1, "odd", {"process": 7}, trace="Traceback (most recent call last):\nOSError: broken"
    )
    assert line.traceback.endswith("OSError: broken")
    assert str(line).endswith("OSError: broken")
    out = io.StringIO()
    json_sink(out)(line)
    assert json.loads(out.getvalue())["exception"] == line.traceback
    console_sink(out)(line)
    assert out.getvalue().count("OSError: broken") == 2
    with structlog.testing.capture_logs() as captured:
        structlog_sink(line)
    assert captured[0]["exception"] == line.traceback


def broken_elsewhere() -> OSError:
    """An error as it comes from another process."""
    try:
        raise OSError("broken")
    except OSError as error:
        return cast("OSError", unpack(pack(error)))


@virtual
async def test_an_error_of_another_process_shows_its_own_lines_and_none_of_this_one() -> None:
    stage = Stage()
    await stage.ready()
    await stage.ends(broken_elsewhere())
    with pytest.raises(OSError, match="broken") as caught:
        await stage.task
    error = caught.value.with_traceback(_inner(caught.value))
    shown = traceback_of(error)
    assert shown is not None
    text = "".join(shown.format())
    assert "in broken_elsewhere" in text and "life.py" not in text
    assert users_trace(error) is None


def _inner(error: BaseException) -> TracebackType | None:
    """The part of its traceback that lies in the framework."""
    trace = error.__traceback__
    while trace is not None and not trace.tb_frame.f_code.co_filename.endswith("life.py"):
        trace = trace.tb_next
    return trace
