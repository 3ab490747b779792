"""What the words of a run ask for: where to walk, what to fetch, and which faults to make; values, and their parsers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite, radians

from cli.command import UsageError

Goal = tuple[float, float, float]
"""x and y in metres, the heading in rad."""


@dataclass(frozen=True, slots=True)
class Crash:
    """``--crash NODE@T``: make the node fail, at that many seconds."""

    node: str
    at: float


@dataclass(frozen=True, slots=True)
class Hang:
    """``--hang NODE@T``: make the event loop of the node's process stand still, at that many seconds."""

    node: str
    at: float


@dataclass(frozen=True, slots=True)
class Fetch:
    """``--fetch NAME [X Y [Z]]``: what to fetch, and where to carry it (m)."""

    name: str
    to: tuple[float, float, float] | None


def parse_fault(option: str, text: str, duration: float | None) -> tuple[str, float]:
    """The node and the time of ``NODE@T``, in a run of `duration` seconds. Raises `UsageError`."""
    return at_a_time(option, text, duration, "NODE@SECONDS, such as navigation@10")


def at_a_time(option: str, text: str, duration: float | None, form: str) -> tuple[str, float]:
    """Both sides of ``WHAT@T``, in a run of `duration` seconds; `form` says how it is written. Raises `UsageError`."""
    what, mark, at = text.rpartition("@")
    try:
        seconds = float(at)
    except ValueError:
        seconds = -1.0
    if not mark or not what or not isfinite(seconds) or seconds < 0.0:
        raise UsageError(f"{option} {text}: write {form}")
    if duration is not None and seconds >= duration:
        raise UsageError(f"{option} {text}: the run ends at {duration:g} s, before that; give a longer --duration")
    return what, seconds


def checked(option: str, value: float, low: float, high: float, unit: str) -> float:
    """The value, if it lies within the bounds. Raises `UsageError`."""
    if not low <= value <= high:  # also false for NaN
        raise UsageError(f"{option} {value:g}: give {low:g} to {high:g} {unit}")
    return value


def parse_goal(values: Sequence[float] | None) -> Goal | None:
    """What `--goal` says: x and y in metres, the heading in rad (0 unless given). Raises `UsageError`."""
    if values is None:
        return None
    if len(values) not in (2, 3):
        raise UsageError(f"--goal takes X Y or X Y THETA, not {len(values)} numbers")
    x, y, theta = (*values, 0.0)[:3]
    for name, value in (("X", x), ("Y", y), ("THETA", theta)):
        if not isfinite(value):
            raise UsageError(f"--goal: {name} is {value}, which is not a finite number")
    if abs(theta) > radians(360):
        raise UsageError(f"--goal: THETA is {theta:g} rad; give an angle within one turn, in radians")
    return x, y, theta


def parse_fetch(values: Sequence[str] | None, goal: object) -> Fetch | None:
    """What `--fetch` says; `goal` is what `--goal` says, as there can be only one of them. Raises `UsageError`."""
    if values is None:
        return None
    if goal is not None:
        raise UsageError("--fetch and --goal: one task at a time; give one of them")
    name, *place = values
    if len(place) not in (0, 2, 3):
        raise UsageError(f"--fetch takes NAME, NAME X Y or NAME X Y Z, not {len(place)} numbers")
    try:
        x, y, z = (*(float(text) for text in place), 0.0, 0.0, 0.0)[:3]
    except ValueError:
        raise UsageError(f"--fetch {' '.join(values)}: X, Y and Z are numbers, in meters") from None
    if not all(isfinite(value) for value in (x, y, z)):
        raise UsageError(f"--fetch {' '.join(values)}: X, Y and Z must be finite")
    return Fetch(name, (x, y, z) if place else None)
