"""Attitude from gyro and accelerometer: integrate the one, lean slowly on the other. Yaw is the gyro's alone.

Source of the equations: the complementary filter of robot-domain section 6, with the robot's own acceleration taken out of
the accelerometer before gravity is read from it (otherwise each change of speed tilts the horizon).
"""

from __future__ import annotations

from math import asin, atan2, cos, sin, sqrt

from robot.gait.figures import GRAVITY
from robot.gait.gyro_bias import GyroBias
from robot.gait.limbs import Triple

__all__ = ["AttitudeFilter"]

GRAVITY_GAIN = 0.4
"""How fast the horizon follows the accelerometer, 1/s."""
EAGER_GAIN, EAGER_TIME = 10.0, 0.4
"""The same in the first moments (1/s, s): the very first sample may have been taken in a bump."""


class AttitudeFilter:
    """Orientation body to odom, as quaternion and rotation matrix, and the gyro's bias. Plain floats throughout."""

    __slots__ = ("age", "bias", "quaternion", "rotation", "turn", "up")

    def __init__(self) -> None:
        self.quaternion: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)
        self.bias = GyroBias()
        self.turn: Triple = (0.0, 0.0, 0.0)
        """Angular velocity without the bias, body axes, rad/s."""
        self.up: Triple = (0.0, 0.0, 1.0)
        """The world's vertical in body axes: the third row of the rotation."""
        self.rotation: tuple[Triple, Triple, Triple] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
        self.age = 0.0

    @property
    def yaw(self) -> float:
        return atan2(self.rotation[1][0], self.rotation[0][0])

    @property
    def roll(self) -> float:
        return atan2(self.up[1], self.up[2])

    @property
    def pitch(self) -> float:
        return -asin(max(-1.0, min(1.0, self.up[0])))

    def level(self, accel: Triple) -> None:
        """Take roll and pitch from one accelerometer sample at rest, yaw zero."""
        roll = atan2(accel[1], accel[2])
        pitch = atan2(-accel[0], sqrt(accel[1] ** 2 + accel[2] ** 2))
        cr, sr, cp, sp = cos(roll / 2), sin(roll / 2), cos(pitch / 2), sin(pitch / 2)
        self.quaternion = (cr * cp, sr * cp, cr * sp, -sr * sp)
        self._unpack()

    def update(self, dt: float, gyro: Triple, accel: Triple, own: Triple, still: bool) -> None:
        """One sample: angular rate, specific force, and the robot's own acceleration as known otherwise (body axes).

        `still` says that the robot stands and does not turn: whatever the gyro then shows is bias.
        """
        ax, ay, az = accel[0] - own[0], accel[1] - own[1], accel[2] - own[2]
        ux, uy, uz = self.up
        ex, ey, ez = (ay * uz - az * uy) / GRAVITY, (az * ux - ax * uz) / GRAVITY, (ax * uy - ay * ux) / GRAVITY
        self.age += dt
        gain = EAGER_GAIN if self.age < EAGER_TIME else GRAVITY_GAIN
        self.bias.wander(dt)
        if still and self.age > EAGER_TIME:
            self.bias.rest(gyro)
        else:
            self.bias.lean(dt, ex, ey)
        bx, by, bz = self.bias.value
        wx, wy, wz = gyro[0] - bx, gyro[1] - by, gyro[2] - bz
        self.turn = (wx, wy, wz)
        self._rotate((wx + gain * ex) * dt, (wy + gain * ey) * dt, (wz + gain * ez) * dt)

    def _rotate(self, x: float, y: float, z: float) -> None:
        angle = sqrt(x * x + y * y + z * z)
        scale = 0.5 - angle * angle / 48.0
        dw, dx, dy, dz = cos(angle / 2), x * scale, y * scale, z * scale
        w0, x0, y0, z0 = self.quaternion
        w = w0 * dw - x0 * dx - y0 * dy - z0 * dz
        x = w0 * dx + x0 * dw + y0 * dz - z0 * dy
        y = w0 * dy - x0 * dz + y0 * dw + z0 * dx
        z = w0 * dz + x0 * dy - y0 * dx + z0 * dw
        norm = 1.0 / sqrt(w * w + x * x + y * y + z * z)
        self.quaternion = (w * norm, x * norm, y * norm, z * norm)
        self._unpack()

    def _unpack(self) -> None:
        w, x, y, z = self.quaternion
        self.up = (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y))
        self.rotation = (
            (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)),
            (2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)),
            self.up,
        )
