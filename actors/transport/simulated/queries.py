"""Questions between simulated processes: the one that asks, and the one that is asked."""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Callable

from actors.transport.keyed.protocol import Answer, Replied
from actors.transport.protocol import Failed, NoAnswer
from actors.transport.simulated.link import Stream


class Question:
    """A question that this process asks: the handle of `Transport.ask`.

    Invariants: `done` is called at most once, and not after `close`; `ended` exactly once. While it is open, somebody is left who could
    answer, or `done` is about to be called.
    """

    def __init__(
        self,
        loop: asyncio.AbstractEventLoop,
        asked: Counter[Stream],
        timeout: float | None,
        done: Callable[[Answer], None],
        ended: Callable[[Question], None],
    ) -> None:
        self._asked = asked
        """How many servers have not answered yet, by the stream on which their answers come."""
        self._done = done
        self._ended = ended
        self._open = True
        self._timer: asyncio.Handle | None = None
        if not asked:
            self._timer = loop.call_soon(self._finish, NoAnswer(timed_out=False))
        elif timeout is not None:
            self._timer = loop.call_later(timeout, self._finish, NoAnswer(timed_out=True))

    def receive(self, stream: Stream, answer: Replied | Failed | None) -> None:
        """One server has answered, or left it without an answer."""
        if answer is not None:
            self._finish(answer)
        else:
            self._asked[stream] -= 1
            self._end_if_nobody_is_left()

    def lose(self, stream: Stream) -> None:
        """The servers that answer on this stream are gone."""
        if stream in self._asked:
            del self._asked[stream]
            self._end_if_nobody_is_left()

    def _end_if_nobody_is_left(self) -> None:
        if not any(self._asked.values()):
            self._finish(NoAnswer(timed_out=False))

    def _finish(self, answer: Answer) -> None:
        if self._open:
            self.close()
            self._done(answer)

    def close(self) -> None:
        if self._open:
            self._open = False
            if self._timer is not None:
                self._timer.cancel()
            self._ended(self)


class IncomingQuestion:
    """A question that has arrived (`protocol.Query`). Invariant: `respond` is called at most once."""

    def __init__(self, payload: bytes, attachment: bytes, respond: Callable[[Replied | Failed | None], None]) -> None:
        self.payload = payload
        self.attachment = attachment
        self._respond = respond
        self._open = True

    def reply(self, payload: bytes, attachment: bytes) -> None:
        self._end(Replied(payload, attachment))

    def fail(self, payload: bytes) -> None:
        self._end(Failed(payload))

    def drop(self) -> None:
        self._end(None)

    def _end(self, answer: Replied | Failed | None) -> None:
        if self._open:
            self._open = False
            self._respond(answer)
