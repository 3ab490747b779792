"""Counters behind the QoS events: matched, deadline missed, liveliness lost and changed.

Pure state machines told the time in nanoseconds. Every counter has a ``take``, which answers the totals and what
changed since it was taken before; happenings between two takes are coalesced. Rules: rmw, and the DDS statuses behind it.
"""

from collections.abc import Hashable
from typing import NamedTuple

__all__ = [
    "CountStatus",
    "DeadlineWatch",
    "LivelinessStatus",
    "LivelinessWatch",
    "LostWatch",
    "MatchedCount",
    "MatchedStatus",
]


class CountStatus(NamedTuple):
    """How often something happened, in all and since the last take."""

    total_count: int
    total_count_change: int


class MatchedStatus(NamedTuple):
    """How many peers were ever matched and are matched now, with the changes since the last take."""

    total_count: int
    total_count_change: int
    current_count: int
    current_count_change: int


class LivelinessStatus(NamedTuple):
    """How many matched publishers are alive and not alive, with the changes since the last take."""

    alive_count: int
    alive_count_change: int
    not_alive_count: int
    not_alive_count_change: int


class MatchedCount:
    """Counts the peers of one endpoint as they come and go."""

    __slots__ = ("_taken", "current", "total")

    def __init__(self) -> None:
        self.total = 0
        self.current = 0
        self._taken = (0, 0)

    def joined(self) -> None:
        """A peer was matched."""
        self.total += 1
        self.current += 1

    def left(self) -> None:
        """A matched peer has gone."""
        self.current -= 1

    def take(self) -> MatchedStatus:
        """The counts now."""
        total, current = self._taken
        self._taken = (self.total, self.current)
        return MatchedStatus(self.total, self.total - total, self.current, self.current - current)


class DeadlineWatch:
    """Counts the deadlines that passed without a message, for one publisher or one subscription.

    Each full period without a message is one miss. A publisher's watch is started when it is made, a subscription's
    when it is matched; until ``start`` or the first ``message`` nothing is missed.
    """

    __slots__ = ("_missed", "_since", "_taken", "period_ns")

    def __init__(self, period_ns: int) -> None:
        if period_ns <= 0:
            raise ValueError(f"a deadline must be positive, not {period_ns} ns")
        self.period_ns = period_ns
        self._since: int | None = None
        self._missed = 0
        self._taken = 0

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
            periods = (now - self._since) // self.period_ns
            self._missed += periods
            self._since += periods * self.period_ns
        return self._missed

    def due(self) -> int | None:
        """When the next miss happens if no message comes; None before the start."""
        return None if self._since is None else self._since + self.period_ns

    def take(self, now: int) -> CountStatus:
        """The misses up to now."""
        total = self.advance(now)
        status = CountStatus(total, total - self._taken)
        self._taken = total
        return status


class LostWatch:
    """Whether one publisher keeps its promise to show that it lives: counts each time its lease runs out.

    With automatic liveliness every activity of its process asserts it; with manual_by_topic only its own messages and
    explicit assertions do. The caller decides which to report.
    """

    __slots__ = ("_asserted", "_taken", "alive", "lease_ns", "lost")

    def __init__(self, lease_ns: int, now: int) -> None:
        if lease_ns <= 0:
            raise ValueError(f"a lease must be positive, not {lease_ns} ns")
        self.lease_ns = lease_ns
        self.alive = True
        self.lost = 0
        self._asserted = now
        self._taken = 0

    def assert_alive(self, now: int) -> None:
        """The publisher showed that it lives."""
        self.advance(now)
        self._asserted = now
        self.alive = True

    def advance(self, now: int) -> bool:
        """Let time pass; whether the publisher counts as alive now."""
        if self.alive and now - self._asserted >= self.lease_ns:
            self.alive = False
            self.lost += 1
        return self.alive

    def due(self) -> int | None:
        """When the lease runs out if nothing is asserted; None once it has."""
        return self._asserted + self.lease_ns if self.alive else None

    def take(self, now: int) -> CountStatus:
        """The losses up to now."""
        self.advance(now)
        status = CountStatus(self.lost, self.lost - self._taken)
        self._taken = self.lost
        return status


class LivelinessWatch:
    """What one subscription knows of the liveliness of its publishers, by a key of the caller's choice.

    ``lease_ns`` is the subscription's own lease, None for endless. A publisher counts as alive from its first message
    or assertion on; one that leaves counts no more.
    """

    __slots__ = ("_publishers", "_taken", "lease_ns")

    def __init__(self, lease_ns: int | None) -> None:
        self.lease_ns = lease_ns
        self._publishers: dict[Hashable, LostWatch | None] = {}
        self._taken = (0, 0)

    def assert_alive(self, publisher: Hashable, now: int) -> None:
        """A publisher showed that it lives."""
        known = self._publishers.get(publisher)
        if known is not None:
            known.assert_alive(now)
        else:
            self._publishers[publisher] = None if self.lease_ns is None else LostWatch(self.lease_ns, now)

    def left(self, publisher: Hashable) -> None:
        """A publisher has gone, in order or not."""
        self._publishers.pop(publisher, None)

    def take(self, now: int) -> LivelinessStatus:
        """The counts now."""
        alive = sum(watch is None or watch.advance(now) for watch in self._publishers.values())
        lost = len(self._publishers) - alive
        old_alive, old_lost = self._taken
        self._taken = (alive, lost)
        return LivelinessStatus(alive, alive - old_alive, lost, lost - old_lost)
