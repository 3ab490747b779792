"""A running system from inside: trees, snapshots, records, supervisors, goals, and the types of all answers."""

from actors import (
    Action,
    Child,
    Done,
    DynamicSupervisor,
    ExitReason,
    GoalStatus,
    LifecycleNode,
    Node,
    Service,
    Steps,
    Stop,
    Supervisor,
    System,
    Topic,
    check_node,
    check_tree,
    every,
    execute,
    graph_of,
    one_for_all,
    one_for_one,
    open_node,
    permanent,
    publishes,
    run,
    subscribes,
    system_of,
    temporary,
    transient,
)
from actors.actions import parallel, queue
from actors.lifecycle import HookResult, LifecycleState, TransitionRefused, bring_down, bring_up
from actors.supervision import Failed, Killed, Leaked, Returned, Stopped, all_significant, any_significant, never
from actors.typing import Goal, Outcome, Publisher, Stream
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.std_msgs.msg import Int32
from actors.interfaces.std_srvs.srv import Trigger
from actors.testing import Rig
from actors.typing import (
    ArrivalPolicy, Arrivals, AutoShutdown, ChildInfo, ChildRef, ChildState, Context, Counts, Down, Edge, Endpoint, EventStream, Finding,
    Gone, HandlerLoad, HandlerSubscription, Identity, Kind, Late, Load, NodeGraph, NodeRecord, NodeView, Observer, OpenNode,
    ParameterSource, ParameterSources, Path, PrimaryState, PublisherDeclaration, Report, Restart, Run, Runnable, RunningSupervisor,
    ServiceView, Snapshot, Spec, StopTimeout, Strategy, StreamDeclaration, TopicView,
)

LEVEL, PUMP, FILL = Topic(Int32, "level"), Service(Trigger, "pump"), Action(Fibonacci, "fill")
ARRIVALS: Arrivals = parallel(2)
LATE: Late = "skip"


class Tank(Node):
    """Publishes its level, pumps when asked, and fills in steps."""

    level = publishes(LEVEL)

    @every(hz=10, late=LATE)
    async def measure(self) -> None:
        self.level(Int32(data=7))

    @PUMP.serve()
    async def pump(self, request: Trigger.Request) -> Trigger.Response:
        return Trigger.Response(success=True)

    @FILL.serve(arrivals=ARRIVALS)
    async def fill(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
        await self.clock.sleep(1.0)
        yield Done(Fibonacci.Result(sequence=[1]))


class Display(Node):
    """Shows the level: the newest by a stream, and all by a handler."""

    newest = subscribes(LEVEL)

    @LEVEL.on()
    def show(self, message: Int32) -> None: ...

# -- before it runs

strategy: Strategy = one_for_one
restart: Restart = permanent
patience: StopTimeout = 2.0
ends: AutoShutdown = never  # or any_significant, all_significant: of the children with significant=True
tank: Spec = Child(Tank, restart=restart, stop=patience)
levels: ParameterSource = {"/**": {"use_sim_time": False}}
tree: Runnable = Supervisor("plant", strategy=strategy, auto_shutdown=ends, children=[tank, Child(Display, restart=transient)])
assert one_for_all != strategy and any_significant != all_significant and temporary != restart

findings: tuple[Finding, ...] = (*check_tree(tree), *check_node(Tank))
assert findings == ()
made: PublisherDeclaration[Int32] = Tank.__dict__["level"]
heard: StreamDeclaration[Int32] = Display.__dict__["newest"]
assert made.topic is heard.topic is LEVEL
assert isinstance(queue(3), ArrivalPolicy) and isinstance(ARRIVALS, ArrivalPolicy)  # three may wait; two may run at once

# -- nodes, topics and services, at one instant

async def test_a_snapshot_tells_who_talks_with_whom(rig: Rig) -> None:
    await rig.start(tree)
    await rig.advance(1.0)
    await rig.call(PUMP, Trigger.Request())
    system: System = rig.system
    now: Snapshot = system.snapshot()

    (level,) = [one for one in now.topics if one.name == "/level"]
    view: TopicView = level
    ends: tuple[Edge, ...] = view.publishers
    assert [end.node for end in ends] == ["/tank"] and view.messages == 10
    node: NodeView = next(one for one in now.nodes if one.name == "/tank")
    assert (node.state, node.incarnation) == ("running", 1)
    pump: ServiceView = next(one for one in now.services if one.name == "/pump")
    assert (pump.kind, pump.server, pump.calls) == ("service", "/tank", 1)


async def test_a_record_outlives_the_lives_of_its_node(rig: Rig) -> None:
    await rig.start(tree)
    rig.crash("tank")
    await rig.settled()
    record: NodeRecord = rig.state(Tank)
    who: Identity = record.identity
    assert (who.name, who.fqn, record.incarnation) == ("tank", "/tank", 2)
    await rig.advance(5.0)
    load: Load = record.load
    handlers: tuple[HandlerLoad, ...] = load.handlers
    assert load.handled >= 50 and load.waiting == 0 and all(one.longest < 1.0 for one in handlers)


async def test_a_node_asks_about_the_graph_and_its_own_ends(rig: Rig) -> None:
    await rig.start(tree)
    display = rig.node(Display)
    assert system_of(display) is rig.system
    graph: NodeGraph = graph_of(display)
    publishers: tuple[Endpoint, ...] = graph.publishers("/level")
    assert [one.node for one in publishers] == ["/tank"] and graph.count_services("/pump") == 1
    out: Publisher[Int32] = rig.node(Tank).level
    newest: Stream[Int32] = display.newest
    handled: HandlerSubscription[Int32] = display.subscription(LEVEL)
    changes: EventStream[object] = handled.events()
    await rig.advance(1.0)
    assert out.count == handled.received == 10 and (await newest.next()).data == 7
    changes.close()

# -- the supervisor, and the ends of its children

async def test_children_are_started_watched_and_ended(rig: Rig) -> None:
    await rig.start(tree)
    supervisor: RunningSupervisor | None = rig.system.supervisor
    assert supervisor is not None
    ref: ChildRef | None = await supervisor.start_child(Child(Display, name="second"))
    counts: Counts = supervisor.counts()
    infos: list[ChildInfo] = supervisor.children()
    kind: Kind = infos[-1].kind
    second: Path = "second"  # or "gaits/walk", or ("gaits", "walk"): down from this supervisor
    state: ChildState = supervisor.state_of(second)
    assert (counts.active, kind, state) == (3, "worker", "running") and ref is not None

    watched = supervisor.watch(ref)
    await supervisor.terminate_child("second")
    down: Down = await watched
    assert down.ref == ref and isinstance(down.reason, Stopped)
    assert isinstance((await supervisor.watch(ref)).reason, Gone)  # it had ended before anybody watched


class Job(Node):
    """Ends by itself, in the way it is told to."""

    def __init__(self, end: Exception | None) -> None:
        super().__init__()
        self.end = end

    @every(hz=1)
    async def work(self) -> None:
        if self.end is not None:
            raise self.end


async def test_the_reason_of_an_end_is_a_value(rig: Rig) -> None:
    await rig.start(DynamicSupervisor("jobs", Child(Job, restart=temporary, stop="kill")))
    jobs: RunningSupervisor | None = rig.system.supervisor
    assert jobs is not None
    rig.expect_failure(OSError)
    reasons: list[ExitReason | Gone] = []
    for end in (OSError("lost"), Stop("done"), None):
        ref = await jobs.spawn(end)
        assert ref is not None
        watched = jobs.watch(ref)
        await rig.advance(1.5)
        if end is None:
            await jobs.terminate_child(ref)
        reasons.append((await watched).reason)
    failed, stopped, killed = reasons
    assert isinstance(failed, Failed) and isinstance(failed.error, OSError)
    assert isinstance(stopped, Stopped) and stopped.why == "done"
    assert isinstance(killed, Killed) and not isinstance(killed, Returned | Leaked)


async def test_every_end_is_reported(rig: Rig) -> None:
    await rig.start(tree)
    rig.crash("tank")
    await rig.settled()
    reports: list[Report] = list(rig.system.reports)[-2:]
    contexts: list[Context] = [one.context for one in reports]
    assert contexts == ["child_terminated", "progress"]

# -- goals, lifecycles

async def test_how_a_goal_has_ended_is_asked_without_an_exception(rig: Rig) -> None:
    await rig.start(tree)
    async with rig.me.send_goal(FILL, Fibonacci.Goal(order=1)) as goal:
        running: Goal[Fibonacci.Result, Fibonacci.Feedback] = goal
        assert running.status is GoalStatus.EXECUTING
        outcome: Outcome[Fibonacci.Result] = await running.ended()
    assert outcome.status is GoalStatus.SUCCEEDED and outcome.result is not None


class Camera(LifecycleNode):
    async def on_configure(self, previous: LifecycleState) -> HookResult:
        return HookResult.SUCCESS


async def test_lifecycle_nodes_are_brought_up_and_down_in_order(rig: Rig) -> None:
    await rig.start(Camera)
    camera = rig.node(Camera)
    await bring_up(rig.system)
    there: PrimaryState = "active"
    assert camera.state is LifecycleState.ACTIVE and camera.state.name.lower() == there
    try:
        await camera.change_state("configure")
    except TransitionRefused as error:
        assert error.state is LifecycleState.ACTIVE
    await bring_down(rig.system)
    assert camera.state is LifecycleState.UNCONFIGURED

# -- a program

class Ends:
    """Says when the tree has ended."""

    def attach(self, system: System) -> None:
        system.observe(end=lambda: print("ended"))


observer: Observer = Ends()
sources: ParameterSources = [levels, {"/tank": {"use_sim_time": False}}]
program: Run = run(tree, parameters=sources, sinks=(), observers=(observer,))
guest: OpenNode = open_node("guest")


async def main() -> None:
    async with program as system, guest as node:
        assert (await node.subscribe(LEVEL).next(timeout=1.0)).data == 7
        await system.stop()


execute(main, clock="virtual")
