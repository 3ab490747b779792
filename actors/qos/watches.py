"""Deadlines and leases of one endpoint: pure state machines that count what a lack of messages causes. Times are in nanoseconds."""

from __future__ import annotations


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
