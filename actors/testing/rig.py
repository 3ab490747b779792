"""`Rig`: a system on the virtual clock, controlled by a test.

::

    async def test_low_battery_stops_the_robot(rig: Rig) -> None:
        await rig.start(tree())
        cmd = rig.probe(CMD_VEL)
        rig.publish(CHARGE, Charge(level=0.05))
        await rig.advance(1.0)
        assert cmd.last == Twist()

No call sleeps in real time: `advance` moves the clock, and everything that is due in the meantime happens in order. When the test ends, the
rig stops the system and fails the test if a task, a thread, an endpoint or a goal is left over. A node that fails or a supervisor that
gives up fails the test too, unless the test caused it by `crash` or announced it by `expect_failure`.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable, Generator
from contextlib import contextmanager
from functools import partial
from typing import TYPE_CHECKING, Any, TypeVar, cast, overload

from actors.checks import create
from actors.contracts.contracts import Action, Service, Topic
from actors.errors import NotStarted
from actors.interfaces.message import F, G, M, R, Req, Resp
from actors.logs import DEBUG, LogRecord
from actors.places import awaited_in
from actors.qos import of
from actors.running.options import ParameterSources, options_of
from actors.running.trees import Runnable, tree_of
from actors.runtime.habits import Missing
from actors.runtime.incarnation import incarnation_of
from actors.runtime.node import CALL_TIMEOUT, GOAL_TIMEOUT, Node
from actors.runtime.placement import HERE, Placement
from actors.runtime.runtime import NodeRecord, OtherProcesses, Runtime
from actors.supervision.child import Child
from actors.system import System
from actors.testing.failures import ExpectedFailure, FailureWatch
from actors.testing.leaks import Leak, LeakWatch
from actors.testing.probe import Probe
from actors.time.virtual_loop import VirtualLoop

if TYPE_CHECKING:
    from actors.actions.client import Goal
    from actors.check.checker import Finding
    from actors.hosts.placing import Hosts
    from actors.hosts.simulated import SimulatedHosts
    from actors.qos.policies import QoS
    from actors.running.run import Observer
    from actors.runtime.joined import JoinedNode
    from actors.supervision.declarations import Spec
    from actors.supervision.report import Report
    from actors.transport.protocol import Transport

N = TypeVar("N", bound=Node)
O = TypeVar("O", bound="Observer")  # noqa: E741

KEPT_LINES = 200
"""The path of the rig's own node."""


class Rig:
    """One system on the virtual clock, and the means for a test to act on it and observe it.

    `make_system` creates the system and takes the arguments of `System`; a simulation passes its own. `excused` returns True for a node's
    error that is not a failure of the test, because a simulation has caused it.

    Invariants:

    * A rig runs at most one system. `system` and `me` raise `NotStarted` until it has started.
    * An observer is attached once, to that system, before its tree starts if possible.
    """

    def __init__(
        self,
        make_system: Callable[..., System] | None = None,
        excused: Callable[[BaseException], bool] | None = None,
    ) -> None:
        self.loop = loop = virtual_loop("a Rig", "rig")
        self._make_system = make_system or partial(create, System)
        self._watch = FailureWatch(excused)
        self.logs: deque[LogRecord] = deque(maxlen=KEPT_LINES)
        self._observers: list[Observer] = []
        self._system: System | None = None
        self._me: JoinedNode | None = None
        self._tree: Spec | None = None
        self._hosts: SimulatedHosts | None = None
        self.leaks = LeakWatch(loop)
        """Remembers what ran before the rig was created; that is not reported as left over."""

    # -- the system ---------------------------------------------------------------------------------------------------------

    async def start(
        self,
        tree: Runnable,
        *more: Spec | type[Node],
        seed: int = 0,
        parameters: ParameterSources | None = None,
        transport: Transport | None = None,
        hosts: Hosts | None = None,
        clock_offset: float = 0.0,
        within: float = 3600.0,
    ) -> System:
        """Start a tree, or several nodes under a plain supervisor, and return when all of it is ready. Accepts what `actors.run`
        accepts. Fails after `within` virtual seconds. The time of day begins at `clock_offset` seconds. The machines that the tree names are
        simulated, see `hosts`, unless `hosts` and a `transport` are given."""
        if self._system is not None:
            raise RuntimeError("this rig runs a system already: one rig, one system")
        if asyncio.get_running_loop() is not self.loop:
            raise RuntimeError(
                "this test runs in another event loop than its rig: give the test the loop scope of the fixture, "
                '@pytest.mark.asyncio(loop_scope="function")'
            )
        whole = tree_of("rig.start(...)", tree, *more)
        options = options_of("rig.start(parameters=...)", whole, parameters, None, DEBUG)
        if hosts is None and transport is None:
            from actors.hosts.simulated import simulate_hosts

            self._hosts = hosts = simulate_hosts(whole, seed)
            transport = None if self._hosts is None else self._hosts.transport()

        def processes(runtime: Runtime) -> OtherProcesses:
            from actors.processes.child_processes import ChildProcesses  # late: few trees have other processes

            launch = None
            if hosts is not None:
                from actors.hosts.placing import elsewhere

                launch = elsewhere(hosts, runtime)
            return ChildProcesses(runtime, transport, elsewhere=launch)

        system = self._make_system(
            seed=seed, sinks=(self.logs.append,), level=DEBUG, options=options, processes=processes,
            placement=HERE if hosts is None else Placement(hosts.count_run()),
        )  # fmt: skip
        if clock_offset:
            system.clock.shift_wall(clock_offset)
        if transport is not None:
            from actors.transport.bridge import connect

            connect(system.runtime, transport)
        self._watch.begin(system)
        while self._observers:  # each observes this one system, even if its start fails
            self._observers.pop(0).attach(system)
        self._tree = whole
        with self._limited(system, within):
            await system.start(whole)
        self._system = system
        self._me = await system.join(Child(Node, name="rig"))
        return system

    @contextmanager
    def _limited(self, system: System, within: float) -> Generator[None]:
        """End the run with an error that says what still starts, after `within` seconds. A timer would keep a deadlock from being found."""
        loop, before = self.loop, self.loop.watch
        end = loop.time() + within

        def look() -> None:
            if before is not None:
                before()
            if loop.time() > end:
                lives = [one.life for one in system.nodes.values() if one.state == "starting" and one.life is not None]
                waiting = [
                    f"{life.fqn} awaits {awaited_in(task)}" for life in lives if (task := life.inbox.task) is not None
                ]
                raise AssertionError(
                    f"rig.start: not started within {within:g} s: {'; '.join(waiting)}. What runs for ever belongs into a @background method"
                )

        loop.watch = look
        try:
            yield
        finally:
            loop.watch = before

    def findings(self) -> tuple[Finding, ...]:
        """The findings of `check_tree` about the running tree. Topics on which the test itself publishes count as published."""
        if self._tree is None or self._system is None:
            return ()
        from actors.check.checker import check_tree

        published = [entry.name for entry in self._system.graph.topics.values() if entry.opened is not None]
        return check_tree(self._tree, external=published, each_node=False)

    def observe(self, observer: O) -> O:
        """Attach an observer, such as a `FlightRecorder` or a `Trace`: before the tree starts, or now if it has started. Returns it."""
        if self._system is None:
            self._observers.append(observer)
        else:
            observer.attach(self._system)
        return observer

    @property
    def system(self) -> System:
        if self._system is None:
            raise NotStarted("the rig runs no system yet: await rig.start(tree) first")
        return self._system

    @property
    def hosts(self) -> SimulatedHosts:
        """The simulated machines of ``Child(host=...)``, to be cut off and crashed. Raises `NotStarted` if the tree names none."""
        if self._hosts is None:
            raise NotStarted("the rig has started no tree that names hosts")
        return self._hosts

    @property
    def me(self) -> Node:
        """The rig's own node, which publishes, calls and sends goals for the test. Raises `NotStarted`."""
        if self._me is None:
            raise NotStarted("the rig runs no system yet: await rig.start(tree) first")
        return self._me.node

    @property
    def now(self) -> float:
        """The time on the system's clock, in seconds."""
        return self.system.clock.now()

    @property
    def reports(self) -> list[Report]:
        """The reports of the supervisors so far."""
        return list(self.system.reports)

    def forgive_threads(self) -> None:
        """Do not report the threads that run now as left over."""
        self.leaks.forgive_threads()

    def kill(self) -> None:
        """End the system at once, without any clean-up, as a power failure does. What fails because of it does not fail the test.

        Raises `NotStarted`.
        """
        self._watch.end()
        self.system.kill()

    async def stop(self) -> None:
        """Stop the system in order, if it runs. `close` does so, too; of several systems all should be stopped before one is closed."""
        if self._system is not None:
            self._watch.look_beside()
            await self._system.stop("the test is over")

    async def close(self) -> None:
        """Stop the system. Raises `Leak` if something is left over and `UnexpectedFailure` for a failure not yet raised."""
        system = self._system
        if system is not None:
            await self.stop()
            await self.quiet()
            left = self.leaks.left_over(system)
            sentence = "left over after the system's end: " + "; ".join(left) if left else ""
            self._watch.check(more=sentence)
            if left:
                raise Leak(sentence)
        self._watch.demand()

    # -- time ---------------------------------------------------------------------------------------------------------------

    async def quiet(self) -> None:
        """Let everything happen that can happen without time passing."""
        await quiet(self.loop)

    async def advance(self, seconds: float) -> None:
        """Let `seconds` pass, with everything that is due in that time, its last instant included.

        Raises `UnexpectedFailure` if a node fails or a supervisor gives up and the test did not expect it.
        """
        await self.system.clock.sleep_until(self.now + seconds)
        await self.quiet()
        self.check()

    def check(self) -> None:
        """Raise `UnexpectedFailure` if a node has failed or a supervisor has given up and the test did not expect it."""
        self._watch.look_beside(own=None if self._me is None else self._me.record.path)
        self._watch.check()

    async def until(self, condition: Callable[[], bool], *, within: float = 60.0, step: float = 0.005) -> None:
        """Let time pass until `condition()` is true, checking it every `step` seconds. Fails after `within` seconds."""
        end = self.now + within
        while not condition():
            if self.now >= end:
                raise AssertionError(f"not true within {within:g} s (now t={self.now:.3f} s)\n{self.timeline()}")
            await self.advance(min(step, end - self.now))

    async def settled(self, *, within: float = 60.0) -> None:
        """Let time pass until every node is running or has ended for good and every inbox is empty. Fails after `within` seconds."""
        await self.quiet()
        await self.until(lambda: all(_is_settled(state) for state in self.system.nodes.values()), within=within)

    # -- topics, services, actions ------------------------------------------------------------------------------------------

    def probe(self, topic: Topic[M], *, name: str | None = None, qos: QoS | int | None = None) -> Probe[M]:
        """Record a topic from now on, beginning with its latched messages. `name`, a full name, replaces that of the contract."""
        me = incarnation_of(self.me)
        entry = self.system.graph.topic(name or me.identity.topic(topic.name))
        probe = create(Probe, me, entry, topic.type, topic.qos if qos is None else of(qos), self.system.clock.now)
        me.endpoints.join(cast("Any", probe))
        return probe

    def publish(self, topic: Topic[M], message: M) -> None:
        """Publish a message. It is delivered when the test next awaits."""
        me = incarnation_of(self.me)
        for publisher in me.endpoints.publishers:
            if publisher.type is topic.type and publisher.entry.name == me.identity.topic(topic.name):
                publisher.publish(message)
                return
        self.me.publisher(topic).publish(message)

    async def call(self, service: Service[Req, Resp], request: Req, *, timeout: float = CALL_TIMEOUT) -> Resp:
        """Call a service and return the response. Raises what `Node.call` raises."""
        return await self.me.call(service, request, timeout=timeout)

    if not TYPE_CHECKING:
        start_goal = Missing("start_goal", ": a goal is sent by `await rig.send_goal(ACTION, goal)`")

    async def send_goal(self, action: Action[G, R, F], goal: G, *, timeout: float = GOAL_TIMEOUT) -> Goal[R, F]:
        """Send a goal and return when it is accepted. Raises `GoalRejected` or `ActionUnavailable`."""
        handle = self.me.send_goal(action, goal, timeout=timeout)
        await handle.send()
        return handle

    # -- nodes --------------------------------------------------------------------------------------------------------------

    def state(self, node: type[Node] | str) -> NodeRecord:
        """The record of a node, found by its class, name or fully qualified name."""
        return self.system.runtime.directory.named(node)

    @overload
    def node(self, node: type[N]) -> N: ...
    @overload
    def node(self, node: str) -> Node: ...
    def node(self, node: type[Node] | str) -> Node:
        """The present object of a node, found by its class, name or fully qualified name."""
        return self.system.node(node)

    def incarnation(self, node: type[Node] | str) -> int:
        """The number of the node's current or last incarnation."""
        return self.state(node).incarnation

    def crash(self, node: type[Node] | str, error: Exception | None = None) -> None:
        """Make a node fail as if one of its handlers had raised `error`. Raises `LookupError` or `NotStarted`.

        The end of that node does not raise `UnexpectedFailure`; a supervisor that gives up because of it does.
        """
        error = error or RuntimeError("crashed by the rig")
        self.system.crash(node, error)
        self._watch.planned.append(error)

    def kill_process(self, node: type[Node] | str) -> None:
        """Kill the simulated process in which a node runs, as ``kill -9`` does. Raises what `System.kill_process` raises.

        The failure of its child, `ProcessDied`, has to be expected.
        """
        self.system.kill_process(node)

    def expect_failure(
        self,
        error: type[BaseException] | tuple[type[BaseException], ...] = BaseException,
        *,
        node: type[Node] | str | None = None,
        match: str = "",
    ) -> ExpectedFailure:
        """Expect a node to fail with such an `error`, or a supervisor to give up (`SupervisorGaveUp`).

        The expectation holds until the end of the test, or until the end of the block in ``with rig.expect_failure(OSError): ...``. It
        allows any number of failures; the test fails if there is none. `node` is a class, a name, a fully qualified name or a path in the
        tree. `match` is a regular expression searched for in the text of the error. The errors that occurred are in `.errors`.
        """
        return self._watch.expect(error, node, match)

    # -- when a test fails --------------------------------------------------------------------------------------------------

    def timeline(self, last: int = 30) -> str:
        """The newest `last` log lines in order, including the reports of the supervisors."""
        seed = self._system.seed if self._system is not None else 0
        time = f"{self.now:.6f}" if self._system is not None else "-"
        lines = [str(record) for record in list(self.logs)[-last:]]
        return "\n".join([f"rig: seed={seed} t={time} s; the last {len(lines)} log lines:", *lines])

    def lines(self) -> list[tuple[float, str]]:
        """The log lines that are kept, each with its time in seconds on the event loop."""
        if self._system is None:
            return []
        return [(self._system.clock.loop_time(record.time), str(record)) for record in self.logs]


def virtual_loop(what: str, fixture: str) -> VirtualLoop:
    """The running event loop. Raises RuntimeError if it is not virtual, and says so of `what`, which the fixture gives."""
    loop = asyncio.get_running_loop()
    if not isinstance(loop, VirtualLoop):
        raise RuntimeError(
            f"{what} needs the virtual clock: use the `{fixture}` fixture, or mark the test with @pytest.mark.virtual "
            "(which needs pytest-asyncio 1.4 or newer)"
        )
    return loop


async def quiet(loop: VirtualLoop) -> None:
    """Let everything happen that can happen without time passing."""
    while True:
        await asyncio.sleep(0)
        if loop.idle:
            return


def _is_settled(state: NodeRecord) -> bool:
    inbox = state.inbox
    return state.state in ("running", "stopped") and not inbox.items and not inbox.control and inbox.current is None
