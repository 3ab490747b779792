"""`Incarnation`: one life of one node, with its endpoints, timers, tasks, clock and log.

A `Node` object holds the user's code and state; its incarnation runs it. `actors.runtime.life` describes a life from start to end.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Coroutine
from threading import get_ident
from typing import TYPE_CHECKING, Any, Literal, TypeVar

from actors.errors import Ended, NodeRestarting, NotRunning, NotStarted, ProgramExit, WrongThread
from actors.inbox.control import Failure, StopRequest, blame
from actors.logs import WARN
from actors.runtime import answers, endpoints, life, owned_tasks, timers, uses
from actors.runtime.ids import uuid_of
from actors.runtime.node_parameters import check_store, make_store
from actors.services.introspection import caller_id
from actors.supervision.reasons import Stop

if TYPE_CHECKING:
    from random import Random

    from actors.actions.client import Goal
    from actors.contracts.contracts import Action, Service, Topic
    from actors.inbox.inbox import Item
    from actors.interfaces.message import Message
    from actors.logs import NodeLog
    from actors.parameters import ParameterStore
    from actors.qos.policies import QoS
    from actors.runtime.declarations import Late
    from actors.runtime.node import ErrorVerdict, Node
    from actors.runtime.record import NodeRecord
    from actors.runtime.runtime import Runtime
    from actors.runtime.sim_time import SimTime
    from actors.runtime.timers import NodeTimer
    from actors.services.client import Client
    from actors.services.introspection import CallId
    from actors.services.server import Server
    from actors.time.clock import Clock
    from actors.time.deadlines import Deadlines
    from actors.topics.content_filter import ContentFilter
    from actors.topics.handler import Handler, HandlerSubscription
    from actors.topics.publisher import Publisher
    from actors.topics.stream import Stream, StreamSubscription

__all__ = ["Incarnation", "Phase", "incarnation_of"]

M = TypeVar("M", bound="Message")
G = TypeVar("G", bound="Message")
R = TypeVar("R", bound="Message")
F = TypeVar("F", bound="Message")
Req = TypeVar("Req", bound="Message")
Resp = TypeVar("Resp", bound="Message")

Phase = Literal["new", "on_start", "begin", "running"]


class Incarnation:
    """One life of one node. For its supervisor it is a `Life`; for endpoints it is the node that they belong to.

    Invariants:

    - It is the `life` of its record from its making until `release`. `release` sets `ended`, once and for good: from then on it publishes
      nothing, receives nothing and spawns no task.
    - `phase` only moves forwards: new, on_start, begin (the framework's own part of the start), running. It stays as it is in the clean-up.
    - `serving` turns true once, after the node has become ready. Concurrent handlers begin to run then.
    - `tasks` holds the tasks that have not ended. The failure of one ends the incarnation, and an orderly clean-up ends all of them.
    - `asked` is the reason for which the supervisor asked for the end; None before it asks.
    """

    __slots__ = (
        "_ids",
        "_log",
        "_parameters",
        "_rng",
        "asked",
        "clients",
        "clock",
        "declarations",
        "ended",
        "identity",
        "inbox",
        "incarnation",
        "made_timers",
        "node",
        "phase",
        "publishers",
        "publishing",
        "record",
        "runtime",
        "serving",
        "sim",
        "standard_services",
        "streams",
        "tasks",
        "timers",
        "waits_for",
    )

    def __init__(self, runtime: Runtime, record: NodeRecord, node: Node) -> None:
        if record.life is not None:  # it refused a kill and was abandoned: it must not keep its endpoints
            record.life.release()
        record.incarnation += 1
        self.runtime = runtime
        self.record = record
        self.node = node
        self.identity = record.identity
        self.inbox = record.inbox
        self.incarnation = record.incarnation
        self.declarations = type(node).declarations
        self.clock: Clock = runtime.clock
        """The system's clock, until this incarnation uses ROS time; from then on its own `SimClock`."""
        self.phase: Phase = "new"
        self.asked: str | None = None
        self.serving = self.ended = False
        self.waits_for: Any = None
        self.tasks: dict[asyncio.Task[Any], None] = {}
        self.publishers: dict[Publisher[Any], None] = {}
        """The open publishers, in the order in which they were made."""
        self.publishing = True
        """Whether the node's declared publishers deliver. For a lifecycle node that depends on its state."""
        self.streams: list[StreamSubscription[Any]] = []
        self.clients: dict[Any, Client[Any, Any]] = {}
        self.timers: list[NodeTimer] = []
        """The timers that the class declares, in that order; none while a lifecycle node is inactive."""
        self.made_timers: dict[NodeTimer, None] = {}
        """The timers that the node has made and not canceled."""
        self.standard_services: list[Server] = []
        """The standard services of the node that have been opened, because they were asked for."""
        self.sim: SimTime | None = None
        self._parameters: ParameterStore | None = None
        self._log: NodeLog | None = None
        self._rng: Random | None = None
        self._ids: Random | None = None
        node.__machinery__ = self
        record.life = self  # last: another thread may look at it from now on

    def __repr__(self) -> str:
        return f"<incarnation {self.incarnation} of {self.fqn}>"

    # -- the life, for its supervisor ---------------------------------------------------------------------------------------

    run = life.run  # the function itself: a method around it would cost each node one more coroutine

    def stop(self, reason: str) -> None:
        """Ask for an orderly end. It takes effect after the present handler, before all items that wait."""
        self.asked = reason
        if not self.ended:
            self.request_stop(reason)

    # -- identity, clock, log and parameters --------------------------------------------------------------------------------

    @property
    def fqn(self) -> str:
        return self.identity.fqn

    @property
    def thread(self) -> int:
        """The thread of the node's event loop."""
        return self.runtime.thread

    @property
    def deadlines(self) -> Deadlines:
        return self.runtime.deadlines

    @property
    def log(self) -> NodeLog:
        if self._log is None:
            self._log = self.runtime.journal.log(self.fqn, self.incarnation, self)
        return self._log

    @property
    def rng(self) -> Random:
        if self._rng is None:
            self._rng = self.runtime.random(f"{self.fqn}#{self.incarnation}")
        return self._rng

    @property
    def parameters(self) -> ParameterStore:
        """The node's parameters; the store is made at its first use."""
        return self._parameters or self.open_parameters(announce=False)

    def open_parameters(self, *, announce: bool) -> ParameterStore:
        """Make the parameter store and check the overrides. With `announce` the observers are told of the declared parameters.

        Raises `ParameterError` for an override that does not fit its declaration, or that a hook refuses.
        """
        store = self._parameters = make_store(self, announce=announce)
        check_store(self, store)  # after the assignment, because the node's hooks may read parameters
        return store

    def ros_time(self) -> SimTime:
        """The ROS time of this incarnation, made at its first use. From then on its clock is the node's clock."""
        if self.sim is None:
            from actors.runtime.sim_time import SimTime

            self.sim = SimTime(self)
            self.clock = self.sim.clock
        return self.sim

    def now_ns(self) -> int:
        """The time of the node's clock, nanoseconds."""
        return self.clock.now_ns()

    def call_id(self, service: str, number: int) -> CallId:
        return caller_id(self.fqn, service), number

    def new_id(self) -> bytes:
        """A new id of 16 bytes in the form of a random UUID, from a stream of this incarnation's own."""
        if self._ids is None:
            self._ids = self.runtime.ids(self.fqn)
        drawn = uuid_of(self._ids)
        if self.inbox.border is not None:
            self.inbox.border.send("id", self.fqn, drawn)
        return drawn

    def warn(self, event: str, **fields: object) -> None:
        self.log.write(WARN, event, fields)

    def check_thread(self) -> None:
        """Raise `WrongThread` in any thread but that of the node's event loop."""
        if get_ident() != self.runtime.thread:
            raise WrongThread(
                f"{self.fqn} was used from a foreign thread: use node.threadsafe(function, *arguments), and for what is awaited "
                "blocking.open_node(name, system=system)"
            )

    def check_use(self) -> None:
        """Raise `WrongThread` in a foreign thread, and `Ended` after the end of this incarnation."""
        self.check_thread()
        if self.ended:
            raise self._over()

    def _over(self) -> Ended:
        return Ended(f"{self.fqn}, incarnation {self.incarnation}, has ended: ask its successor, if there is one")

    # -- endpoints ----------------------------------------------------------------------------------------------------------

    def publisher(self, topic: Topic[M], qos: QoS) -> Publisher[M]:
        return uses.publisher(self, topic, qos)

    def subscribe(self, topic: Topic[M], qos: QoS, filter: ContentFilter | None = None) -> Stream[M]:
        return uses.subscribe(self, topic, qos, filter)

    def subscription(self, topic: Topic[M]) -> HandlerSubscription[M]:
        """The subscription of this incarnation's first handler of `topic`. Raises `DeclarationError` without one."""
        return uses.subscription(self, topic)

    def client(self, service: Service[Req, Resp]) -> Client[Req, Resp]:
        """Make a client of `service`, which must not be in `clients` yet, and keep it there."""
        return uses.client(self, service)

    def goal(self, action: Action[G, R, F], message: G, timeout: float) -> Goal[R, F]:
        return uses.goal(self, action, message, timeout)

    def handle(self, topic: Topic[M], qos: QoS, handler: Handler[M], label: str) -> None:
        """Subscribe `handler` to `topic` from now on."""
        endpoints.handle(self, topic, qos, handler, label)

    def serve(
        self, service: Service[Req, Resp], handler: Callable[[Req], Coroutine[Any, Any, Resp]], label: str
    ) -> None:
        """Let `handler` answer the requests of `service` from now on."""
        endpoints.serve(self, service, handler, label)

    def let_publish(self, allowed: bool) -> None:
        """Let the node's declared publishers deliver, or discard, what they are given. Those of standard topics always deliver."""
        self.publishing = allowed
        for publisher in self.publishers:
            if publisher.gated:
                if allowed:
                    publisher.resume()
                else:
                    publisher.suspend()

    def tick(self, hz: float, handler: Callable[..., Awaitable[None] | None], late: Late, label: str) -> NodeTimer:
        """Start a timer that the node makes while it runs."""
        self.check_use()
        return timers.tick(self, hz, handler, late, label)

    def end_ticks(self, timer: NodeTimer) -> None:
        """End the ticks of such a timer."""
        timers.end_ticks(self, timer)

    def stop_timers(self) -> None:
        """Stop the timers that the class declares."""
        for timer in self.timers:
            timer.stop()
        self.timers.clear()

    # -- errors -------------------------------------------------------------------------------------------------------------

    def service_failed(self, service: str, error: Exception) -> None:
        """Handle an exception that left a service handler and was given to its caller: `on_error` decides whether the node fails, too."""
        answers.answered_with(self, error, service, "service handler failed")

    def service_took_long(self, service: str, seconds: float) -> None:
        answers.tell_took_long(self, service, seconds)

    def goal_failed(self, action: str, error: Exception, event: str = "goal failed") -> None:
        """Handle an exception that left an action's body or hook: log it as `event`; `on_error` decides whether the node fails, too."""
        answers.answered_with(self, error, action, event)

    def fail(self, error: BaseException, label: str, *, decided: bool = False) -> None:
        """Let `error` end this incarnation, as the next item of its inbox. Unless `decided`, `on_error` is asked first."""
        if self.ended:  # the next incarnation is not to blame
            answers.tell_late(self, error, label)
        else:
            self.inbox.put_control(Failure(error, label, decided=decided))

    def on_error(self, error: Exception, handler: str) -> ErrorVerdict:
        """Whether the node goes on after an exception left a timer or topic handler. `Stop` and `ProgramExit` always end it."""
        current = self.inbox.current
        if isinstance(error, (Stop, ProgramExit)) or (isinstance(current, Failure) and current.decided):
            return "fail"
        verdict = self.node.on_error(error, handler)
        if verdict == "continue":
            self.record.work_on()
        return verdict

    def on_holding(self, item: Item, seconds: float) -> None:
        """Log that a handler keeps the node's other handlers waiting, for `seconds` so far."""
        answers.tell_holding(self, item, seconds)

    def absent(self) -> Exception:
        """The error for callers whose answer this incarnation owes at its end: `NotRunning` if the system stops, else `NodeRestarting`."""
        if (reason := self.runtime.stop_reason) is not None:
            return NotRunning(f"{self.fqn} has stopped: {reason}")
        return NodeRestarting(self.fqn, self.incarnation)

    # -- tasks --------------------------------------------------------------------------------------------------------------

    def spawn(self, work: Coroutine[Any, Any, Any], *, name: str = "") -> asyncio.Task[Any]:
        """Run `work` in a task that the node owns: its failure is the node's failure, and the node's end cancels it. Raises `Ended`."""
        if self.ended:
            work.close()
            raise self._over()
        task = self.runtime.loop.create_task(work, name=f"{self.fqn} {name or getattr(work, '__qualname__', work)}")
        self.tasks[task] = None
        task.add_done_callback(self._task_ended)
        return task

    def own(self, work: Coroutine[Any, Any, None], *, name: str = "") -> asyncio.Task[None]:
        """As `spawn`, for user code: an exception of any kind ends the node, and never the event loop."""
        if self.ended:
            work.close()
            raise self._over()
        return owned_tasks.spawn_contained(self, work, name)

    def _task_ended(self, task: asyncio.Task[Any]) -> None:
        self.tasks.pop(task, None)
        if not task.cancelled() and (error := task.exception()) is not None:
            self.fail(error, task.get_name())

    def threadsafe(self, function: Callable[[], object]) -> None:
        """Call `function` in the event loop, soon; may be called from any thread. What `function` raises is this node's failure."""

        def call() -> None:
            try:
                function()
            except BaseException as error:
                self.fail(blame(error, "a call from another thread") or error, "a call from another thread")

        self.runtime.threads.submit(call)

    # -- the end ------------------------------------------------------------------------------------------------------------

    def request_stop(self, reason: str) -> None:
        """End the service in order when the present handler has ended."""
        self.inbox.put_control(StopRequest(reason))

    def release(self) -> None:
        """End this incarnation at once, without waiting: close its endpoints, stop its timers, cancel its tasks. Must be called once."""
        self.ended = True
        record = self.record
        record.life = None
        self.stop_timers()
        for timer in list(self.made_timers):
            self.end_ticks(timer)
        for task in reversed(self.tasks):
            task.cancel()
        if self.sim is not None:
            self.sim.clock.close()
        endpoints.close_all(self)
        record.park(self.absent)


def incarnation_of(node: Node) -> Incarnation:
    """The incarnation that runs this node object. Raises `NotStarted` before its start."""
    machinery = node.__machinery__
    if machinery is None:
        raise NotStarted(f"{type(node).__name__} has not been started yet")
    assert isinstance(machinery, Incarnation)
    return machinery
