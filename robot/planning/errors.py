"""Why a plan or a walk failed, by name. Every message is a sentence that says what happened and where."""

from __future__ import annotations


class NavigationError(Exception):
    """Base of every named failure; `name` is the word for results and logs."""

    @property
    def name(self) -> str:
        return type(self).__name__


class InvalidPose(NavigationError, ValueError):
    """A coordinate is NaN or infinite."""


class StartBlocked(NavigationError):
    """The robot stands inside an obstacle or outside the map, so no path can begin there."""


class GoalBlocked(NavigationError):
    """The goal lies inside an obstacle, outside the map, or where the body does not fit."""


class Unreachable(NavigationError):
    """Start and goal are both free, but no passage wide enough joins them."""


class PathBlocked(NavigationError):
    """Something that is not on the map closed the way, and neither waiting nor another way helped."""


class NoProgress(NavigationError):
    """The robot did not get nearer although nothing is seen in its way, and every recovery was tried."""
