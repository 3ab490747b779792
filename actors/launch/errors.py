"""The errors of launch files: what is wrong, with the file and the line."""

from __future__ import annotations

import os
from inspect import currentframe
from typing import Final, NamedTuple

from actors.errors import ActorError, reduce_error

_OURS: Final = os.path.join(os.path.dirname(os.path.abspath(__file__)), "")


class Line(NamedTuple):
    """A line of a launch file."""

    file: str
    number: int

    def __str__(self) -> str:
        return f"{self.file}:{self.number}"


class LaunchError(Exception):
    """A launch file cannot be launched. The text says what is wrong; it begins with `line`, the place in the launch file, if it is known."""

    __reduce__ = reduce_error

    def __init__(self, problem: str, line: Line | None = None) -> None:
        super().__init__(f"{line}: {problem}" if line is not None else problem)
        self.problem = problem
        self.line = line

    def at(self, line: Line | None) -> LaunchError:
        """This error with a line, if it has none yet."""
        return self if self.line is not None or line is None else type(self)(self.problem, line)


class SubstitutionFailure(LaunchError):
    """A substitution has no value."""


class ConditionError(LaunchError, ValueError):
    """The text of a condition is neither true nor false."""


class ProcessDied(ActorError):
    """A process ended with another exit code than 0; a negative one is the number of the signal that ended it."""

    def __init__(self, returncode: int, command: str) -> None:
        super().__init__(f"process has died [exit code {returncode}, cmd '{command}']")
        self.returncode = returncode


def user_line() -> Line | None:
    """The line of the launch file that is being executed: the innermost one outside of this package; None if there is none."""
    frame = currentframe()
    while frame is not None and frame.f_code.co_filename.startswith(_OURS):
        frame = frame.f_back
    return None if frame is None else Line(frame.f_code.co_filename, frame.f_lineno)
