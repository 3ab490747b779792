"""`Fence`: refuses commands of a life that has been replaced."""

from __future__ import annotations

from math import inf
from typing import Final

FORSAKEN: Final = 5.0
"""Seconds of silence after which the newest life may have been none: its robot has long sat down."""
STEADY: Final = 1.0
"""Seconds for which another must have commanded without a break then: what has been late for long comes all at once."""
BREAK: Final = 0.05
"""s."""


class Fence:
    """What a command must pass: it counts if its token (`Node.fencing_token`) is that of the newest life heard so far, or of a newer one.

    Invariant: while commands of the newest life come, or have come lately, `newest` does not go back, and a command may be as late as it likes. Only
    when that life has been silent for long, and another commands steadily, is it forsaken: a single forged token locks out nobody for good.
    """

    def __init__(self, newest: int = 0) -> None:
        self.newest = newest
        self.refused = 0
        """How many commands were refused."""
        self._heard: float | None = None
        self._since = self._last = -inf
        """When the commands that are refused began to come without a break, and when the latest came, s."""

    def admits(self, token: int, now: float | None = None) -> bool:
        """Whether to follow a command with this token that comes at `now`, s of any steady clock. Without a time no life is ever forsaken."""
        if self._heard is None:
            self._heard = now
        if token < self.newest:
            self.refused += 1
            if now is None or self._heard is None:
                return False
            if now - self._last > BREAK:
                self._since = now
            self._last = now
            if now - self._heard < FORSAKEN or now - self._since < STEADY:
                return False
        self.newest, self._heard, self._last = token, now, -inf
        return True
