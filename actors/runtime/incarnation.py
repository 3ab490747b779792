"""`Incarnation`: one life of one node, with its endpoints, timers, tasks, clock and log.

`Node` is what people write; its incarnation is what runs it. How a life begins, goes on and ends is told in `actors.runtime.life`.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from threading import get_ident
from typing import TYPE_CHECKING, Any, Final, Literal, TypeVar

from actors.actions.client import Goal
from actors.errors import DeclarationError, Ended, NodeRestarting, NotRunning, NotStarted, ProgramExit, WrongThread
from actors.inbox.control import Failure, StopRequest, blame
from actors.logs import WARN
from actors.qos import resolve_publisher, resolve_subscription
from actors.qos.policies import QoS
from actors.runtime import answers, endpoints, life, owned_tasks
from actors.runtime.node_parameters import check_store, make_store
from actors.services.client import Client
from actors.supervision.reasons import Stop
from actors.topics.stream import Stream, StreamSubscription
from actors.topics.timed_publisher import publisher_for

if TYPE_CHECKING:
    from random import Random

    from actors.contracts.contracts import Action, Service, Topic
    from actors.inbox.inbox import Item
    from actors.interfaces.message import Message
    from actors.logs import NodeLog
    from actors.node.node import ErrorVerdict, Node
    from actors.parameters import ParameterStore
    from actors.runtime.record import NodeRecord
    from actors.runtime.runtime import Runtime
    from actors.runtime.sim_time import SimTime
    from actors.runtime.timers import NodeTimer
    from actors.services.server import Server
    from actors.time.clock import Clock
    from actors.time.deadlines import Deadlines
    from actors.topics.handler import Handler, HandlerSubscription
    from actors.topics.publisher import Publisher

__all__ = ["Incarnation", "Phase", "incarnation_of"]

M = TypeVar("M", bound="Message")
G = TypeVar("G", bound="Message")
R = TypeVar("R", bound="Message")
F = TypeVar("F", bound="Message")
Req = TypeVar("Req", bound="Message")
Resp = TypeVar("Resp", bound="Message")

Phase = Literal["new", "on_start", "begin", "running"]

CLIENTS: Final = 256
"""How many clients of services an incarnation keeps; one that it has dropped is made again at its next call."""


class Incarnation:
    """One life of one node. For its supervisor it is a `Life`; for endpoints it is the node that they belong to.

    Invariants:

    - It is its record's `life` from its making until it is released. `ended` turns true then, once and for good: it has no endpoints, takes no
      new ones, and spawns nothing.
    - `phase` only goes forwards: new, on_start, begin (the framework's own part of the start), running. It stays running during the clean-up.
    - `serving` turns true once, when the node is ready; concurrent handlers wait for that.
    - Every task in `tasks` has not ended; one that fails ends the incarnation, and no task outlives the clean-up.
    - `asked` is the reason of the end that the supervisor has asked for; None while it has not.
    """

    __slots__ = (
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
        if record.life is not None:  # one that refused to die: nothing of it may go on under the new one's name
            record.life.release()
        record.life = self
        record.incarnation += 1
        self.runtime = runtime
        self.record = record
        self.node = node
        self.identity = record.identity
        self.inbox = record.inbox
        self.incarnation = record.incarnation
        self.declarations = type(node).declarations
        self.clock: Clock = runtime.clock
        """The system's, until this incarnation uses simulated time."""
        self.phase: Phase = "new"
        self.asked: str | None = None
        self.serving = self.ended = False
        self.waits_for: Any = None
        self.tasks: dict[asyncio.Task[Any], None] = {}
        self.publishers: list[Publisher[Any]] = []
        self.publishing = True
        """Whether the node's own publishers deliver; a lifecycle node's do while it is active."""
        self.streams: list[StreamSubscription[Any]] = []
        self.clients: dict[Any, Client[Any, Any]] = {}
        self.timers: list[NodeTimer] = []
        self.standard_services: list[Server] = []
        """Services that ROS 2 gives every node, as far as somebody asked for them."""
        self.sim: SimTime | None = None
        self._parameters: ParameterStore | None = None
        self._log: NodeLog | None = None
        self._rng: Random | None = None
        node.__machinery__ = self

    def __repr__(self) -> str:
        return f"<incarnation {self.incarnation} of {self.fqn}>"

    # -- the life, for its supervisor ---------------------------------------------------------------------------------------

    run = life.run  # a method, without a frame of its own: there is one for every node

    def stop(self, reason: str) -> None:
        """Ask for an orderly end: after the present handler, before anything else that waits."""
        self.asked = reason
        if not self.ended:
            self.request_stop(reason)

    # -- who, when, and what it may use -------------------------------------------------------------------------------------

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
        """Make the store of the declared parameters, and check the overrides. With `announce` the observers are told of them.

        Raises `ParameterError`.
        """
        store = self._parameters = make_store(self, announce=announce)
        check_store(self, store)  # the node's hooks may read what they are asked about
        return store

    def ros_time(self) -> SimTime:
        """This incarnation's ROS time, made at its first use; its clock is the node's from then on."""
        if self.sim is None:
            from actors.runtime.sim_time import SimTime

            self.sim = SimTime(self)
            self.clock = self.sim.clock
        return self.sim

    def now_ns(self) -> int:
        """What the node's clock shows, nanoseconds."""
        return self.clock.now_ns()

    def new_id(self) -> bytes:
        return self.runtime.new_id()

    def warn(self, event: str, **fields: object) -> None:
        self.log.write(WARN, event, fields)

    def check_thread(self) -> None:
        """Refuse a foreign thread."""
        if get_ident() != self.runtime.thread:
            raise WrongThread(
                f"{self.fqn} was used from a foreign thread: use node.threadsafe(function, *arguments), and for what is awaited "
                "blocking.open_node(name, system=system)"
            )

    def check_use(self) -> None:
        """Refuse a foreign thread, and what comes after the end of this incarnation."""
        self.check_thread()
        if self.ended:
            raise self._over()

    def _over(self) -> Ended:
        return Ended(f"{self.fqn}, incarnation {self.incarnation}, has ended: ask its successor, if there is one")

    # -- endpoints ----------------------------------------------------------------------------------------------------------

    def publisher(self, topic: Topic[M], qos: QoS) -> Publisher[M]:
        self.check_use()
        entry = self.runtime.graph.topic(self.identity.topic(topic.name))
        offered = resolve_publisher(qos, [one.qos for one in entry.subscriptions])
        publisher = publisher_for(self, entry, topic.type, offered)
        self.publishers.append(publisher)
        entry.add_publisher(publisher)
        if not self.publishing:
            publisher.suspend()
        return publisher

    def subscribe(self, topic: Topic[M], qos: QoS) -> Stream[M]:
        self.check_use()
        entry = self.runtime.graph.topic(self.identity.topic(topic.name))
        requested = resolve_subscription(qos, [one.qos for one in entry.publishers])
        subscription = StreamSubscription(self, entry, topic.type, requested, self._stream_closed)
        self.streams.append(subscription)
        entry.add_subscription(subscription)
        return Stream(subscription, self.runtime.loop)

    def _stream_closed(self, subscription: StreamSubscription[Any]) -> None:
        self.streams.remove(subscription)
        self.record.note((subscription.entry,))

    def subscription(self, topic: Topic[M]) -> HandlerSubscription[M]:
        """The subscription of this incarnation's first handler of `topic`."""
        name = self.identity.topic(topic.name)
        for subscription in self.record.subscriptions:
            if subscription.node is self and subscription.entry.name == name:
                return subscription
        raise DeclarationError(f"{self.fqn} has no handler of {name}: declare one with @{topic!r}.on()")

    def client(self, service: Service[Req, Resp]) -> Client[Req, Resp]:
        """A client of a service that is not among `clients` yet."""
        if len(self.clients) >= CLIENTS:  # its contracts are made by the dozen
            self.record.note(one.entry for one in self.clients.values())
            self.clients.clear()
        entry = self.runtime.graph.service(self.identity.service(service.name))
        client = self.clients[service] = Client(self, entry, service)
        entry.clients[self.fqn] = entry.clients.get(self.fqn, 0)
        return client

    def goal(self, action: Action[G, R, F], message: G, timeout: float) -> Goal[R, F]:
        entry = self.runtime.graph.action(self.identity.service(action.name))
        entry.clients[self.fqn] = entry.clients.get(self.fqn, 0) + 1
        self.record.note((entry,))
        return Goal(self, entry, action, message, timeout)

    def handle(self, topic: Topic[M], qos: QoS, handler: Handler[M], label: str) -> None:
        """Let `handler` take the messages of `topic` from now on."""
        endpoints.handle(self, topic, qos, handler, label)

    def serve(
        self, service: Service[Req, Resp], handler: Callable[[Req], Coroutine[Any, Any, Resp]], label: str
    ) -> None:
        """Let `handler` answer the requests of `service` from now on."""
        endpoints.serve(self, service, handler, label)

    def let_publish(self, allowed: bool) -> None:
        """Whether the node's own publishers deliver or discard; those that ROS 2 gives every node always deliver."""
        self.publishing = allowed
        for publisher in self.publishers:
            if publisher.gated:
                if allowed:
                    publisher.resume()
                else:
                    publisher.suspend()

    def stop_timers(self) -> None:
        for timer in self.timers:
            timer.stop()
        self.timers.clear()

    # -- errors -------------------------------------------------------------------------------------------------------------

    def service_failed(self, service: str, error: Exception) -> None:
        """An exception left a service handler: its caller is told, and the node's `on_error` decides whether the node fails, too."""
        answers.answered_with(self, error, service, "service handler failed")

    def goal_failed(self, action: str, error: Exception) -> None:
        """An exception left an action body: its client is told, and the node's `on_error` decides whether the node fails, too."""
        answers.answered_with(self, error, action, "goal failed")

    def fail(self, error: BaseException, label: str, *, decided: bool = False) -> None:
        """Let `error` end this incarnation at its next turn; unless it is `decided`, `on_error` may say otherwise."""
        if self.ended:  # the next incarnation is not to blame
            answers.tell_late(self, error, label)
        else:
            self.inbox.put_control(Failure(error, label, decided=decided))

    def on_error(self, error: Exception, handler: str) -> ErrorVerdict:
        """An exception left a timer or topic handler: what the node says; `Stop` is no error but the node's own word."""
        current = self.inbox.current
        if isinstance(error, (Stop, ProgramExit)) or (isinstance(current, Failure) and current.decided):
            return "fail"
        verdict = self.node.on_error(error, handler)
        if verdict == "continue":
            self.record.work_on()
        return verdict

    def on_holding(self, item: Item, seconds: float) -> None:
        """A handler keeps the node's other handlers waiting."""
        answers.tell_holding(self, item, seconds)

    def absent(self) -> Exception:
        """The error for those who wait for an answer of this incarnation when it ends."""
        if (reason := self.runtime.stop_reason) is not None:
            return NotRunning(f"{self.fqn} has stopped: {reason}")
        return NodeRestarting(self.fqn, self.incarnation)

    # -- tasks --------------------------------------------------------------------------------------------------------------

    def spawn(self, work: Coroutine[Any, Any, Any], *, name: str = "") -> asyncio.Task[Any]:
        """Run `work` in a task that this node owns: its failure is the node's failure, the node's stop cancels it."""
        if self.ended:
            work.close()
            raise self._over()
        task = self.runtime.loop.create_task(work, name=f"{self.fqn} {name or getattr(work, '__qualname__', work)}")
        self.tasks[task] = None
        task.add_done_callback(self._task_ended)
        return task

    def own(self, work: Coroutine[Any, Any, None], *, name: str = "") -> asyncio.Task[None]:
        """As `spawn`, for code of the user's: whatever leaves it ends the node, and never the event loop."""
        if self.ended:
            work.close()
            raise self._over()
        return owned_tasks.spawn_contained(self, work, name)

    def _task_ended(self, task: asyncio.Task[Any]) -> None:
        self.tasks.pop(task, None)
        if not task.cancelled() and (error := task.exception()) is not None:
            self.fail(error, task.get_name())

    def threadsafe(self, function: Callable[[], object]) -> None:
        """From any thread: call `function` in the loop; what it raises is this node's failure."""

        def call() -> None:
            try:
                function()
            except BaseException as error:
                self.fail(blame(error, "a call from another thread") or error, "a call from another thread")

        self.runtime.threads.submit(call)

    # -- the end ------------------------------------------------------------------------------------------------------------

    def request_stop(self, reason: str) -> None:
        """Have the inbox raise `StopServing` when the present handler has ended."""
        self.inbox.put_control(StopRequest(reason))

    def release(self) -> None:
        """Give up, at once and without waiting, all that belongs to this incarnation only. Once: then it has `ended`."""
        self.ended = True
        record = self.record
        record.life = None
        self.stop_timers()
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
