"""The machinery behind one life of a node: its endpoints, timers, tasks, and their orderly end.

`Node` is what people write, `Core` is what runs it. A core belongs to one incarnation; the `Mailbox` it works from outlives it.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Coroutine
from threading import get_ident
from typing import TYPE_CHECKING, Any, Final, TypeVar

from actors.actions import ActionServer
from actors.control import Failure, StopRequest
from actors.errors import DeclarationError, NodeRestarting, NotRunning, NotStarted, WrongThread, described, place_of
from actors.feeds import ConcurrentFeed, Feed
from actors.goal_client import Goal
from actors.identity import Identity
from actors.inbox import Inbox, Item, awaited_in
from actors.mailbox import Mailbox
from actors.qos import (
    ACTION_FEEDBACK,
    ACTION_STATUS,
    DEFAULT,
    PARAMETER_EVENTS,
    ROSOUT,
    QoS,
    resolve_publisher,
    resolve_subscription,
)
from actors.services import Client, Server
from actors.stream import Stream, Subscription
from actors.supervision.reasons import Stop
from actors.timed import publisher_for
from actors.timers import TimerItem, TimerRecord

if TYPE_CHECKING:
    from random import Random

    from actors.blueprint import Blueprint
    from actors.channel import Publisher
    from actors.clock import Clock
    from actors.contracts import Action, Service, Topic
    from actors.deadlines import Deadlines
    from actors.graph import TopicEntry
    from actors.interfaces.message import Message
    from actors.logs import NodeLog
    from actors.node import ErrorVerdict, Node
    from actors.parameters import ParameterChange, ParameterStore
    from actors.system import System

__all__ = ["Core"]

M = TypeVar("M", bound="Message")
G = TypeVar("G", bound="Message")
R = TypeVar("R", bound="Message")
F = TypeVar("F", bound="Message")
Req = TypeVar("Req", bound="Message")
Resp = TypeVar("Resp", bound="Message")


_EVENT_QOS: Final = {
    "parameter_events": PARAMETER_EVENTS,
    "rosout": ROSOUT,
    "status": ACTION_STATUS,
    "feedback": ACTION_FEEDBACK,
}


CLIENTS: Final = 256
"""So many services a node remembers its way to; it finds it again when it has forgotten it."""


class Core:
    """One incarnation of one node in one system."""

    __slots__ = (
        "clients", "_log", "_parameters", "_rng", "blueprint", "derived", "ended", "identity", "inbox", "incarnation", "mailbox", "node",
        "publishers", "publishing", "serving", "streams", "system", "tasks", "timers", "waits_for",
    )  # fmt: skip

    def __init__(self, system: System, node: Node, blueprint: Blueprint, identity: Identity, mailbox: Mailbox) -> None:
        self.system = system
        self.node = node
        self.blueprint = blueprint
        self.identity = identity
        self.mailbox = mailbox
        self.inbox: Inbox = mailbox.inbox
        if mailbox.core is not None:  # one that refused to die: nothing of it may go on under the new one's name
            mailbox.core.release()
        mailbox.core = self
        mailbox.incarnation += 1
        self.incarnation = mailbox.incarnation
        self.publishers: list[Publisher[Any]] = []
        self.streams: list[Subscription[Any]] = []
        self.timers: list[TimerItem] = []
        self.derived: list[Server] = []
        """Services that ROS 2 gives every node, as far as somebody asked for them."""
        self.tasks: dict[asyncio.Task[Any], None] = {}
        self.publishing = True
        self.serving = False
        """Whether the start phase is over: what came meanwhile has waited for that."""
        self.ended = False
        self.waits_for: Any = None
        self.clients: dict[Any, Client[Any, Any]] = {}
        self._log: NodeLog | None = None
        self._rng: Random | None = None
        self._parameters: ParameterStore | None = None

    def __repr__(self) -> str:
        return f"<core of {self.fqn}, incarnation {self.incarnation}>"

    # -- what others ask of a node ------------------------------------------------------------------------------------------

    @property
    def fqn(self) -> str:
        return self.identity.fqn

    @property
    def clock(self) -> Clock:
        return self.system.clock

    @property
    def deadlines(self) -> Deadlines:
        return self.system.deadlines

    @property
    def log(self) -> NodeLog:
        if self._log is None:
            self._log = self.system.node_log(self.fqn, self.incarnation)
        return self._log

    @property
    def rng(self) -> Random:
        if self._rng is None:
            self._rng = self.system.random(f"{self.fqn}#{self.incarnation}")
        return self._rng

    @property
    def parameters(self) -> ParameterStore:
        if self._parameters is None:
            from actors.parameters import ParameterStore

            told = self._parameters_changed if self.system.on_parameters is not None else None
            self._parameters = ParameterStore(
                self.fqn, self.identity.overrides, table=self.blueprint.table, on_event=told
            )
            self._parameters.on_event = self._parameters_changed  # for who listens only later
        return self._parameters

    def _parameters_changed(self, change: ParameterChange) -> None:
        if self.system.on_parameters is not None:
            self.system.on_parameters(self, change)

    def new_id(self) -> bytes:
        return self.system.new_id()

    def warn(self, event: str, **fields: object) -> None:
        self.log.warning(event, **fields)

    def service_failed(self, service: str, error: Exception) -> None:
        """An exception left a service handler; its caller hears of it, the node only if it says so."""
        self._answered(error, service, "service handler failed")

    def goal_failed(self, action: str, error: Exception) -> None:
        """An exception left an action body; its client hears of it, the node only if it says so."""
        self._answered(error, action, "goal failed")

    def _answered(self, error: Exception, handler: str, event: str) -> None:
        if isinstance(error, Stop):
            self.fail(error, handler, decided=True)
            return
        self.log.error(event, handler=handler, error=described(error), at=place_of(error))
        try:
            verdict = self.node.on_error(error, handler)
        except Exception as problem:  # the verdict on a verdict: nobody may wait for ever because of it
            self.fail(problem, f"on_error for {handler}", decided=True)
            return
        if verdict == "fail":
            self.fail(error, handler, decided=True)

    def fail(self, error: BaseException, label: str, *, decided: bool = False) -> None:
        """Let `error` end this incarnation at its next turn, unless it is `decided` not yet and `on_error` says otherwise."""
        if self.ended:  # the next incarnation is not to blame
            self.log.error("failed after the end of its node", handler=label, error=described(error))
        else:
            self.inbox.put_control(Failure(error, label, decided=decided))

    # -- making endpoints ---------------------------------------------------------------------------------------------------

    def publisher(self, topic: Topic[M], qos: QoS) -> Publisher[M]:
        self.check_use()
        entry = self.system.graph.topic(self.identity.topic(topic.name))
        offered = resolve_publisher(qos, [queue.qos for queue in entry.subscriptions])
        publisher = publisher_for(self, entry, topic.type, offered)
        self.publishers.append(publisher)
        entry.add_publisher(publisher)
        if not self.publishing:
            publisher.suspend()
        return publisher

    def subscribe(self, topic: Topic[M], qos: QoS) -> Stream[M]:
        self.check_use()
        entry = self.system.graph.topic(self.identity.topic(topic.name))
        queue = Subscription(self, entry, topic.type, resolve_subscription(qos, [one.qos for one in entry.publishers]))
        self.streams.append(queue)
        queue.on_close = self._stream_closed
        queue.entry.add_subscription(queue)
        return Stream(queue)

    def subscription(self, topic: Topic[M]) -> Feed[M]:
        """The queue behind this incarnation's first handler of `topic`."""
        name = self.identity.topic(topic.name)
        for feed in self.mailbox.feeds:
            if feed.node is self and feed.entry.name == name:
                return feed
        raise DeclarationError(f"{self.fqn} has no handler of {name}: declare one with @{topic!r}.on()")

    def _stream_closed(self, queue: Subscription[Any]) -> None:
        self.streams.remove(queue)
        self.mailbox.note((queue.entry,))

    def client(self, service: Service[Req, Resp]) -> Client[Req, Resp]:
        client = self.clients.get(service)
        if client is None:
            if len(self.clients) >= CLIENTS:  # its contracts are made by the dozen
                self.mailbox.note(one.entry for one in self.clients.values())
                self.clients.clear()
            entry = self.system.graph.service(self.identity.service(service.name))
            client = self.clients[service] = Client(self, entry, service)
            entry.clients[self.fqn] = entry.clients.get(self.fqn, 0)
        return client

    def goal(self, action: Action[G, R, F], message: G, timeout: float) -> Goal[R, F]:
        entry = self.system.graph.action(self.identity.service(action.name))
        entry.clients[self.fqn] = entry.clients.get(self.fqn, 0) + 1
        self.mailbox.note((entry,))
        return Goal(self, entry, action, message, timeout)

    def feed(
        self, topic: Topic[M], qos: QoS, handler: Callable[[M], Awaitable[None] | None], label: str, concurrent: int = 0
    ) -> None:
        """Let `handler` take the messages of `topic`; a queue that is left over from the last incarnation is taken over."""
        self.check_use()
        entry = self.system.graph.topic(self.identity.topic(topic.name))
        feed = self._left_over(entry, topic.type, label, concurrent)
        fresh = feed is None
        if feed is None:
            qos = resolve_subscription(qos, [one.qos for one in entry.publishers])
            if concurrent:
                feed = ConcurrentFeed(self, entry, topic.type, qos, self.inbox, label, concurrent)
            else:
                feed = Feed(self, entry, topic.type, qos, self.inbox, label)
            self.mailbox.feeds.append(feed)
        feed.node = self
        feed.handler = handler
        if isinstance(feed, ConcurrentFeed):
            feed.active = 0
            feed.spawn = self.spawn if self.serving else None
        if fresh:
            entry.add_subscription(feed)

    def serve_concurrently(self) -> None:
        """The node has started: begin with the messages and requests that have come meanwhile for concurrent handlers."""
        self.serving = True
        for feed in self.mailbox.feeds:
            if isinstance(feed, ConcurrentFeed):
                feed.spawn = self.spawn
                for _ in range(min(feed.concurrent, len(feed.messages))):
                    feed.work()
        for server in self.mailbox.services.values():
            server.begin()

    def _left_over(self, entry: TopicEntry, type: type[M], label: str, concurrent: int) -> Feed[M] | None:
        """The first queue of this handler that the last incarnation had and this one has not yet."""
        for feed in self.mailbox.feeds:
            same = feed.node is not self and feed.label == label and feed.entry is entry and feed.type is type
            if same and concurrent == (feed.concurrent if isinstance(feed, ConcurrentFeed) else 0):
                return feed
        return None

    def serve(
        self,
        service: Service[Req, Resp],
        handler: Callable[[Req], Coroutine[Any, Any, Resp]],
        label: str,
        concurrent: int = 0,
    ) -> None:
        self.check_use()
        entry = self.system.graph.service(self.identity.service(service.name))
        self._refuse_second(entry.server, entry.name, "service")
        server = Server(self, entry, service.response, label, concurrent)
        server.handler = handler
        self.mailbox.services[entry.name] = server
        entry.open(server)

    def serve_action(self, server: ActionServer) -> None:
        self._refuse_second(server.entry.server, server.entry.name, "action")
        self.mailbox.actions[server.entry.name] = server
        server.entry.open(server)
        graph = self.system.graph
        for part in ("status", "feedback"):  # who listened to the last incarnation's hears this one's
            topic = graph.topics.get(f"{server.entry.name}/_action/{part}")
            if topic is not None and topic.subscriptions:
                graph.derive_topic(topic)

    def _refuse_second(self, server: Server | ActionServer | None, name: str, kind: str) -> None:
        if server is not None:
            raise DeclarationError(
                f"{self.fqn} would be the second server of {kind} {name}, which {server.node.fqn} serves already: "
                "give one of them another name or namespace"
            )

    # -- timers and publishing ------------------------------------------------------------------------------------------------

    def start_timers(self) -> None:
        """Let every `@every` of the class tick from now on."""
        node, labels = self.node, self.blueprint.labels
        for timer in self.blueprint.timers:
            hz = self.parameters.value(timer.hz) if isinstance(timer.hz, str) else timer.hz
            record = self.mailbox.timers.get(timer.attribute)
            if record is None:
                record = self.mailbox.timers[timer.attribute] = TimerRecord(hz)
            record.hz = hz
            handler, label = getattr(node, timer.attribute), labels[timer.attribute]
            item = TimerItem(self.inbox, handler, hz, timer.late, label, record)
            self.timers.append(item)
            item.begin(self.system.ticker)

    def stop_timers(self) -> None:
        for timer in self.timers:
            timer.stop()
        self.timers.clear()

    def let_publish(self, allowed: bool) -> None:
        """Whether the node's own publishers deliver or discard; those that ROS 2 gives every node always deliver."""
        self.publishing = allowed
        for publisher in self.publishers:
            if publisher.gated:
                if allowed:
                    publisher.resume()
                else:
                    publisher.suspend()

    def event_publisher(self, type: type[M], entry: TopicEntry) -> Publisher[M]:
        """The node's publisher on a topic that ROS 2 gives every node of its kind, made at its first use."""
        for publisher in self.publishers:
            if publisher.entry is entry:
                return publisher
        publisher = publisher_for(self, entry, type, _EVENT_QOS.get(entry.name.rpartition("/")[2], DEFAULT))
        publisher.gated = False
        self.publishers.append(publisher)
        entry.add_publisher(publisher)
        return publisher

    # -- tasks --------------------------------------------------------------------------------------------------------------

    def spawn(self, work: Coroutine[Any, Any, Any], *, name: str = "") -> asyncio.Task[Any]:
        """Run `work` in a task that this node owns: its failure is the node's failure, the node's stop cancels it."""
        if self.ended:
            work.close()
            raise self._over()
        task = self.system.loop.create_task(work, name=f"{self.fqn} {name or getattr(work, '__qualname__', work)}")
        self.tasks[task] = None
        task.add_done_callback(self._task_ended)
        return task

    def _task_ended(self, task: asyncio.Task[Any]) -> None:
        self.tasks.pop(task, None)
        if not task.cancelled() and (error := task.exception()) is not None:
            self.fail(error, task.get_name())

    def threadsafe(self, function: Callable[[], object]) -> None:
        """From any thread: call `function` in the loop; what it raises is this node's failure."""

        def call() -> None:
            try:
                function()
            except Exception as error:
                self.fail(error, "a call from another thread")

        self.system.threadsafe(call)

    async def cancel_tasks(self) -> None:
        """Cancel what this node runs, newest first, and wait until it has ended."""
        current = asyncio.current_task()
        while tasks := [task for task in reversed(self.tasks) if task is not current]:
            for task in tasks:
                task.cancel()
                await asyncio.wait([task])

    def on_error(self, error: Exception, handler: str) -> ErrorVerdict:
        """An exception left a timer or topic handler: what the node says; `Stop` is no error but the node's own word."""
        current = self.inbox.current
        if isinstance(error, Stop) or (isinstance(current, Failure) and current.decided):
            return "fail"
        return self.node.on_error(error, handler)

    def on_holding(self, item: Item, seconds: float) -> None:
        """A handler keeps the node's other handlers waiting: tell once, with what it waits for and the remedy."""
        task = self.inbox.task
        lost = sum(timer.record.missed for timer in self.timers)
        self.log.warning(
            f"handler holds the inbox for more than {seconds:g} s", handler=item.label, awaits=awaited_in(task) if task else "",
            ticks_lost=lost, remedy="declare it concurrent=n, make it an action, or self.offload() its work",
        )  # fmt: skip

    def check_use(self) -> None:
        """Refuse a foreign thread, and what comes after the end of this incarnation."""
        if get_ident() != self.system.thread:
            raise WrongThread(f"{self.fqn} was used from a foreign thread: use node.threadsafe(function, *arguments)")
        if self.ended:
            raise self._over()

    def _over(self) -> NotStarted:
        return NotStarted(f"{self.fqn}, incarnation {self.incarnation}, has ended: ask its successor, if there is one")

    def request_stop(self, reason: str) -> None:
        """Have the inbox raise `StopServing` when the present handler has ended."""
        self.inbox.put_control(StopRequest(reason))

    # -- the end ------------------------------------------------------------------------------------------------------------

    def release(self) -> None:
        """Give up, at once and without waiting, all that belongs to this incarnation only. Twice is fine."""
        if self.ended:
            return
        self.ended = True
        self.mailbox.core = None
        self.stop_timers()
        for task in reversed(self.tasks):
            task.cancel()
        self.mailbox.note(one.entry for one in (*self.publishers, *self.clients.values(), *self.derived))
        for publisher in self.publishers:
            publisher.close()
        self.publishers.clear()
        for queue in list(self.streams):
            queue.close()
        for server in self.derived:
            server.fail_all(self.absent)
            server.entry.server = None
        self.derived.clear()
        self.mailbox.park(self.fqn, self.absent)

    def absent(self) -> Exception:
        """What those hear who wait for an answer of this incarnation when it ends."""
        if self.system.stop_reason is not None:
            return NotRunning(f"{self.fqn} has stopped: {self.system.stop_reason}")
        return NodeRestarting(self.fqn, self.incarnation)
