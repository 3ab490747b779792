"""What an IMU at rest tells of itself: the gyro's bias and where gravity points; and whether the robot was at rest at all.

Gyro bias: the mean of the gyro of a body that does not turn. With white noise of 1.7e-4 rad/s per root hertz, 3 s leave 1.0e-4 rad/s
(one sigma) on each axis, so 3e-4 rad/s are not exceeded on 99.7 of 100 axes; after 2 s, with 1.2e-4, it would be 98.7.

The accelerometer's bias cannot be told from a floor that is not level, so its mean is reported, with the roll and pitch that it stands
for, and not taken off.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import atan2, hypot
from typing import Final

import numpy as np
from numpy.typing import NDArray

AT_REST: Final = 3.0
"""For how long the robot stands still, s."""
GYRO_LIMIT: Final = 0.02
"""Standard deviation of the gyro above which the body shakes, and mean of the estimated turn above which it turns, rad/s."""
SPEED_LIMIT: Final = 0.02
"""Root mean square of the estimated speed above which the body moves, m/s."""
TILT_LIMIT: Final = 1.5e-3
"""Change of roll and pitch, as the accelerometer tells them, above which the body still settles, rad: 5 sigma of its noise over 1 s."""
FEWEST: Final = 100
"""IMU samples that make a mean."""


class NotAtRest(Exception):
    """The robot was not still, or its sensors were; the text says which, with the figures."""


@dataclass(frozen=True, slots=True)
class Rest:
    """What was told. Body axes, shape (3,) each."""

    gyro: NDArray[np.float64]
    """Mean, rad/s: the bias."""
    gyro_sd: NDArray[np.float64]
    """Of one sample, rad/s."""
    accel: NDArray[np.float64]
    """Mean, m/s2."""
    samples: int

    @property
    def roll(self) -> float:
        """Of the accelerometer, as gravity tells it, rad."""
        return atan2(float(self.accel[1]), float(self.accel[2]))

    @property
    def pitch(self) -> float:
        """Of the accelerometer, as gravity tells it, rad."""
        return atan2(-float(self.accel[0]), hypot(float(self.accel[1]), float(self.accel[2])))


def rest_of(
    gyro: Sequence[Sequence[float]], accel: Sequence[Sequence[float]], speeds: Sequence[float], turns: Sequence[float]
) -> Rest:
    """The means over a time of rest: gyro (rad/s) and accelerometer (m/s2), shape (n, 3) each, and what odometry said meanwhile: speeds
    (m/s) and turning rates (rad/s), shape (m,).

    Raises `NotAtRest`.
    """
    if len(gyro) < FEWEST:
        raise NotAtRest(f"the IMU is silent: {len(gyro)} samples came in {AT_REST:g} s, {FEWEST} are needed")
    if not speeds:
        raise NotAtRest("the speed of the body is unknown: there is no odometry")
    speed, turn = float(np.sqrt(np.mean(np.square(speeds)))), abs(float(np.mean(turns)))
    rates, forces = np.asarray(gyro, dtype=np.float64), np.asarray(accel, dtype=np.float64)
    deviation = rates.std(axis=0, ddof=1)
    if not speed <= SPEED_LIMIT:
        raise NotAtRest(
            f"the robot moves at {speed:.3f} m/s, more than {SPEED_LIMIT:g}: let it stand still for {AT_REST:g} s"
        )
    if not turn <= GYRO_LIMIT:
        raise NotAtRest(
            f"the robot turns at {turn:.3f} rad/s, more than {GYRO_LIMIT:g}: let it stand still for {AT_REST:g} s"
        )
    if not float(deviation.max()) <= GYRO_LIMIT:
        raise NotAtRest(
            f"the gyro shakes by {float(deviation.max()):.3f} rad/s (standard deviation), more than {GYRO_LIMIT:g}: "
            f"let the robot stand still for {AT_REST:g} s"
        )
    third = len(forces) // 3
    first, last = forces[:third].mean(axis=0), forces[-third:].mean(axis=0)
    tilt = float(np.abs(last - first)[:2].max()) / float(np.linalg.norm(forces.mean(axis=0)))
    if not tilt <= TILT_LIMIT:
        raise NotAtRest(
            f"the robot tilts by {tilt:.4f} rad meanwhile, more than {TILT_LIMIT:g}: let it settle, and stand still for {AT_REST:g} s"
        )
    return Rest(rates.mean(axis=0), deviation, forces.mean(axis=0), len(rates))
