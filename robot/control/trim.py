"""What makes up for a load that nobody told of: integrals on the body's height and on its lean.

    e_f' = (e - e_f) / SMOOTH          i' = GAIN e_f          |i| <= MOST

for the error e of height (m), roll and pitch (rad). Each begins only when its e_f has gone beyond `BEGIN`, and is over when it comes back to
zero: a robot without a load has no integral at all. Equations: docs/concepts/control.md#walking.
"""

from __future__ import annotations

from math import exp
from typing import Final

from robot.geometry.vectors import Triple
from robot.model.robot import SPOT, RobotModel

SMOOTH: Final = 0.3
"""Time constant of the low-pass before it, s; chosen: a stride takes 0.35 to 0.5 s."""
BEGIN: Final = (0.02, 0.04, 0.04)
"""Errors of height (m), roll and pitch (rad) from which on there is a load; chosen: noise and the body's swing show half of it."""
GAIN: Final = (60.0, 180.0, 180.0)
"""Growth, 1/s3; chosen: as the springs of a walk, within a second."""
MOST: Final = (6.0, 60.0, 60.0)
"""Bounds, m/s2 and rad/s2; chosen: what 20 kg ask for, and 14 kg a good 0.3 m beside the middle."""


class Trim:
    """Three integrals: lift (m/s2), and turning about roll and pitch (rad/s2), that the legs give besides.

    Invariants: each is within its bound; each is exactly zero until a low-passed error has been beyond what begins it.
    """

    def __init__(self, model: RobotModel = SPOT) -> None:
        rate, turn = GAIN[1] / model.length**1.5, MOST[1] / model.length  # formula: dynamic similarity
        self._begin: Triple = (BEGIN[0] * model.length, *BEGIN[1:])
        self._gain: Triple = (GAIN[0] / model.length**1.5, rate, rate)  # formula: dynamic similarity
        self._most: Triple = (MOST[0], turn, turn)
        self.value: Triple = (0.0, 0.0, 0.0)
        self._error: Triple = (0.0, 0.0, 0.0)
        """Low-passed."""

    def learn(self, dt: float, low: float, roll: float, pitch: float) -> None:
        """One step of `dt` seconds; the body should be so much higher (m) and be turned so much further (rad)."""
        blend = 1.0 - exp(-dt / SMOOTH)
        a, b, c = (old + blend * (new - old) for old, new in zip(self._error, (low, roll, pitch), strict=True))
        self._error = (a, b, c)
        x, y, z = (
            _integral(value, error, begin, dt * gain, most)
            for value, error, begin, gain, most in zip(
                self.value, self._error, self._begin, self._gain, self._most, strict=True
            )
        )
        self.value = (x, y, z)

    def reset(self) -> None:
        """There is no load, as far as is known."""
        self.value = self._error = (0.0, 0.0, 0.0)


def _integral(value: float, error: float, begin: float, gain: float, most: float) -> float:
    if value == 0.0 and abs(error) <= begin:
        return 0.0
    grown = max(-most, min(most, value + gain * error))
    return grown if value * grown >= 0.0 else 0.0
