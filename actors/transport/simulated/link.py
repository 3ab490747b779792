"""Simulated links: how messages get from one host to another, and from one process to another over several hosts."""

from __future__ import annotations

import asyncio
import math
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable
from copy import copy
from dataclasses import dataclass
from heapq import heapify, heappop, heappush
from random import Random
from typing import Protocol


@dataclass(frozen=True, slots=True)
class Conditions:
    """The state of a link in one direction. Raises ValueError for values that no link has.

    Loss, duplication and reordering are probabilities, drawn for each message. They hit messages sent with best effort as they are; a
    reliable message is sent again until it has arrived, in its order and once, so that it is only late, and those behind it as well.
    """

    delay: float = 0.0005
    """Seconds that each message travels, more than 0."""

    jitter: float = 0.0
    """Seconds that a message may travel longer, drawn evenly from 0 to this. It does not overtake others by it."""

    bandwidth: float = math.inf
    """Bytes a second. What comes faster waits in a queue."""

    loss: float = 0.0
    """The share of messages that are lost, less than 1. A link that passes nothing is cut (`Network.cut`)."""

    duplication: float = 0.0
    """The share of messages that arrive twice."""

    reordering: float = 0.0
    """The share of messages that take twice as long, so that later ones may overtake them."""

    resend: float = 0.2
    """Seconds after which a reliable message that was lost is sent again."""

    def __post_init__(self) -> None:
        if not 0.0 < self.delay < math.inf:
            raise ValueError(f"{self}: the delay must be a finite number of seconds above 0")
        if not self.bandwidth > 0.0:
            raise ValueError(f"{self}: the bandwidth must be above 0 bytes a second")
        for name in ("jitter", "resend"):
            if not 0.0 <= getattr(self, name) < math.inf:
                raise ValueError(f"{self}: {name} must be a finite number of seconds, 0 or more")
        for name in ("loss", "duplication", "reordering"):
            if not 0.0 <= getattr(self, name) < 1.0:
                raise ValueError(f"{self}: {name} must be a share of 0 or more and less than 1")


LAN = Conditions()
"""A good wire between two machines."""

LOOPBACK = Conditions(delay=0.00005)
"""Between two processes of one machine."""


class Arriving(Protocol):
    """Something that is on its way."""

    def arrive(self) -> None: ...


class Arrivals:
    """All messages on their way in one network.

    Invariants: `arrive` is called from the loop only, in the order of the times, and in the order of `add` for equal times; never before
    its time. While anything is on its way, one timer of the loop is armed for the first of it, and no other.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self._loop = loop
        self._heap: list[tuple[float, int, Arriving]] = []
        self._order = 0
        self._armed = math.inf
        self._timer: asyncio.TimerHandle | None = None

    def add(self, at: float, message: Arriving) -> None:
        """Let it arrive at the loop's time `at`."""
        self._order = order = self._order + 1
        heappush(self._heap, (at, order, message))
        if at < self._armed:
            if self._timer is not None:
                self._timer.cancel()
            self._arm(at)

    def _arm(self, at: float) -> None:
        self._armed = at
        self._timer = self._loop.call_at(at, self._fire)

    def _fire(self) -> None:
        heap = self._heap
        now = max(self._armed, self._loop.time())  # a loop may fire a timer a little early, within its resolution
        self._armed, self._timer = now, None  # what is added meanwhile is not earlier: nothing is armed until the end
        try:
            while heap and heap[0][0] <= now:
                heappop(heap)[2].arrive()
        finally:  # an error of a callback goes to the loop, and the rest still arrives
            self._armed = math.inf
            if heap:
                self._arm(heap[0][0])


HEADER = 64
"""Bytes that each message takes beside its content."""


class Stream:
    """What one process sends to another while they are connected.

    Invariants: reliable messages arrive at the end of each link in the order in which they were sent on it; so do those sent with best
    effort, but for the reordered ones; neither waits for the other. Nothing arrives any more once `open` is false.
    """

    __slots__ = (
        "best_effort_until",
        "broken",
        "displaced",
        "late",
        "open",
        "received",
        "reliable_until",
        "route",
        "sent",
    )

    def __init__(self, route: tuple[Link, ...]) -> None:
        self.route = route
        self.reliable_until = [0.0] * len(route)
        """For each link, when the latest of the reliable messages arrives at its end."""
        self.best_effort_until = [0.0] * len(route)
        """The same of those sent with best effort, but for the reordered ones."""
        self.open = True
        self.broken = False
        """Whether nothing passes from one link to the next any more, because the router between them is gone."""
        self.sent = self.received = 0
        """Bytes, of content."""
        self.displaced = 0
        """Samples that newer ones have displaced in a queue."""
        self.late = 0
        """Samples that came again, or after a later one."""

    def send(self, message: Message) -> None:
        self.sent += message.size
        self.route[0].send(message)

    @property
    def delay(self) -> float:
        """Seconds that a short message takes at least."""
        return sum(link.conditions.delay for link in self.route)

    @property
    def is_cut(self) -> bool:
        return any(link.is_cut for link in self.route)


class Flow:
    """The samples of one outlet in one stream: at most `depth` of them wait before a link (0: any number), the newest ones."""

    __slots__ = ("depth", "stream")

    def __init__(self, stream: Stream, depth: int) -> None:
        self.stream = stream
        self.depth = depth


class Message(ABC):
    """Something that is sent in a stream, whole."""

    __slots__ = ("dropped", "flow", "hop", "priority", "reliable", "size", "stream")

    def __init__(
        self, stream: Stream, size: int, priority: int, reliable: bool = True, flow: Flow | None = None
    ) -> None:
        self.stream = stream
        self.size = size
        self.priority = priority
        self.reliable = reliable
        self.flow = flow
        self.hop = 0
        """The links that it has passed."""
        self.dropped = False
        """Whether it has lost its place in the queue of a link to newer ones."""

    @abstractmethod
    def deliver(self) -> None:
        """What happens when it has arrived at its process."""

    def arrive(self) -> None:
        """It has come to the end of a link."""
        stream = self.stream
        self.hop += 1
        if self.hop < len(stream.route):
            if not stream.broken:
                stream.route[self.hop].send(self)
        elif stream.open:
            stream.received += self.size
            self.deliver()


class Call(Message):
    """Something that happens at the end of the stream; always reliable."""

    __slots__ = ("_act",)

    def __init__(self, stream: Stream, size: int, priority: int, act: Callable[[], None]) -> None:
        super().__init__(stream, size, priority)
        self._act = act

    def deliver(self) -> None:
        self._act()


class Link:
    """The way from one host to another, in one direction.

    Invariants: of what waits, the lowest priority leaves first, then the oldest; nothing waits on a link with time to send it that is not
    cut. While the link is cut, best effort is lost and reliable messages wait. Everything random comes from `rng`.
    """

    def __init__(
        self, conditions: Conditions, rng: Random, arrivals: Arrivals, loop: asyncio.AbstractEventLoop
    ) -> None:
        self.conditions = conditions
        self.usual = conditions
        """The conditions when nothing is wrong."""
        self.is_cut = False
        self._cuts: set[str] = set()
        """Why it is cut: ``""`` for `Network.cut`, or the name of a host that stands still."""
        self.lost = 0
        """Messages that were lost on the way and not sent again."""
        self._rng = rng
        self._arrivals = arrivals
        self._loop = loop
        self._queue: list[tuple[int, int, Message]] = []
        self._order = 0
        self._waiting: dict[Flow, deque[Message]] = {}
        self._free_at = 0.0
        self._timer: asyncio.TimerHandle | None = None

    def send(self, message: Message) -> None:
        """Send it as soon as it is its turn."""
        if self.is_cut and not message.reliable:
            self.lost += 1
        elif self.is_cut or self._queue or self._free_at > self._loop.time():
            self._hold(message)
        else:
            self._transmit(message, self._loop.time())

    def cut(self, why: str = "") -> None:
        """Let nothing pass until every `why` is healed. What is on its way arrives."""
        self._cuts.add(why)
        self.is_cut = True
        waiting = [entry for entry in self._queue if not entry[2].dropped]
        kept = [entry for entry in waiting if entry[2].reliable]
        self.lost += len(waiting) - len(kept)
        self._refill(kept)

    def heal(self, why: str = "") -> None:
        """Let messages pass again: those that wait, when they are sent again the next time."""
        if not self.is_cut:
            return
        self._cuts.discard(why)
        self.is_cut = bool(self._cuts)
        if self._queue and not self.is_cut:
            self._resume(self._loop.time() + self._rng.random() * self.conditions.resend)

    def clear(self) -> None:
        """Forget what waits: its host has died."""
        self._refill([])

    # The queue -----------------------------------------------------------------------------------------------------------

    def _hold(self, message: Message) -> None:
        self._order += 1
        entry = (message.priority, self._order, message)
        heappush(self._queue, entry)
        flow = message.flow
        if flow is not None and flow.depth:
            waiting = self._waiting.setdefault(flow, deque())
            waiting.append(message)
            if len(waiting) > flow.depth:
                waiting.popleft().dropped = True
                message.stream.displaced += 1
        if not self.is_cut:
            self._resume(self._free_at)

    def _refill(self, entries: list[tuple[int, int, Message]]) -> None:
        self._queue = entries
        heapify(entries)
        self._waiting = {}
        for entry in sorted(entries):
            if (flow := entry[2].flow) is not None and flow.depth:
                self._waiting.setdefault(flow, deque()).append(entry[2])

    def _resume(self, at: float) -> None:
        if self._timer is None:
            self._timer = self._loop.call_at(at, self._send_waiting)

    def _send_waiting(self) -> None:
        self._timer = None
        while self._queue and not self.is_cut:
            if self._free_at > (now := self._loop.time()):
                self._resume(self._free_at)
                return
            message = heappop(self._queue)[2]
            if message.dropped:
                continue
            if (flow := message.flow) is not None and flow.depth:
                waiting = self._waiting[flow]
                waiting.popleft()
                if not waiting:
                    del self._waiting[flow]
            self._transmit(message, now)

    # The line ------------------------------------------------------------------------------------------------------------

    def _transmit(self, message: Message, now: float) -> None:
        conditions = self.conditions
        if conditions.bandwidth < math.inf:
            self._free_at = now = now + (message.size + HEADER) / conditions.bandwidth
        at = now + conditions.delay
        if conditions.jitter:
            at += self._rng.random() * conditions.jitter
        if message.reliable:
            if conditions.loss:
                while self._rng.random() < conditions.loss:
                    at += conditions.resend
            self._arrivals.add(_in_order(message.stream.reliable_until, message.hop, at), message)
        elif conditions.loss and self._rng.random() < conditions.loss:
            self.lost += 1
        else:
            if conditions.reordering and self._rng.random() < conditions.reordering:
                at += at - now
            else:
                at = _in_order(message.stream.best_effort_until, message.hop, at)
            if conditions.duplication and self._rng.random() < conditions.duplication:
                self._arrivals.add(at + self._rng.random() * (at - now), copy(message))
            self._arrivals.add(at, message)


def _in_order(until: list[float], hop: int, at: float) -> float:
    """When what would arrive at a time arrives, not before the latest one; it is the latest then."""
    latest = until[hop]
    if at < latest:
        return latest
    until[hop] = at
    return at
