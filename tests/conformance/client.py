"""The client of a case: a system with one node that does what it is told.

Over `simulated` it belongs to the process that runs the cases. Over `zenoh` it is in a process of its own: see `apart`.
"""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Callable, Collection
from typing import Any, Final, NamedTuple, Protocol, cast

from actors import Child, Node, Service, Topic
from actors.actions.client import Goal
from actors.checks import create
from actors.contracts.contracts import Action
from actors.errors import GoalRejected
from actors.logs import DEBUG, LogRecord
from actors.qos import of
from actors.runtime.incarnation import incarnation_of
from actors.system import System
from actors.testing import Probe
from actors.transport.bridge import connect
from actors.transport.protocol import Participant, Transport

FOUND_WITHIN: Final = 10.0
"""Seconds in which two systems have to find each other."""
_NOT_COUNTED: Final = ("/rosout", "/parameter_events")


class Counted:
    """A transport that counts what arrives."""

    def __init__(self, transport: Transport, counts: Counter[str]) -> None:
        self._transport = transport
        self._counts = counts

    def __getattr__(self, name: str) -> Any:
        return getattr(self._transport, name)

    async def join(self, domain_id: int, events: Any, *, beyond: bool = False) -> Any:
        return _CountedParticipant(await self._transport.join(domain_id, events, beyond=beyond), self._counts)


class _CountedParticipant:
    def __init__(self, participant: Participant, counts: Counter[str]) -> None:
        self._participant = participant
        self._counts = counts
        self._takes: dict[Any, Any] = {}

    def __getattr__(self, name: str) -> Any:
        return getattr(self._participant, name)

    def subscription(self, node: Any, name: str, type: Any, qos: Any, take: Any, *more: Any) -> Any:
        def counted(*arrived: Any) -> None:
            self._counts["messages"] += name not in _NOT_COUNTED
            take(*arrived)

        shared = self._takes.setdefault((name, take), counted)  # subscriptions with the same one share what arrives
        return self._participant.subscription(node, name, type, qos, shared, *more)

    def server(self, node: Any, name: str, type: Any, qos: Any, take: Callable[[Any], None]) -> Any:
        def counted(request: Any) -> None:
            self._counts["goals" if name.endswith("/_action/send_goal") else "calls"] += 1
            take(request)

        return self._participant.server(node, name, type, qos, counted)


class SentGoal(NamedTuple):
    """What became of a goal."""

    untold: str
    """Its status before the server had said anything."""
    id: bytes
    """Empty if it was rejected."""


class News(NamedTuple):
    """What a client has seen since it was asked before."""

    messages: dict[int, list[Any]]
    """By the number of the listener."""
    feedback: dict[bytes, int]
    """How many feedbacks each goal has got so far."""
    logs: list[tuple[float, int, str, int, str, dict[str, str]]]
    counts: dict[str, int]


class Told(Protocol):
    """A client, here or in another process."""

    async def open(self, name: str) -> None: ...
    async def wait_for_nodes(self, names: Collection[str]) -> None: ...
    async def listen(self, number: int, topic: Topic[Any], everything: bool) -> None: ...
    async def wait_for_publisher(self, number: int) -> None: ...
    async def next(self, number: int) -> Any: ...
    async def call(self, service: Service[Any, Any], request: Any, timeout: float) -> Any: ...
    async def send_goal(self, action: Action[Any, Any, Any], message: Any) -> SentGoal: ...
    async def news(self) -> News: ...
    async def close(self) -> None: ...


async def until(condition: Callable[[], object]) -> None:
    """Wait until it is met."""
    async with asyncio.timeout(FOUND_WITHIN):
        while not condition():
            await asyncio.sleep(0.01)


class Client:
    """See `Told`. A listener is either a probe, which keeps everything, or a subscription of the node."""

    def __init__(self, transport: Transport) -> None:
        self._logs: list[LogRecord] = []
        self._counts = Counter[str]()
        self._system = create(System, sinks=(self._logs.append,), level=DEBUG)
        connect(self._system.runtime, cast("Transport", Counted(transport, self._counts)))
        self._node: Any = None
        self._listeners: dict[int, Any] = {}
        self._taken = Counter[int]()
        self._goals: list[Goal[Any, Any]] = []

    async def open(self, name: str) -> None:
        self._system.open()
        self._node = (await self._system.join(Child(Node, name=name))).node
        await self._system.runtime.opened()

    async def wait_for_nodes(self, names: Collection[str]) -> None:
        await until(lambda: {known.fqn for known in self._system.graph.elsewhere()} == set(names))

    async def listen(self, number: int, topic: Topic[Any], everything: bool) -> None:
        if not everything:
            self._listeners[number] = self._node.subscribe(topic)
            return
        me = incarnation_of(self._node)
        entry = self._system.graph.topic(me.identity.topic(topic.name))
        self._listeners[number] = probe = create(Probe, me, entry, topic.type, of(topic.qos), self._system.clock.now)
        me.endpoints.join(cast("Any", probe))

    async def wait_for_publisher(self, number: int) -> None:
        await until(lambda: self._listeners[number].publisher_count)

    async def next(self, number: int) -> Any:
        self._taken[number] += 1
        return await self._listeners[number].next(timeout=FOUND_WITHIN)

    async def _new(self, number: int) -> list[Any]:
        listener = self._listeners[number]
        if not isinstance(listener, Probe):
            return [await self.next(number) for _ in range(listener.received - self._taken[number])]
        new = list(listener.messages)
        listener.clear()
        return new

    async def call(self, service: Service[Any, Any], request: Any, timeout: float) -> Any:
        return await self._node.call(service, request, timeout=timeout)

    async def send_goal(self, action: Action[Any, Any, Any], message: Any) -> SentGoal:
        goal = self._node.send_goal(action, message)
        untold = goal.status.name.lower()
        try:
            await goal.send()
        except GoalRejected:
            return SentGoal(untold, b"")
        self._goals.append(goal)
        return SentGoal(untold, goal.goal_id)

    async def news(self) -> News:
        messages = {number: await self._new(number) for number in self._listeners}
        logs = [
            (
                one.time,
                one.level,
                one.node,
                one.incarnation,
                one.event,
                {key: str(value) for key, value in one.fields.items()},
            )
            for one in self._logs
        ]
        self._logs.clear()
        counts = dict(self._counts)
        self._counts.clear()
        return News(messages, {goal.goal_id: goal.feedback_count for goal in self._goals}, logs, counts)

    async def close(self) -> None:
        await self._system.stop("the case is over")
