"""Why a plan or a walk failed, by name. Every message is a sentence that says what happened and where."""

from __future__ import annotations

from enum import IntEnum
from typing import ClassVar


class ErrorCode(IntEnum):
    """Why a goal of /navigate_to_pose was not reached, as its result says it.

    Up to 9999 these are Nav2's: those of its controller (100), planner (200) and navigator (9000). From 10000 on, where Nav2 leaves room, they
    are this robot's own.
    """

    NONE = 0
    PATIENCE_EXCEEDED = 104
    """Something that is not on the map closed the way."""
    FAILED_TO_MAKE_PROGRESS = 105
    START_OCCUPIED = 205
    GOAL_OCCUPIED = 206
    """The goal is in an obstacle, outside of the map, or where the body does not fit."""
    NO_VALID_PATH = 208
    UNKNOWN = 9000
    FAILED_TO_LOAD_BEHAVIOR_TREE = 9001
    TF_ERROR = 9002
    """The goal is given in a frame that is not the map's, or the robot does not know where it is."""
    LOW_BATTERY = 10000
    """The charge is critical, or does not last for the goal and the way from there to the dock."""
    SAFETY_STOP = 10001
    NOT_WALKING = 10002
    """The gait refused to walk, or has stopped walking."""
    PREEMPTED = 10003
    """A newer goal took over."""

    @classmethod
    def of(cls, result: object) -> ErrorCode:
        """The code in the result of a goal; `UNKNOWN` if it has none, or one that is not here."""
        try:
            return cls(getattr(result, "error_code", cls.UNKNOWN))
        except ValueError:
            return cls.UNKNOWN

    @property
    def no_way(self) -> bool:
        """Whether the planner found no way on the map."""
        return self in (ErrorCode.START_OCCUPIED, ErrorCode.GOAL_OCCUPIED, ErrorCode.NO_VALID_PATH)


class NotReached(Exception):
    """A goal was not accepted by the navigator, or not reached: the `code` says why, the message says it in words."""

    def __init__(self, code: ErrorCode, message: str) -> None:
        super().__init__(message)
        self.code = code


class NavigationError(Exception):
    """Base of every named failure; `name` is the word for results and logs, `code` what nodes act upon."""

    code: ClassVar[ErrorCode] = ErrorCode.UNKNOWN

    @property
    def name(self) -> str:
        return type(self).__name__


class InvalidPose(NavigationError, ValueError):
    """A coordinate is NaN or infinite."""

    code = ErrorCode.GOAL_OCCUPIED


class StartBlocked(NavigationError):
    """The robot stands inside an obstacle or outside the map, so no path can begin there."""

    code = ErrorCode.START_OCCUPIED


class GoalBlocked(NavigationError):
    """The goal lies inside an obstacle, outside the map, or where the body does not fit."""

    code = ErrorCode.GOAL_OCCUPIED


class Unreachable(NavigationError):
    """Start and goal are both free, but no passage wide enough joins them."""

    code = ErrorCode.NO_VALID_PATH


class PathBlocked(NavigationError):
    """Something that is not on the map closed the way, and neither waiting nor another way helped."""

    code = ErrorCode.PATIENCE_EXCEEDED


class NoProgress(NavigationError):
    """The robot did not get nearer although nothing is seen in its way, and every recovery was tried."""

    code = ErrorCode.FAILED_TO_MAKE_PROGRESS
