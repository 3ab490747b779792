"""The heartbeat of the loop: a process whose loop hangs is lost, although Zenoh's own threads keep its links."""

from __future__ import annotations

from asyncio import AbstractEventLoop, Handle
from collections.abc import Callable, Iterable
from typing import Final

PERIOD: Final = 0.5
SILENCE: Final = 2.0
"""Seconds from one beat to the next, and after which a process counts as lost."""


class Heartbeat:
    """Beats from the loop, and watches the beats of others. All methods are called on the loop's thread.

    Invariants: between `start` and `close` one timer is running; a process is reported silent only if this loop could have heard it.
    """

    def __init__(
        self,
        loop: AbstractEventLoop,
        beat: Callable[[], None],
        others: Callable[[], Iterable[str]],
        silent: Callable[[str], None],
        deaf: Callable[[], float],
    ) -> None:
        """`beat` is called every `PERIOD`, and tells what it has heard until then; `others` names the processes that have a heartbeat;
        `silent` is called for one without; `deaf` is the time of the loop's clock until which beats may have been held up."""
        self._loop = loop
        self._beat = beat
        self._others = others
        self._silent = silent
        self._deaf = deaf
        self._heard: dict[str, float] = {}
        self._due = loop.time()
        self._timer: Handle = loop.call_soon(self._tick)

    def heard(self, session: str, at: float) -> None:
        """Another process has beaten, at this time of the loop's clock."""
        self._heard[session] = at

    def close(self) -> None:
        """Neither beat nor watch any more."""
        self._timer.cancel()

    def _tick(self) -> None:
        now = self._loop.time()
        was_late = now - self._due > PERIOD
        self._due = now + PERIOD
        self._timer = self._loop.call_at(self._due, self._tick)  # first: what is called below may raise
        self._beat()
        others = tuple(self._others())
        # If this loop was late, the beats of the others are still waiting to be heard.
        deaf = now if was_late else self._deaf()
        self._heard = {session: max(deaf, self._heard.get(session, now)) for session in others}
        for session in others:
            if now - self._heard[session] > SILENCE:
                self._silent(session)
