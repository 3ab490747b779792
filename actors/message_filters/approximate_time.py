"""`ApproximateTime`: puts messages together by the sets that lie closest, the algorithm of the C++ library.

Of every message that is part of a set, the set is the one of least duration around it: no messages of the future could make a closer one.
That is waited for, so a set comes out some messages after its last one came in, unless a lower bound of the time between the messages of an
input is given: then it comes as soon as no message that may still come could be nearer.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeAlias

from actors.message_filters.stamps import stamp_of_message
from actors.message_filters.synchronizer import Synchronizer

if TYPE_CHECKING:
    from actors.message_filters.simple_filter import SimpleFilter
    from actors.time.clock import Clock

Entry: TypeAlias = tuple[int, object]
"""A stamp in nanoseconds, and the message."""

AGE_PENALTY = 0.1
"""How much shorter a later set must be to be preferred, as a share, as in the C++ library."""


@dataclass(slots=True)
class _Input:
    """The messages of one input.

    Invariant: `past` holds, in order, what was taken off the front of `waiting` since the candidate was made; without one it is empty.
    """

    lower_bound: int
    waiting: deque[Entry] = field(default_factory=deque[Entry])
    past: list[Entry] = field(default_factory=list[Entry])
    has_dropped: bool = False

    def put_aside(self) -> None:
        self.past.append(self.waiting.popleft())

    def take_back(self, count: int | None = None) -> None:
        """Put the last `count` of `past`, or all, back to the front of `waiting`."""
        for _ in range(len(self.past) if count is None else count):
            self.waiting.appendleft(self.past.pop())


@dataclass(frozen=True, slots=True)
class _Candidate:
    """The best set so far that contains the pivot's message: no set of later messages could begin after `pivot_time`."""

    messages: tuple[Any, ...]
    start: int
    end: int
    pivot: int
    pivot_time: int


class ApproximateTime(Synchronizer):
    """Lets the sets of messages through that lie closest together in time: the adaptive algorithm of the C++ library.

    No message is used twice, sets come in order, and there is no slop to choose. A later set is preferred if it is shorter by more than
    `age_penalty`, a share. `lower_bounds` give, for some inputs by their numbers from 0, the least time between two messages, seconds, by
    which sets come sooner. Sets longer than `max_interval`, seconds, are not made.

    Messages without a header are refused with ``TypeError``, unless `allow_headerless` is a clock, such as ``self.clock``: then their time
    is that of their arrival.
    """

    def __init__(
        self,
        sources: Iterable[SimpleFilter[Any]],
        queue_size: int,
        *,
        age_penalty: float = AGE_PENALTY,
        lower_bounds: Mapping[int, float] | None = None,
        max_interval: float | None = None,
        allow_headerless: Clock | None = None,
    ) -> None:
        super().__init__(sources, queue_size)
        bounds = {index: round(bound * 1e9) for index, bound in (lower_bounds or {}).items()}
        if age_penalty < 0 or any(bound < 0 for bound in bounds.values()) or (max_interval or 0) < 0:
            raise ValueError("ApproximateTime: age_penalty, lower_bounds and max_interval are not negative")
        if not bounds.keys() <= set(range(self.inputs)):
            raise ValueError(f"ApproximateTime: lower_bounds are of the inputs 0 to {self.inputs - 1}, not {[*bounds]}")
        self._clock = allow_headerless
        self._age = 1 + age_penalty
        self._longest = None if max_interval is None else round(max_interval * 1e9)
        self._inputs = [_Input(bounds.get(index, 0)) for index in range(self.inputs)]
        self._candidate: _Candidate | None = None
        self.dropped = 0
        """The number of messages that left a full queue without a set."""
        self.closer_than_bound = 0
        """The number of messages that came out of order, or closer to the one before than the lower bound of their input."""

    def __repr__(self) -> str:
        waiting = ", ".join(str(len(each.waiting) + len(each.past)) for each in self._inputs)
        return f"<ApproximateTime of {self.inputs} inputs: {waiting} wait>"

    def add(self, message: object, index: int) -> None:
        """Take in a message of the input of this number, from 0."""
        stamp = stamp_of_message(message, self._clock)
        own = self._inputs[index]
        before = own.waiting[-1] if own.waiting else own.past[-1] if own.past else None
        if before is not None and stamp - before[0] < own.lower_bound:
            self.closer_than_bound += 1
        own.waiting.append((stamp, message))
        if len(own.waiting) == 1:
            self._search()
        if len(own.waiting) + len(own.past) > self._queue_size:
            for each in self._inputs:
                each.take_back()
            own.waiting.popleft()
            own.has_dropped = True
            self.dropped += 1
            if self._candidate is not None:  # it may contain what was dropped
                self._candidate = None
                self._search()

    def _search(self) -> None:
        """Let the sets through that are known to be best, as long as there is a message of each input."""
        while all(each.waiting for each in self._inputs):
            stamps = [each.waiting[0][0] for each in self._inputs]
            start, end = min(stamps), max(stamps)
            first, last = stamps.index(start), _last_index(stamps, end)
            for number, each in enumerate(self._inputs):
                # nothing that was dropped of the others could have been nearer than what there is: they may be pivots again
                each.has_dropped = each.has_dropped and number == last
            best = self._candidate
            if best is None:
                too_long = self._longest is not None and end - start > self._longest
                if too_long or self._inputs[last].has_dropped:
                    self._inputs[first].waiting.popleft()
                    continue
                best = self._make_candidate(start, end, pivot=last, pivot_time=end)
            elif self._aged(end - best.end) < start - best.start:
                best = self._make_candidate(start, end, best.pivot, best.pivot_time)
            self._inputs[first].put_aside()
            exhausted = first == best.pivot
            # every later set contains the time from the pivot's message to this end
            too_long_already = self._aged(end - best.end) >= best.pivot_time - best.start
            nothing_waits = not self._inputs[first].waiting
            if exhausted or too_long_already or (nothing_waits and self._is_best_whatever_comes(best)):
                self._publish(best)

    def _make_candidate(self, start: int, end: int, pivot: int, pivot_time: int) -> _Candidate:
        messages = tuple(each.waiting[0][1] for each in self._inputs)
        for each in self._inputs:
            each.past.clear()
        self._candidate = _Candidate(messages, start, end, pivot, pivot_time)
        return self._candidate

    def _publish(self, best: _Candidate) -> None:
        self._candidate = None
        for each in self._inputs:
            each.take_back()
            each.waiting.popleft()  # the one of the set
        self.signal_message(*best.messages)

    def _is_best_whatever_comes(self, best: _Candidate) -> bool:
        """Whether no set with messages that have not come could be better, if they come as early as they may."""
        moved = [0] * self.inputs
        while True:
            stamps = [self._earliest(each, best) for each in self._inputs]
            start, end = min(stamps), max(stamps)
            if self._aged(end - best.end) >= best.pivot_time - best.start:
                return True  # what was moved is taken back when the set is let through
            if self._aged(end - best.end) < start - best.start:
                for each, count in zip(self._inputs, moved, strict=True):
                    each.take_back(count)
                return False
            first = stamps.index(start)
            self._inputs[first].put_aside()
            moved[first] += 1

    def _earliest(self, each: _Input, best: _Candidate) -> int:
        """The stamp of an input's next message, or of the earliest that may come."""
        if each.waiting:
            return each.waiting[0][0]
        return max(each.past[-1][0] + each.lower_bound, best.pivot_time)

    def _aged(self, duration: int) -> int:
        return int(duration * self._age)


def _last_index(stamps: Sequence[int], stamp: int) -> int:
    return max(index for index, each in enumerate(stamps) if each == stamp)
