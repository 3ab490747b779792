"""What comes from other processes and cannot be read: counted, and reported once for each place where it comes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

_PLACES: Final = 1000
"""So many places are remembered; what comes at others is only counted, so that a stranger can fill neither the memory nor the log."""


class Unreadable:
    """Counts for one system.

    Invariants: `count` is the number of all `note`s, and never falls; for each kind of data and place there is at most one line in the log.
    """

    def __init__(self, warn: Callable[..., Any]) -> None:
        """`warn` writes a line to the log of the system."""
        self._warn = warn
        self._reported: set[tuple[str, str]] = set()
        self.count = 0

    def note(
        self, what: str, place: str, error: Exception, *, warn: Callable[..., Any] | None = None, **fields: object
    ) -> None:
        """Something has come. `what` is the line for the log, and `place` the topic or service where it has come; `warn` writes it."""
        self.count += 1
        if (what, place) not in self._reported and len(self._reported) < _PLACES:
            self._reported.add((what, place))
            (warn or self._warn)(what, **fields, because=str(error), next="further ones are counted only")
