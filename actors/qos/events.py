"""QoS events and statuses as values, and the watches that count what a lack of messages causes.

A status holds the running totals of one endpoint. An event is a change of one kind between two statuses: the new total and the increase, so
that several changes between two reads give one event. Names and fields are those of rmw and of the DDS statuses behind it. Watches are pure
state machines that are given the time in nanoseconds.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TypeAlias

import msgspec

# -- events -----------------------------------------------------------------------------------------------------------------


class Matched(msgspec.Struct, frozen=True):
    """Peers were matched or have left: the number ever matched, and the number matched now."""

    total_count: int
    total_count_change: int
    current_count: int
    current_count_change: int


class DeadlineMissed(msgspec.Struct, frozen=True):
    """A whole deadline has passed without a message. A publisher offers a deadline, a subscription requests one."""

    total_count: int
    total_count_change: int


class LivelinessLost(msgspec.Struct, frozen=True):
    """A publisher with manual_by_topic liveliness has neither published nor asserted its liveliness within its lease."""

    total_count: int
    total_count_change: int


class LivelinessChanged(msgspec.Struct, frozen=True):
    """The numbers of a subscription's publishers that are alive and not alive have changed."""

    alive_count: int
    alive_count_change: int
    not_alive_count: int
    not_alive_count_change: int


class MessageLost(msgspec.Struct, frozen=True):
    """Messages were lost because the reader was slower than the depth of its subscription allows."""

    total_count: int
    total_count_change: int


class IncompatibleQoS(msgspec.Struct, frozen=True):
    """Peers with incompatible quality of service were found. `last_policy_kind` is the incompatible policy of the last one."""

    total_count: int
    total_count_change: int
    last_policy_kind: str
    """RELIABILITY, DURABILITY, DEADLINE or LIVELINESS (which includes its lease)."""


class IncompatibleType(msgspec.Struct, frozen=True):
    """Peers were found that use another message type for the same topic."""

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
    """The totals common to publishers and subscriptions."""

    matched: int
    """The number of peers matched now."""
    matched_total: int
    """The number of peers ever matched."""
    deadline_missed: int = 0
    incompatible_qos: int = 0
    """The number of peers found with incompatible quality of service."""
    last_policy_kind: str = "INVALID"
    """The incompatible policy of the last of them."""
    incompatible_type: int = 0
    """The number of peers found with another message type."""

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
    """The totals of one publisher."""

    liveliness_lost: int = 0

    def since(self, old: PublisherStatus) -> Iterator[PublisherEvent]:
        """Yield the changes since the status `old` of the same publisher, one event for each kind."""
        yield from self._common(old)
        if (lost := self.liveliness_lost) != old.liveliness_lost:
            yield LivelinessLost(lost, lost - old.liveliness_lost)


class SubscriptionStatus(_Status, frozen=True, kw_only=True):
    """The totals of one subscription."""

    alive: int = 0
    """The number of matched publishers that are alive."""
    not_alive: int = 0
    """The number of matched publishers whose lease has run out."""
    message_lost: int = 0

    def since(self, old: SubscriptionStatus) -> Iterator[SubscriptionEvent]:
        """Yield the changes since the status `old` of the same subscription, one event for each kind."""
        yield from self._common(old)
        if (self.alive, self.not_alive) != (old.alive, old.not_alive):
            yield LivelinessChanged(self.alive, self.alive - old.alive, self.not_alive, self.not_alive - old.not_alive)
        if (lost := self.message_lost) != old.message_lost:
            yield MessageLost(lost, lost - old.message_lost)


# -- watches ----------------------------------------------------------------------------------------------------------------


class DeadlineWatch:
    """Counts the deadlines that pass without a message, for one publisher or one subscription.

    Every whole period without a message is one miss; a message exactly at the end of its period is in time. Nothing is missed before
    `start` or the first `message`.
    """

    __slots__ = ("_since", "missed", "period_ns")

    def __init__(self, period_ns: int) -> None:
        if period_ns <= 0:
            raise ValueError(f"a deadline must be positive, not {period_ns} ns")
        self.period_ns = period_ns
        self.missed = 0
        """The number of misses counted so far."""
        self._since: int | None = None

    def start(self, now: int) -> None:
        """Start to count, unless started already."""
        if self._since is None:
            self._since = now

    def message(self, now: int) -> None:
        """Record that a message was published or received at `now`."""
        self.advance(now)
        self._since = now

    def advance(self, now: int) -> int:
        """Count the periods that have passed by `now`. Returns the number of misses so far."""
        if self._since is not None and now > self._since:
            periods = (now - self._since - 1) // self.period_ns
            self.missed += periods
            self._since += periods * self.period_ns
        return self.missed

    def due(self) -> int | None:
        """The first instant, in nanoseconds, of the next miss if no message comes; None before the start."""
        return None if self._since is None else self._since + self.period_ns + 1


class LeaseWatch:
    """Counts how often one publisher does not show that it is alive within its lease. Its creation counts as a sign of life."""

    __slots__ = ("alive", "asserted", "lease_ns", "lost")

    def __init__(self, lease_ns: int, now: int) -> None:
        if lease_ns <= 0:
            raise ValueError(f"a lease must be positive, not {lease_ns} ns")
        self.lease_ns = lease_ns
        self.alive = True
        self.lost = 0
        """The number of losses counted so far."""
        self.asserted = now
        """The time of the last sign of life, in nanoseconds."""

    def assert_alive(self, now: int) -> bool:
        """Record a sign of life. Returns whether the lease had run out before it."""
        was_lost = not self.advance(now)
        self.asserted = now
        self.alive = True
        return was_lost

    def advance(self, now: int) -> bool:
        """Count a loss if the lease has run out by `now`. Returns whether the publisher is alive."""
        if self.alive and now - self.asserted > self.lease_ns:
            self.alive = False
            self.lost += 1
        return self.alive

    def due(self) -> int | None:
        """The first instant, in nanoseconds, at which the lease runs out without a sign of life; None if it has."""
        return self.asserted + self.lease_ns + 1 if self.alive else None
