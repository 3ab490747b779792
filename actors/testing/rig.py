"""`Rig`: a system on the virtual clock, seen from a test.

::

    async def test_low_battery_stops_the_robot(rig: Rig) -> None:
        await rig.start(tree())
        cmd = rig.probe(CMD_VEL)
        rig.publish(CHARGE, Charge(level=0.05))
        await rig.advance(1.0)
        assert cmd.last == Twist()

Nothing here sleeps: `advance` moves the clock, and everything that is due on the way happens in order. When the test is over the rig
stops the system and fails the test if anything is left: a task, a thread, a subscription, a goal. A node that fails, or a supervisor that
gives up, fails the test too, unless the test caused it by `crash` or announced it by `expect_failure`.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TypeVar, cast, overload

from actors.errors import NotStarted
from actors.logs import DEBUG, LogRecord
from actors.node.node import CALL_TIMEOUT, GOAL_TIMEOUT, Node
from actors.qos import of
from actors.running.options import options_of
from actors.running.trees import tree_of
from actors.runtime.incarnation import incarnation_of
from actors.runtime.record import BESIDE, NodeRecord
from actors.supervision.declarations import Child
from actors.system import System
from actors.testing.failures import ExpectedFailure, FailureWatch, UnexpectedFailure
from actors.testing.leaks import Leak, LeakWatch
from actors.testing.probe import Probe
from actors.time.virtual_loop import VirtualLoop

if TYPE_CHECKING:
    from actors.actions.client import Goal
    from actors.check.checker import Finding
    from actors.contracts.contracts import Action, Service, Topic
    from actors.interfaces.message import Message
    from actors.qos.policies import QoS
    from actors.running.options import ParameterSources
    from actors.running.run import Observer
    from actors.running.trees import Runnable
    from actors.runtime.unsupervised import UnsupervisedNode
    from actors.supervision.declarations import Spec
    from actors.supervision.report import Report

__all__ = ["ExpectedFailure", "Leak", "Probe", "Rig", "UnexpectedFailure"]

M = TypeVar("M", bound="Message")
G = TypeVar("G", bound="Message")
R = TypeVar("R", bound="Message")
F = TypeVar("F", bound="Message")
Req = TypeVar("Req", bound="Message")
Resp = TypeVar("Resp", bound="Message")
N = TypeVar("N", bound=Node)
O = TypeVar("O", bound="Observer")  # noqa: E741

KEPT_LINES = 200
_ME = (BESIDE, "rig")
"""The path of the rig's own node."""


class Rig:
    """One system on the virtual clock, and the hands and eyes of a test in it.

    `make_system` makes the system, with the arguments of `System`: a simulation brings one of its own. `excused` says of a node's error
    that it is no failure of the test, because the simulation has caused it.
    """

    def __init__(
        self,
        make_system: Callable[..., System] = System,
        excused: Callable[[BaseException], bool] | None = None,
    ) -> None:
        loop = asyncio.get_running_loop()
        if not isinstance(loop, VirtualLoop):
            raise RuntimeError(
                "a Rig needs the virtual clock: use the `rig` fixture, or mark the test with @pytest.mark.virtual "
                "(which needs pytest-asyncio 1.4 or newer)"
            )
        self.loop = loop
        self._make_system = make_system
        self._watch = FailureWatch(excused)
        self.logs: deque[LogRecord] = deque(maxlen=KEPT_LINES)
        self._observers: list[Observer] = []
        self._system: System | None = None
        self._me: UnsupervisedNode | None = None
        self._tree: Spec | None = None
        self.leaks = LeakWatch(loop)
        """What ran before the rig was made, and so is nothing that its system has left over."""

    # -- the system ---------------------------------------------------------------------------------------------------------

    async def start(
        self, tree: Runnable, *more: Spec | type[Node], seed: int = 0, parameters: ParameterSources | None = None
    ) -> System:
        """Start a tree, or a few nodes under a plain supervisor, and return when all of it is ready. Takes what `actors.run` takes."""
        if self._system is not None:
            raise RuntimeError("this rig runs a system already: one rig, one system")
        if asyncio.get_running_loop() is not self.loop:
            raise RuntimeError(
                "this test runs in another event loop than its rig: give the test the loop scope of the fixture, "
                '@pytest.mark.asyncio(loop_scope="function")'
            )
        whole = tree_of("rig.start(...)", tree, *more)
        options = options_of("rig.start(parameters=...)", whole, parameters, None, DEBUG)
        system = self._make_system(seed=seed, sinks=(self.logs.append,), level=DEBUG, options=options)
        self._watch.begin(system)
        while self._observers:  # each observes one system: the first, also when it does not come to start
            self._observers.pop(0).attach(system)
        self._tree = whole
        await system.start(whole)
        self._system = system
        self._me = await system.join(Child(Node, name="rig"))
        return system

    def findings(self) -> tuple[Finding, ...]:
        """What `check_tree` says of how the nodes of this test are connected; what the test itself publishes counts, too."""
        if self._tree is None or self._system is None:
            return ()
        from actors.check.checker import check_tree

        published = [entry.name for entry in self._system.graph.topics.values() if entry.opened is not None]
        return check_tree(self._tree, external=published, each_node=False)

    def observe(self, observer: O) -> O:
        """Attach a `FlightRecorder`, a `Trace` or the like: before the tree starts if it has not started yet, else now."""
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
    def me(self) -> Node:
        """The rig's own node, through which it talks to the others."""
        if self._me is None:
            raise NotStarted("the rig runs no system yet: await rig.start(tree) first")
        return self._me.node

    @property
    def now(self) -> float:
        """Seconds on the system's clock."""
        return self.system.clock.now()

    @property
    def reports(self) -> list[Report]:
        """What the supervisors reported."""
        return list(self.system.reports)

    async def close(self) -> None:
        """Stop the system and check that nothing is left of it and nothing failed unheard. Raises `Leak` or `UnexpectedFailure`."""
        system = self._system
        if system is not None:
            self._watch.look_beside()
            await system.stop("the test is over")
            await self.quiet()
            left = self.leaks.left_over(system)
            sentence = "left over after the system's end: " + "; ".join(left) if left else ""
            self._watch.check(more=sentence)
            if left:
                raise Leak(sentence)
        self._watch.demand()

    # -- time ---------------------------------------------------------------------------------------------------------------

    async def quiet(self) -> None:
        """Let everything happen that can happen at this very instant."""
        while True:
            await asyncio.sleep(0)
            if self.loop.idle:
                return

    async def advance(self, seconds: float) -> None:
        """Let `seconds` pass, and everything that is due until then, including what is due at the last instant.

        Raises `UnexpectedFailure` when a node failed, or a supervisor gave up, and the test did not say so.
        """
        await self.system.clock.sleep_until(self.now + seconds)
        await self.quiet()
        self._watch.look_beside(own=_ME)
        self._watch.check()

    async def until(self, condition: Callable[[], bool], *, within: float = 60.0, step: float = 0.005) -> None:
        """Let time pass until `condition()` holds; it is looked at every `step` seconds. Fails after `within` seconds."""
        end = self.now + within
        while not condition():
            if self.now >= end:
                raise AssertionError(f"not true within {within:g} s (now t={self.now:.3f} s)\n{self.timeline()}")
            await self.advance(min(step, end - self.now))

    async def settled(self, *, within: float = 60.0) -> None:
        """Let time pass until every node runs or has ended for good, and every inbox is empty."""
        await self.quiet()
        await self.until(lambda: all(_is_settled(state) for state in self.system.nodes.values()), within=within)

    # -- topics, services, actions ------------------------------------------------------------------------------------------

    def probe(self, topic: Topic[M], *, name: str | None = None, qos: QoS | int | None = None) -> Probe[M]:
        """Record a topic from now on. `name` is a full name instead of the contract's; latched messages come first."""
        me = incarnation_of(self.me)
        entry = self.system.graph.topic(name or me.identity.topic(topic.name))
        probe = Probe(me, entry, topic.type, topic.qos if qos is None else of(qos), self.system.clock.now)
        me.streams.append(cast("Any", probe))
        entry.add_subscription(probe)
        return probe

    def publish(self, topic: Topic[M], message: M) -> None:
        """Publish one message; delivered when the test next awaits."""
        me = incarnation_of(self.me)
        for publisher in me.publishers:
            if publisher.type is topic.type and publisher.entry.name == me.identity.topic(topic.name):
                publisher.publish(message)
                return
        self.me.publisher(topic).publish(message)

    async def call(self, service: Service[Req, Resp], request: Req, *, timeout: float = CALL_TIMEOUT) -> Resp:
        """Ask a service."""
        return await self.me.call(service, request, timeout=timeout)

    async def start_goal(self, action: Action[G, R, F], goal: G, *, timeout: float = GOAL_TIMEOUT) -> Goal[R, F]:
        """Send a goal and return when it is accepted. Raises `GoalRejected`."""
        handle = self.me.start(action, goal, timeout=timeout)
        await handle.send()
        return handle

    # -- nodes --------------------------------------------------------------------------------------------------------------

    def state(self, node: type[Node] | str) -> NodeRecord:
        """What is known of a node, by its class, its name or its full name."""
        return self.system.runtime.directory.named(node)

    @overload
    def node(self, node: type[N]) -> N: ...
    @overload
    def node(self, node: str) -> Node: ...
    def node(self, node: type[Node] | str) -> Node:
        """The living object of this class, or of the node of this name or full name."""
        return self.system.node(node)

    def incarnation(self, node: type[Node] | str) -> int:
        """The number of the node's present or last life."""
        return self.state(node).incarnation

    def crash(self, node: type[Node] | str, error: Exception | None = None) -> None:
        """Make a node fail, as if a handler of it had raised `error`. Raises `LookupError` and `NotStarted`.

        The test means it, so the node's end is no `UnexpectedFailure`; a supervisor that gives up because of it is one.
        """
        error = error or RuntimeError("crashed by the rig")
        self.system.crash(node, error)
        self._watch.planned.append(error)

    def expect_failure(
        self,
        error: type[BaseException] | tuple[type[BaseException], ...] = BaseException,
        *,
        node: type[Node] | str | None = None,
        match: str = "",
    ) -> ExpectedFailure:
        """Say that a node will fail with such an `error`, or that a supervisor will give up (`SupervisorGaveUp`).

        It holds to the end of the test, or of the block when it is used as ``with rig.expect_failure(OSError): ...``, for any number of
        failures; the test fails when none comes. `node` is a class, a name, a full name or a path in the tree; `match` is a regular
        expression searched in the error's text. The errors that came are in `.errors`.
        """
        return self._watch.expect(error, node, match)

    # -- when a test fails --------------------------------------------------------------------------------------------------

    def timeline(self, last: int = 30) -> str:
        """The newest log lines, among them the supervisors' reports, in order."""
        seed = self._system.seed if self._system is not None else 0
        time = f"{self.now:.6f}" if self._system is not None else "-"
        lines = [str(record) for record in list(self.logs)[-last:]]
        return "\n".join([f"rig: seed={seed} t={time} s; the last {len(lines)} log lines:", *lines])


def _is_settled(state: NodeRecord) -> bool:
    inbox = state.inbox
    return state.state in ("running", "stopped") and not inbox.items and not inbox.control and inbox.current is None
