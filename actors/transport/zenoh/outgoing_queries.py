"""Questions to others."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from functools import partial
from typing import Any, Final

from actors.transport.format.replies import TIMED_OUT
from actors.transport.keyed.protocol import Answer, Replied
from actors.transport.protocol import Failed, NoAnswer
from actors.transport.wakeup import Wakeup
from actors.transport.worker import Worker
from actors.transport.zenoh import objects
from actors.transport.zenoh.library import bare, import_zenoh, keep_thread_state

_FOREVER: Final = 1.8e16
"""Seconds; Zenoh knows no infinite time. It keeps some hundred bytes of every question until its time is over, also of those that have ended."""

_made: Final[Callable[[tuple[bytes, bytes]], Replied]] = partial(tuple.__new__, Replied)  # pyright: ignore[reportUnknownMemberType]
"""Makes a `Replied` in half the time that its class takes."""


class Prepared:
    """Zenoh's querier of a key, as `rmw_zenoh` declares one, until it is closed.

    Routers then say which servers of the key they know, and get no questions for others. Without it every question goes to each of them,
    the gossip point included.
    """

    def __init__(self, session: objects.Session, key: str) -> None:
        self._querier: objects.Declared | None = session.declare_querier(
            key, allowed_destination=import_zenoh().Locality.REMOTE
        )

    def close(self) -> None:
        """Withdraw it."""
        querier, self._querier = self._querier, None
        if querier is not None:
            querier.undeclare()


class Question:
    """One question, from being asked to its end.

    Invariants: `done` is called at most once, with the first of: an answer, the end of its time, the end of its servers; and not after
    `close`. `lingers` while Zenoh has not ended it although it has its answer. Zenoh's thread alone writes `_answered` and `_ended`.
    """

    def __init__(
        self,
        key: str,
        timeout: float | None,
        done: Callable[[Answer], None],
        over: Callable[[Question], None],
    ) -> None:
        """`over` is called with the question when it is over, however it ends, before `done`."""
        self.key = key
        self._done = done
        self._over = over
        self._open = True
        self._answered = False
        self._ended = False
        self._cancellation = import_zenoh().CancellationToken()
        self._timeout = _FOREVER if timeout is None else min(max(timeout, 0.0), _FOREVER)

    def ask(
        self,
        session: objects.Session,
        payload: bytes,
        attachment: bytes,
        wakeup: Wakeup,
        worker: Worker,
        unanswered: Callable[[Question], None],
    ) -> None:
        """Ask it. `unanswered` is called on the loop when all who were asked have ended without an answer; it calls `end`, soon."""
        self._post, self._unanswered = wakeup.post, unanswered
        handler = bare(self._on_reply, self._on_end)
        worker.do(partial(self._get, session, handler, payload, attachment))

    def _get(self, session: objects.Session, handler: Any, payload: bytes, attachment: bytes) -> None:
        library = import_zenoh()
        with suppress(library.ZError):  # the session has been closed; the end is told nevertheless
            session.get(
                self.key,
                handler,
                payload=payload,
                attachment=attachment,
                target=library.QueryTarget.ALL_COMPLETE,
                consolidation=library.ConsolidationMode.NONE,
                timeout=self._timeout,
                allowed_destination=library.Locality.REMOTE,
                cancellation_token=self._cancellation,
            )

    def _on_reply(self, reply: objects.Reply) -> None:
        keep_thread_state()
        self._answered = True
        self._post(self._replied, reply)

    def _on_end(self) -> None:
        keep_thread_state()
        self._ended = True
        if not self._answered:
            self._post(self._unanswered, self)

    def end(self, answer: Answer) -> None:
        """End it with an answer, unless it has ended."""
        if self._open:
            self.close()
            self._done(answer)

    @property
    def lingers(self) -> bool:
        """Whether Zenoh may still expect answers to it, after the first one: they are of no interest, and seldom come."""
        return self._answered and not self._ended

    def close(self) -> None:
        """Give it up: `done` is not called any more."""
        if self._open:
            self._open = False
            if not self._answered:
                self.cancel()
            self._over(self)

    def cancel(self) -> None:
        """Have Zenoh forget it."""
        self._cancellation.cancel()

    def _replied(self, reply: objects.Reply) -> None:
        if not self._open:
            return
        sample = reply.ok
        if sample is None:
            error: bytes = reply.err.payload.to_bytes()
            self.end(NoAnswer(timed_out=True) if error == TIMED_OUT else Failed(error))
            return
        attached = sample.attachment
        self.end(_made((sample.payload.to_bytes(), b"" if attached is None else attached.to_bytes())))
