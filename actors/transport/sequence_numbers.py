"""`SequenceNumbers`: which messages of a publisher are new, and how many are missing, by the numbers that they carry."""

from __future__ import annotations

from typing import Final

_FAR: Final = 10_000
"""What is behind by more than so many is none of the messages that a publisher keeps and sends again."""
_MOST_LOST: Final = 10_000_000
"""A larger gap is no loss: at 1 kHz that is a silence of three hours."""


class SequenceNumbers:
    """The numbers of one publisher, in the order in which they arrive.

    They begin with 1. A message that arrives twice, or late, is not new. But numbers may be wrong: anybody who may publish can write any number under the name
    of another publisher. So what goes on below the highest number is new again, from the second message on, or from the first if it is far below.

    Invariant: all numbers from `_start` to `last` have been new, or were lost before `_start` was; `_before` are those of the run before.
    """

    __slots__ = ("_before", "_behind", "_start", "last")

    def __init__(self, last: int | None = None) -> None:
        self.last = last
        """The number of the newest message; None before the first."""
        self._start = self._behind = 0 if last is None else last
        self._before = 1, 0

    def is_new(self, number: int) -> bool:
        """Whether a message of this number is to be taken. It is called once for each."""
        return self.last is None or number > self.last or self._goes_on_below(number, self.last)

    def take(self, number: int) -> int:
        """Take a message that is new. Returns how many were lost before it."""
        last = self.last
        self.last = number
        if last is not None and number == last + 1:
            return 0
        if last is not None:
            self._before = self._start, last
        self._start = number
        return number - last - 1 if last is not None and 0 < number - last - 1 < _MOST_LOST else 0

    def _goes_on_below(self, number: int, last: int) -> bool:
        if number < 1 or self._start <= number or self._before[0] <= number <= self._before[1]:
            return False
        behind, self._behind = self._behind, number
        return number == behind + 1 or last - number > _FAR
