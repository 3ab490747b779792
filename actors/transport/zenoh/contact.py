"""The first contact with a publisher that keeps samples.

Zenoh's advanced subscriber asks for the history after it has been declared. A sample that arrives in between makes it believe that it has
got everything before, and the whole history is discarded. Therefore what comes first of a publisher waits here until the publisher has been
asked once more.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from actors.transport.sequence_numbers import SequenceNumbers
from actors.transport.zenoh import objects

Source = tuple[str, int]
"""A publisher: the session and the number of the entity within it."""

_KNOWN: Final = 1000
_MOST_HELD: Final = 10_000
"""So many samples wait at most, of all publishers together: what comes then is passed on without what is kept."""
_HALF: Final = 2**31
"""Sequence numbers have 32 bits, and start again at 0."""


class Contacts:
    """Passes on the samples of each publisher in the order of their sequence numbers, each once, none skipped that is kept.

    Invariant: a publisher is either unknown, or its samples wait in `_waiting` for the end of a question, or the numbers of its samples are
    in `_last`. Samples without a number are passed on as they come. The history of this session's own publishers, which answer although
    the subscriber is to hear only others, is not passed on.
    """

    def __init__(self, own: str, ask: Callable[[Source], None], deliver: Callable[[objects.Sample], None]) -> None:
        """`own` is this session; `ask` asks a publisher for its history, and `answered` and `complete` are called later."""
        self._own = own
        self._ask = ask
        self._deliver = deliver
        self._last: dict[Source, SequenceNumbers] = {}
        self._waiting: dict[Source, dict[int, objects.Sample]] = {}
        self._held = 0
        """How many samples are in `_waiting`."""

    def take(self, sample: objects.Sample) -> None:
        """Take a sample of the subscriber."""
        info = sample.source_info
        if info is None:
            if sample.timestamp is None or str(sample.timestamp.get_id()) != self._own:
                self._deliver(sample)
            return
        source: Source = str(info.source_id.zid), info.source_id.eid
        number: int = info.source_sn
        if source[0] == self._own:
            return
        if source in self._waiting:
            self._hold(source, number, sample)
        elif source in self._last or number == 0 or self._held >= _MOST_HELD:
            self._pass(source, number, sample)
        else:
            self._waiting[source] = {}
            self._hold(source, number, sample)
            self._ask(source)

    def answered(self, source: Source, reply: objects.Reply) -> None:
        """A kept sample of a publisher has arrived."""
        sample = reply.ok
        if source in self._waiting and sample is not None and sample.source_info is not None:
            self._hold(source, sample.source_info.source_sn, sample)

    def complete(self, source: Source) -> None:
        """The publisher has told what it keeps, or cannot be reached any more."""
        waiting = self._waiting.pop(source, {})
        self._held -= len(waiting)
        for number, sample in sorted(waiting.items()):
            self._pass(source, number, sample)

    def _hold(self, source: Source, number: int, sample: objects.Sample) -> None:
        waiting = self._waiting[source]
        self._held += number not in waiting
        waiting[number] = sample
        if self._held > _MOST_HELD:
            self.complete(source)

    def _pass(self, source: Source, number: int, sample: objects.Sample) -> None:
        numbers = self._last.pop(source, None) or SequenceNumbers()
        self._last[source] = numbers  # the last one heard of is the last one in the order of the dict
        if len(self._last) > _KNOWN:
            del self._last[next(iter(self._last))]
        if numbers.last is not None:
            number = numbers.last + (number + 1 - numbers.last + _HALF) % (2 * _HALF) - _HALF - 1
        if numbers.is_new(number + 1):  # Zenoh's begin with 0
            numbers.take(number + 1)
            self._deliver(sample)
