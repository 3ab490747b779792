"""The lease by which at most one machine runs a child at a time, however slow or broken the network between the machines is.

The agent asks for the lease (`Holding.ask`), the tree grants it (`Granting.grant`), and both count from instants on their own monotonic clocks. The
two clocks need not show the same time; they only have to run at the same rate, but for a share r.

Let a be when the agent asked for the last lease that it was granted, and o when the tree granted the last one that it was asked for, L the length of
the lease, and s the share of it after which an agent steps down, all as true instants and durations.

1. The agent counts from the instant at which it asked, so what it runs has ended at ``a + s L (1 + r) + k``, where k is how long a kill takes.
2. The tree counts from the instant at which it granted, so it acts no earlier than ``o + L (1 - r)``.
3. The last lease that the agent was granted was granted by the tree at or before o, and was asked for before it was granted: ``a <= o``.

So the old incarnation has ended before the new one begins if ``s L (1 + r) + k < L (1 - r)``, which is ``k < L (1 - s - r (1 + s))``. No delay of a
message stands in it. With s = 0.75, L = 3 s and clocks that differ by a thousandth, k may be 0.74 s: a quartz is 20 times as good, and a kill takes
milliseconds. On the other side, an agent that is reached all the time asks every ``L / 8``, so it steps down no sooner than after 0.62 L of silence.

An agent that cannot act in time, because it hangs, is killed by an alarm that the kernel keeps (`tls`), and the processes that it has launched are
killed by the kernel when it ends, however it ends. On a machine that stands still as a whole nothing acts; if it goes on later, monotonic clocks
may not have counted that time: that is what `Node.fencing_token` is for.
"""

from __future__ import annotations

from typing import Final

LEASE_SECONDS: Final = 3.0
"""The length of a lease, unless said otherwise, seconds."""
STEP_DOWN: Final = 0.75
"""The share of a lease after which an agent that was not granted another one ends what it runs."""
ASKING: Final = 0.125
"""The share of a lease after which an agent asks for the next one."""


class Holding:
    """The agent's side of the lease of one tree. Times are those of the agent's clock, seconds.

    Invariants: `until` never goes back. An answer counts from the instant of its question, and only the questions since the newest answer are kept.
    """

    def __init__(self, seconds: float) -> None:
        self.seconds = seconds
        self.until = 0.0
        """When to step down; 0 before the first lease."""
        self._asked: dict[int, float] = {}
        self._number = 0

    def left(self, now: float) -> float:
        """For how many seconds the lease still lasts; 0 if it is over, or there was none."""
        return max(0.0, self.until - now)

    def ask(self, now: float) -> int:
        """The number of the next question, which is asked now."""
        self._number += 1
        self._asked[self._number] = now
        return self._number

    def granted(self, number: int) -> None:
        """The question of this number was answered."""
        self.until = max(self.until, self._asked[number] + STEP_DOWN * self.seconds)
        for older in [one for one in self._asked if one <= number]:
            del self._asked[older]


class Granting:
    """The tree's side of the lease of one agent. Times are those of the tree's clock, seconds.

    Invariant: until `until` the agent may run what it was given. `until` never goes back.
    """

    def __init__(self, seconds: float) -> None:
        self.seconds = seconds
        self.until = 0.0
        """When nothing runs there any more; 0 before the first lease."""
        self._left = 0.0

    def grant(self, now: float, left: float) -> None:
        """The lease is granted now. When the agent asked for it, it had so many seconds left of the last one."""
        self.until, self._left = now + self.seconds, left

    def fresh(self, now: float) -> bool:
        """Whether each side has heard the other lately, so that the agent is not about to step down."""
        return now < self.until - self.seconds / 2 and self._left > self.seconds / 4
