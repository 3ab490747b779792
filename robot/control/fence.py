"""`Fence`: refuses commands of a life that has been replaced."""

from __future__ import annotations

__all__ = ["Fence"]


class Fence:
    """What a command must pass: it counts if its token (`Node.fencing_token`) is that of the newest life heard so far, or of a newer one.

    Invariant: `newest` never goes back. No clock decides here: a command may be as late as it likes.
    """

    def __init__(self, newest: int = 0) -> None:
        self.newest = newest
        self.refused = 0
        """How many commands were refused."""

    def admits(self, token: int) -> bool:
        """Whether to follow a command with this token."""
        if token < self.newest:
            self.refused += 1
            return False
        self.newest = token
        return True
