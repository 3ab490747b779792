"""Why the robot must stand still: causes that come and go, and the stop that outlives them until somebody clears it."""

from __future__ import annotations

from dataclasses import dataclass


def how_to_go_on(then: str = "ask again") -> str:
    """What ends a stop whose causes have gone, in words: the service, its request, and what to do `then`."""
    return f"to go on, call /emergency_stop with data false, and {then}"


@dataclass(slots=True)
class Cause:
    """One reason of a stop."""

    text: str
    """In words, with the figures of when it began."""
    present: bool
    """Whether what caused it is still so."""
    latched: bool
    """Whether it outlives what caused it."""


class StopLatch:
    """The causes of the stop in force, by key, the oldest first. No causes, no stop.

    A latched cause stays when what caused it is gone, and only `clear` ends it; a cause that is not latched ends by itself.
    """

    __slots__ = ("_causes",)

    def __init__(self, kept: tuple[tuple[str, str], ...] = ()) -> None:
        self._causes = {key: Cause(text, present=False, latched=True) for key, text in kept}

    def __repr__(self) -> str:
        return f"<StopLatch {'; '.join(self.reasons) or 'clear'}>"

    @property
    def stopped(self) -> bool:
        return bool(self._causes)

    @property
    def reasons(self) -> tuple[str, ...]:
        """Why it is stopped, in words."""
        return tuple(cause.text for cause in self._causes.values())

    @property
    def present(self) -> tuple[str, ...]:
        """Those reasons whose cause is still there, so that they cannot be cleared."""
        return tuple(cause.text for cause in self._causes.values() if cause.present)

    @property
    def kept(self) -> tuple[tuple[str, str], ...]:
        """The latched causes, for a new latch after a restart, which finds out for itself whether they are still there."""
        return tuple((key, cause.text) for key, cause in self._causes.items() if cause.latched)

    def has(self, key: str) -> bool:
        return key in self._causes

    def begin(self, key: str, text: str, *, latched: bool = True) -> bool:
        """What `key` names is so; returns whether it is news. The words of the beginning are kept."""
        known = self._causes.get(key)
        if known is not None:
            known.present = True
            return False
        self._causes[key] = Cause(text, present=True, latched=latched)
        return True

    def end(self, key: str) -> bool:
        """What `key` names is no longer so; returns whether that ended the cause."""
        known = self._causes.get(key)
        if known is None:
            return False
        known.present = False
        if not known.latched:
            del self._causes[key]
        return not known.latched

    def clear(self) -> bool:
        """End every cause that is not present; returns whether the stop is over."""
        self._causes = {key: cause for key, cause in self._causes.items() if cause.present}
        return not self._causes
