"""QoS events as values, the statuses they are made from, and the watches that count what happens by silence.

A status is what one endpoint has met so far, in totals. An event is one kind of change between two statuses: the total now and how much
of it is new, so happenings between two looks come as one event. Names and fields: rmw, and the DDS statuses behind it. The watches are
pure state machines that are told the time in nanoseconds.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TypeAlias

import msgspec

__all__ = [
    "DeadlineMissed",
    "DeadlineWatch",
    "IncompatibleQoS",
    "IncompatibleType",
    "LeaseWatch",
    "LivelinessChanged",
    "LivelinessLost",
    "Matched",
    "MessageLost",
    "PublisherEvent",
    "PublisherStatus",
    "SubscriptionEvent",
    "SubscriptionStatus",
]

# -- events -----------------------------------------------------------------------------------------------------------------


class Matched(msgspec.Struct, frozen=True):
    """Peers have come or gone: how many were ever matched, and how many are now."""

    total_count: int
    total_count_change: int
    current_count: int
    current_count_change: int


class DeadlineMissed(msgspec.Struct, frozen=True):
    """A whole deadline has passed without a message: offered by a publisher, or requested by a subscription."""

    total_count: int
    total_count_change: int


class LivelinessLost(msgspec.Struct, frozen=True):
    """A publisher with liveliness manual_by_topic has neither published nor asserted itself for its lease."""

    total_count: int
    total_count_change: int


class LivelinessChanged(msgspec.Struct, frozen=True):
    """Among the publishers of a subscription the numbers of those that are alive and that are not have changed."""

    alive_count: int
    alive_count_change: int
    not_alive_count: int
    not_alive_count_change: int


class MessageLost(msgspec.Struct, frozen=True):
    """Messages were lost because the reader was slower than the depth of its subscription allows."""

    total_count: int
    total_count_change: int


class IncompatibleQoS(msgspec.Struct, frozen=True):
    """Peers were met whose quality of service does not fit; `last_policy_kind` says by which policy the last one failed."""

    total_count: int
    total_count_change: int
    last_policy_kind: str
    """RELIABILITY, DURABILITY, DEADLINE or LIVELINESS (also for its lease)."""


class IncompatibleType(msgspec.Struct, frozen=True):
    """Peers were met that use another message type under the same name."""

    total_count: int
    total_count_change: int


PublisherEvent: TypeAlias = Matched | DeadlineMissed | LivelinessLost | IncompatibleQoS | IncompatibleType
"""The events of `Publisher.events()`."""

SubscriptionEvent: TypeAlias = (
    Matched | DeadlineMissed | LivelinessChanged | MessageLost | IncompatibleQoS | IncompatibleType
)
"""The events of `Stream.events()` and of `Node.subscription(...).events()`."""

# -- statuses ---------------------------------------------------------------------------------------------------------------


class _Status(msgspec.Struct, frozen=True, kw_only=True):
    """The counts of both kinds of endpoint."""

    matched: int
    """Peers matched now."""
    matched_total: int
    """Peers that were ever matched."""
    deadline_missed: int = 0
    incompatible_qos: int = 0
    """Peers met whose quality of service does not fit."""
    last_policy_kind: str = "INVALID"
    """The policy by which the last of them failed."""
    incompatible_type: int = 0
    """Peers met that use another message type."""

    def _common(self, old: _Status) -> Iterator[Matched | DeadlineMissed | IncompatibleQoS | IncompatibleType]:
        if (self.matched, self.matched_total) != (old.matched, old.matched_total):
            total, current = self.matched_total, self.matched
            yield Matched(total, total - old.matched_total, current, current - old.matched)
        if (missed := self.deadline_missed) != old.deadline_missed:
            yield DeadlineMissed(missed, missed - old.deadline_missed)
        if (met := self.incompatible_qos) != old.incompatible_qos:
            yield IncompatibleQoS(met, met - old.incompatible_qos, self.last_policy_kind)
        if (met := self.incompatible_type) != old.incompatible_type:
            yield IncompatibleType(met, met - old.incompatible_type)


class PublisherStatus(_Status, frozen=True, kw_only=True):
    """The events of one publisher so far, in totals."""

    liveliness_lost: int = 0

    def since(self, old: PublisherStatus) -> Iterator[PublisherEvent]:
        """The changes since the status `old` of the same publisher, one event for each kind."""
        yield from self._common(old)
        if (lost := self.liveliness_lost) != old.liveliness_lost:
            yield LivelinessLost(lost, lost - old.liveliness_lost)


class SubscriptionStatus(_Status, frozen=True, kw_only=True):
    """The events of one subscription so far, in totals."""

    alive: int = 0
    """Matched publishers that are alive."""
    not_alive: int = 0
    """Matched publishers whose lease has run out."""
    message_lost: int = 0

    def since(self, old: SubscriptionStatus) -> Iterator[SubscriptionEvent]:
        """The changes since the status `old` of the same subscription, one event for each kind."""
        yield from self._common(old)
        if (self.alive, self.not_alive) != (old.alive, old.not_alive):
            yield LivelinessChanged(self.alive, self.alive - old.alive, self.not_alive, self.not_alive - old.not_alive)
        if (lost := self.message_lost) != old.message_lost:
            yield MessageLost(lost, lost - old.message_lost)


# -- watches ----------------------------------------------------------------------------------------------------------------


class DeadlineWatch:
    """Counts the deadlines that passed without a message, for one publisher or one subscription.

    Every whole period without a message is one miss; a message at the very end of its period is in time. Until `start` or the first
    `message` nothing is missed.
    """

    __slots__ = ("_since", "missed", "period_ns")

    def __init__(self, period_ns: int) -> None:
        if period_ns <= 0:
            raise ValueError(f"a deadline must be positive, not {period_ns} ns")
        self.period_ns = period_ns
        self.missed = 0
        """Misses accounted for so far."""
        self._since: int | None = None

    def start(self, now: int) -> None:
        """Count from now on, unless it counts already."""
        if self._since is None:
            self._since = now

    def message(self, now: int) -> None:
        """A message was published or arrived."""
        self.advance(now)
        self._since = now

    def advance(self, now: int) -> int:
        """Account for the periods that have passed; the number of misses so far."""
        if self._since is not None and now > self._since:
            periods = (now - self._since - 1) // self.period_ns
            self.missed += periods
            self._since += periods * self.period_ns
        return self.missed

    def due(self) -> int | None:
        """The first instant at which one more is missed if no message comes; None before the start."""
        return None if self._since is None else self._since + self.period_ns + 1


class LeaseWatch:
    """Whether one publisher shows that it lives: counts each time it has not for its lease. Being made counts as a sign of life."""

    __slots__ = ("alive", "asserted", "lease_ns", "lost")

    def __init__(self, lease_ns: int, now: int) -> None:
        if lease_ns <= 0:
            raise ValueError(f"a lease must be positive, not {lease_ns} ns")
        self.lease_ns = lease_ns
        self.alive = True
        self.lost = 0
        """Losses accounted for so far."""
        self.asserted = now
        """When it last showed that it lives."""

    def assert_alive(self, now: int) -> bool:
        """The publisher shows that it lives. Returns whether it had been lost."""
        was_lost = not self.advance(now)
        self.asserted = now
        self.alive = True
        return was_lost

    def advance(self, now: int) -> bool:
        """Let time pass; whether the publisher counts as alive now."""
        if self.alive and now - self.asserted > self.lease_ns:
            self.alive = False
            self.lost += 1
        return self.alive

    def due(self) -> int | None:
        """The first instant at which it is lost if nothing is asserted; None once it is."""
        return self.asserted + self.lease_ns + 1 if self.alive else None
