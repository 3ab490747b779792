"""Stubs for the others of a recording: the ends of topics and the servers that a replayed node is matched with."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable
from typing import Any

from actors.errors import CallTimeout
from actors.graph.graph import TopicEntry
from actors.interfaces.message import Message
from actors.qos.policies import QoS
from actors.topics.peers import PublisherPeer, Target


class StubNode:
    """A node of the recording that is not here."""

    def __init__(self, fqn: str) -> None:
        self.fqn = fqn

    def warn(self, event: str, **fields: object) -> None:
        """Do nothing: the recording has its log."""


class _StubEnd:
    """One end of a topic that belongs to a node that is not here."""

    here = False
    checks_qos = True

    def __init__(self, entry: TopicEntry, node: str, kind: type[Message], qos: QoS) -> None:
        self.entry = entry
        self.node = StubNode(node)
        self.type = kind
        self.qos = qos
        self.matched: dict[object, None] = {}

    def notify(self) -> None:
        """Do nothing: nobody waits for its events."""

    def count_incompatible_qos(self, policy: str) -> None:
        """Do nothing."""

    def count_incompatible_type(self) -> None:
        """Do nothing."""

    def join(self, peer: object, /) -> None:
        self.matched[peer] = None

    def part(self, peer: object, /) -> None:
        self.matched.pop(peer, None)

    def leave(self) -> tuple[object, ...]:
        peers, self.matched = tuple(self.matched), {}
        return peers


class StubPublisher(_StubEnd):
    """A publisher of the recording. What it keeps for late joiners is given to them by `catch_up(publisher, target)`."""

    arrival = None

    def __init__(
        self,
        number: int,
        entry: TopicEntry,
        node: str,
        kind: type[Message],
        qos: QoS,
        catch_up: Callable[[StubPublisher, Target], None],
    ) -> None:
        super().__init__(entry, node, kind, qos)
        self.number = number
        self.count = 0
        self.latched: list[object] = []
        self._catch_up = catch_up

    def sent(self, message: object) -> None:
        """Count a message that is about to be delivered."""
        self.count += 1
        if self.qos.transient_local:
            self.latched.append(message)
            del self.latched[: -self.qos.depth]

    def replay(self, target: Target, depth: int) -> None:
        self._catch_up(self, target)

    def alive(self, lease_ns: int | None) -> bool:
        return True

    def due_alive(self, lease_ns: int | None, now: int) -> int | None:
        return None

    def add_tap(self, tap: Callable[[Message], None]) -> None:
        """Do nothing: nobody taps a replay."""


class StubSubscription(_StubEnd):
    """A subscription of the recording. It takes every message, and does nothing with it."""

    received = dropped = waiting = 0
    full = False
    patience = 0.0

    async def room(self) -> None:
        """Return at once."""

    def count_lost(self, messages: int) -> None:
        """Do nothing."""

    def target(self, publisher: PublisherPeer) -> Target:
        return _ignore

    def catch_up(self, publisher: PublisherPeer) -> None:
        """Do nothing."""


class StubCall:
    """A call, or the request for a goal, to a server that is not here."""

    due = math.inf
    """The deadline, if the recording has no such call."""

    def __init__(self, server: StubServer) -> None:
        self.server = server
        self.future: asyncio.Future[Any] = asyncio.get_running_loop().create_future()

    @property
    def call_id(self) -> tuple[bytes, int]:
        return bytes(16), self.server.calls

    def late(self) -> CallTimeout:
        """The error after the deadline."""
        return CallTimeout("nobody answers in a replay: the recording has no such call")


class StubServer:
    """A server of a service or an action that is not here. `asked(call, timeout)` is told of what it is asked."""

    node = None
    active = 0

    def __init__(
        self, host: str, kind: type[object], concurrent: int, asked: Callable[[StubCall, float | None], None]
    ) -> None:
        self.host = host
        self.type = kind
        self.concurrent = concurrent
        self.calls = self.goals = 0
        self._asked = asked

    def open(self) -> tuple[StubCall, ...]:
        return ()

    def submit(self, *arguments: object) -> StubCall:
        """Take a request, ``(message, caller, timeout)``, or the request for a goal, ``(goal_id, message, client)``."""
        self.calls += 1
        call = StubCall(self)
        self._asked(call, arguments[2] if isinstance(arguments[2], (int, float)) else None)
        return call

    def cancel(self, goal_id: bytes, reason: str) -> asyncio.Future[bool]:
        return asyncio.get_running_loop().create_future()

    def unanswered(self, seconds: float) -> str:
        return f"{self.host} did not answer within {seconds:g} s"


class StubFollower:
    """The client of a goal that the replayed node serves."""

    def __init__(self, owner: str) -> None:
        self.owner = owner

    def on_status(self, status: object) -> None:
        """Do nothing."""

    def on_feedback(self, feedback: object) -> None:
        """Do nothing."""

    def on_result(self, outcome: object) -> None:
        """Do nothing."""


def _ignore(message: object) -> None:
    """Do nothing."""
