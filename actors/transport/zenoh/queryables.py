"""Questions that others ask."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from functools import partial

from actors.transport.keyed.protocol import Query
from actors.transport.wakeup import Wakeup
from actors.transport.worker import Worker
from actors.transport.zenoh import objects
from actors.transport.zenoh.library import direct, import_zenoh


class _Query:
    """One of them. Zenoh waits for a slow asker when it sends the answer; therefore the worker sends it.

    Invariant: it is ended once, by the first call of `reply`, `fail` or `drop`.
    """

    def __init__(self, key: str, query: objects.Query, worker: Worker) -> None:
        payload, attachment = query.payload, query.attachment
        self._key = key
        self._query = query
        self._worker = worker
        self._ended = False
        self.payload = b"" if payload is None else payload.to_bytes()
        self.attachment = b"" if attachment is None else attachment.to_bytes()

    def reply(self, payload: bytes, attachment: bytes) -> None:
        """Answer it."""
        self._end(partial(self._query.reply, self._key, payload, attachment=attachment))

    def fail(self, payload: bytes) -> None:
        """Answer it with an error."""
        self._end(partial(self._query.reply_err, payload))

    def drop(self) -> None:
        """Leave it without an answer."""
        self._end(None)

    def _end(self, answer: Callable[[], object] | None) -> None:
        if not self._ended:
            self._ended = True
            self._worker.do(partial(self._send, answer))

    def _send(self, answer: Callable[[], object] | None) -> None:
        if answer is not None:
            with suppress(import_zenoh().ZError):  # who asked has gone, or the session has been closed
                answer()
        self._query.drop()


class Server:
    """What is served under one key. Invariant: after `close`, `take` is not called, and what it was not called with is dropped."""

    def __init__(
        self,
        session: objects.Session,
        key: str,
        take: Callable[[Query], None],
        wakeup: Wakeup,
        worker: Worker,
        forget: Callable[[Server], None],
    ) -> None:
        """`forget` is called when it is closed."""
        library = import_zenoh()
        self._key = key
        self._take = take
        self._worker = worker
        self._forget = forget
        self._closed = False
        self._queryable = session.declare_queryable(
            key,
            direct(lambda query: wakeup.post(self._asked, query)),
            complete=True,
            allowed_origin=library.Locality.REMOTE,
        )

    def close(self) -> None:
        """Serve no more questions. Those that have been taken remain to be ended."""
        if not self._closed:
            self._closed = True
            self._queryable.undeclare()
            self._forget(self)

    def _asked(self, query: objects.Query) -> None:
        if self._closed:
            query.drop()
        else:
            self._take(_Query(self._key, query, self._worker))
