"""The arm of the tutorial: four joints that step along a straight line, fifty steps a motion. Pure state, no clock.

Its owner paces the steps (one each 0.1 s) and reports each `Progress`; `finish` or `cancel` ends the motion and gives
the result. The same object answers where the arm is, so that a position service and a move action agree.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite

JOINT_COUNT = 4
FARTHEST = 3.14


class InvalidTarget(ValueError):
    """The tutorial's arm was given a target that it cannot take."""


@dataclass(frozen=True, slots=True)
class Progress:
    """One feedback: a snapshot that later steps do not change."""

    current_angles: tuple[float, ...]
    progress_percentage: float
    status: str


@dataclass(frozen=True, slots=True)
class Ending:
    """How a motion ended: the result of the action, field by field."""

    success: bool
    final_angles: tuple[float, ...]
    message: str


class TutorialArm:
    """Four joints within +-3.14 rad, at `angles` to begin with. `steps` is how many feedbacks a motion has, at least 1."""

    __slots__ = ("_angles", "_done", "_start", "_steps", "_target")

    STEP_TIME = 0.1
    """Seconds between steps, for the owner's clock."""

    def __init__(self, steps: int = 50, angles: Sequence[float] = (0.0,) * JOINT_COUNT) -> None:
        if steps < 1:
            raise ValueError(f"A motion of the arm has at least one step, not {steps!r}.")
        self._steps = steps
        self._angles = self.check(angles)
        self._start = self._angles
        self._target: tuple[float, ...] | None = None
        self._done = 0

    def __repr__(self) -> str:
        angles = ", ".join(f"{angle:.2f}" for angle in self._angles)
        return f"<TutorialArm {self.status} at ({angles}) rad>"

    @property
    def joint_angles(self) -> tuple[float, ...]:
        """Where the arm is now, rad, also in the middle of a motion."""
        return self._angles

    @property
    def status(self) -> str:
        """``IDLE`` or ``MOVING``."""
        return "IDLE" if self._target is None else "MOVING"

    @staticmethod
    def check(target: Sequence[float]) -> tuple[float, ...]:
        """The target as floats; raises `InvalidTarget` unless it is 4 finite angles within +-3.14 rad."""
        if len(target) != JOINT_COUNT:
            raise InvalidTarget(f"The arm has {JOINT_COUNT} joints, but {len(target)} target angles were given.")
        angles = tuple(float(angle) for angle in target)
        for joint, angle in enumerate(angles):
            if not isfinite(angle) or abs(angle) > FARTHEST:
                raise InvalidTarget(
                    f"Joint {joint} cannot go to {angle} rad: give an angle from -{FARTHEST} to {FARTHEST} rad."
                )
        return angles

    def begin(self, target: Sequence[float]) -> None:
        """Set out for `target` from where the arm is. Raises `InvalidTarget`, or `RuntimeError` while a motion lasts."""
        angles = self.check(target)
        if self._target is not None:
            raise RuntimeError("The arm is moving already: finish or cancel that motion before the next begins.")
        self._start, self._target, self._done = self._angles, angles, 0

    @property
    def arrived(self) -> bool:
        """Whether the motion has made all its steps, so that only `finish` is left."""
        return self._target is not None and self._done == self._steps

    def step(self) -> Progress:
        """Make the next step: of n steps the first is at 0 %, the last at 100 % and exactly at the target."""
        if self._target is None or self.arrived:
            raise RuntimeError(
                "The arm has no step left to make: begin a motion first, and finish it when it has arrived."
            )
        last = self._done == self._steps - 1
        share = 1.0 if last else self._done / (self._steps - 1)
        between = tuple(a + (b - a) * share for a, b in zip(self._start, self._target, strict=True))
        self._angles = self._target if last else between
        self._done += 1
        percent = 100.0 * share
        return Progress(self._angles, percent, f"Moving... {percent:.1f}% complete")

    def finish(self) -> Ending:
        """End a motion that has arrived."""
        if not self.arrived:
            raise RuntimeError("The arm has not arrived: make its remaining steps, or cancel the motion.")
        self._target = None
        return Ending(True, self._angles, "Movement completed successfully")

    def cancel(self) -> Ending:
        """End the motion where the arm is; the next one starts from there."""
        self._target = None
        return Ending(False, self._angles, "Movement canceled")
