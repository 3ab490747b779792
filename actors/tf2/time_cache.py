"""The transforms of one frame to its parent over time."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from typing import TypeAlias

from actors.tf2.errors import (
    BackwardExtrapolationException,
    ForwardExtrapolationException,
    NoDataForExtrapolationException,
)
from actors.tf2.transform import Transform

Step: TypeAlias = tuple[str, Transform]
"""A parent frame, and what takes points of the child to it."""


class TimeCache:
    """The transforms of one child frame over the last `keep` nanoseconds; of a static one the last, which holds at any time.

    Invariants:

    - The instants are in ascending order; transforms of one instant are in the order in which they came.
    - The newest instant is at most `keep` after the oldest.
    """

    __slots__ = ("_instants", "_keep", "_steps", "authority", "child", "static")

    def __init__(self, child: str, keep: int, *, static: bool) -> None:
        self.child, self.static = child, static
        self.authority = ""
        self._keep = keep
        self._instants: list[int] = []
        self._steps: list[Step] = []

    def __len__(self) -> int:
        return len(self._steps)

    @property
    def parent(self) -> str | None:
        """The parent in the newest transform; None without one."""
        return self._steps[-1][0] if self._steps else None

    @property
    def span(self) -> tuple[int, int]:
        """The oldest and the newest instant, ns; (0, 0) of a static one, and without transforms."""
        instants = self._instants
        return (instants[0], instants[-1]) if instants and not self.static else (0, 0)

    def add(self, instant: int, parent: str, transform: Transform, authority: str) -> bool:
        """Take in a transform. Returns False, and does nothing, if it is older than what is kept."""
        instants, steps, step = self._instants, self._steps, (parent, transform)
        if self.static:
            instants[:], steps[:] = [instant], [step]
        elif not instants or instant > instants[-1]:
            instants.append(instant)
            steps.append(step)
            self._forget(instant - self._keep)
        elif instant < instants[-1] - self._keep:
            return False
        else:
            place = bisect_right(instants, instant)
            if step not in steps[bisect_left(instants, instant) : place]:
                instants.insert(place, instant)
                steps.insert(place, step)
        self.authority = authority
        return True

    def at(self, instant: int) -> Step:
        """The parent and the transform at an instant, interpolated between two of one parent; the newest for 0.

        Between two transforms to different parents the earlier one holds. Raises an `ExtrapolationException`.
        """
        instants, steps = self._instants, self._steps
        if not steps or not (self.static or not instant or instants[0] <= instant <= instants[-1]):
            raise self._unknown(instant)
        if self.static or not instant or instant == instants[-1]:
            return steps[-1]
        if instant == instants[0]:
            return steps[0]
        place = bisect_right(instants, instant)
        parent, here = steps[place - 1]
        before = instants[place - 1]
        above, there = steps[place]
        if before == instant or above != parent:
            return parent, here
        return parent, here.towards(there, (instant - before) / (instants[place] - before))

    def clear(self) -> None:
        """Forget everything, except that a static transform stays."""
        if not self.static:
            self._instants.clear()
            self._steps.clear()

    def _forget(self, before: int) -> None:
        if self._instants[0] < before:
            outdated = bisect_left(self._instants, before)
            del self._instants[:outdated], self._steps[:outdated]

    def _unknown(
        self, instant: int
    ) -> BackwardExtrapolationException | ForwardExtrapolationException | NoDataForExtrapolationException:
        if not self._steps:
            return NoDataForExtrapolationException(
                f"{self.child} has no transforms any more: the buffer was cleared, and none has come since"
            )
        oldest, newest = self.span
        asked = f"{self.parent} -> {self.child} at {seconds(instant)} s is"
        side = (
            f"{seconds(instant - newest)} s after the last"
            if instant > newest
            else f"{seconds(oldest - instant)} s before the first"
        )
        if len(self) == 1:
            return NoDataForExtrapolationException(
                f"{asked} {side} known transform: known is that of {seconds(newest)} s alone", past=instant < oldest
            )
        text = f"{asked} {side} known transform: known are {seconds(oldest)} to {seconds(newest)} s"
        return ForwardExtrapolationException(text) if instant > newest else BackwardExtrapolationException(text)


def seconds(nanoseconds: int) -> str:
    """Nanoseconds as seconds for a text, exact to the microsecond."""
    return f"{nanoseconds * 1e-9:.6f}"
