"""The motion of one frame in its parent: the transforms of the last seconds, in order of their stamps."""

from __future__ import annotations

from bisect import bisect_left, insort
from operator import itemgetter
from typing import TypeAlias

from robot.geometry.errors import Extrapolation
from robot.geometry.transform import Transform

__all__ = ["Track"]

Entry: TypeAlias = tuple[int, Transform]
_time = itemgetter(0)

SLACK = 256
"""So many outdated entries may wait before they are cut off together: cutting one by one would move the whole list each time."""


class Track:
    """The transforms of one child frame, kept for `keep` nanoseconds before the newest; a static one holds at any time."""

    __slots__ = ("_entries", "_keep", "child", "parent", "static")

    def __init__(self, parent: str, child: str, keep: int, *, static: bool) -> None:
        self.parent, self.child, self.static = parent, child, static
        self._keep = keep
        self._entries: list[Entry] = []

    def __repr__(self) -> str:
        kind = "static" if self.static else f"{len(self._entries)} transforms"
        return f"<{self.parent} -> {self.child}, {kind}>"

    @property
    def span(self) -> tuple[int, int]:
        """The first and the last instant that are known, ns. For a track that is not static."""
        newest = self._entries[-1][0]
        first = bisect_left(self._entries, newest - self._keep, key=_time)
        return self._entries[first][0], newest

    def add(self, at: int, transform: Transform) -> bool:
        """Keep it; a second one of the same instant replaces the first. False for one that is older than what is kept."""
        entries = self._entries
        if self.static:
            entries[:] = [(at, transform)]
        elif not entries or at > entries[-1][0]:
            entries.append((at, transform))
        elif at < entries[-1][0] - self._keep:
            return False
        else:
            place = bisect_left(entries, at, key=_time)
            if entries[place][0] == at:
                entries[place] = (at, transform)
            else:
                insort(entries, (at, transform), key=_time)
        self._forget()
        return True

    def at(self, at: int) -> Transform:
        """Where the child was at that instant, between two transforms by `Transform.towards`. Raises `Extrapolation`."""
        entries = self._entries
        if self.static:
            return entries[0][1]
        first, newest = self.span
        if not first <= at <= newest:
            side = "after the last" if at > newest else "before the first"
            gap = (at - newest if at > newest else first - at) * 1e-9
            raise Extrapolation(
                f"{self.parent} -> {self.child} at {at * 1e-9:.6f} s is {gap:.6f} s {side} known transform: "
                f"known are {first * 1e-9:.6f} to {newest * 1e-9:.6f} s",
                past=at < first,
            )
        place = bisect_left(entries, at, key=_time)
        after, there = entries[place]
        if after == at:
            return there
        before, here = entries[place - 1]
        return here.towards(there, (at - before) / (after - before))

    def _forget(self) -> None:
        entries = self._entries
        if self.static or len(entries) <= SLACK or entries[SLACK][0] >= entries[-1][0] - self._keep:
            return
        del entries[: bisect_left(entries, entries[-1][0] - self._keep, key=_time)]
