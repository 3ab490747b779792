"""Attitude from gyro and accelerometer by a complementary filter. Yaw is integrated from the gyro, and pulled to where scans see it, if any do.

After Mahony et al. (2008), with the robot's own acceleration subtracted from the specific force before gravity is read from it (otherwise
each change of speed tilts the horizon). With the vertical u in body axes, the gyro's bias b, and the quaternion q body to odom:

    e = (accel - own) x u / g            q <- q exp((gyro - b + GRAVITY_GAIN e) dt)

Symbols and sources: docs/concepts/control.md#attitude.
"""

from __future__ import annotations

from math import asin, atan2, cos, sin, sqrt

from robot.estimation.gyro_bias import GyroBias
from robot.estimation.heading_pull import HeadingPull
from robot.geometry.vectors import Triple
from robot.model.parameters import GRAVITY

GRAVITY_GAIN = 0.4
"""Proportional gain of the horizon's error, 1/s: roll and pitch follow the accelerometer with a time constant of 2.5 s."""
LEVEL_TIME = 0.4
"""For so long after a start, s, the horizon is the mean of the accelerometer: one sample may have been taken in a bump, and turning
a horizon that is far off would turn the heading as well."""
BUMP = 0.3
"""A specific force that differs from gravity by more than this share is no rest and does not count for that mean."""


class AttitudeFilter:
    """Orientation body to odom, as quaternion and rotation matrix, and the estimate of the gyro's bias. Plain floats throughout."""

    __slots__ = ("_force", "age", "bias", "pull", "quaternion", "rotation", "turn", "up")

    def __init__(self) -> None:
        self.quaternion: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)
        self.bias = GyroBias()
        self.pull = HeadingPull()
        self.turn: Triple = (0.0, 0.0, 0.0)
        """Angular velocity without the bias, body axes, rad/s."""
        self.up: Triple = (0.0, 0.0, 1.0)
        """The world's vertical in body axes: the third row of the rotation."""
        self.rotation: tuple[Triple, Triple, Triple] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
        self.age = 0.0
        self._force: Triple = (0.0, 0.0, 0.0)
        """Sum of the specific forces of the first moments."""

    @property
    def levelled(self) -> bool:
        """Whether it has had the time to find the horizon: the first samples are those of a body that still settles."""
        return self.age >= LEVEL_TIME

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
        """One sample: angular rate, specific force, and the robot's own acceleration as estimated without this sensor (body axes).

        `still` says that the robot stands and does not turn: whatever the gyro then shows is bias.
        """
        ax, ay, az = accel[0] - own[0], accel[1] - own[1], accel[2] - own[2]
        ux, uy, uz = self.up
        ex, ey, ez = (ay * uz - az * uy) / GRAVITY, (az * ux - ax * uz) / GRAVITY, (ax * uy - ay * ux) / GRAVITY
        self.age += dt
        self.bias.wander(dt)
        if still and self.age < LEVEL_TIME:
            self._find_horizon(gyro, accel)
            return
        gain = GRAVITY_GAIN
        if still:
            self.bias.rest(dt, gyro)
        else:
            self.bias.lean(dt, ex, ey)
        turning, learned = self.pull.advance(dt)
        self.bias.seen(learned)
        bx, by, bz = self.bias.value
        wx, wy, wz = gyro[0] - bx, gyro[1] - by, gyro[2] - bz
        self.turn = (wx, wy, wz)
        tx, ty, tz = gain * ex + turning * ux, gain * ey + turning * uy, gain * ez + turning * uz
        self._rotate((wx + tx) * dt, (wy + ty) * dt, (wz + tz) * dt)

    def _find_horizon(self, gyro: Triple, accel: Triple) -> None:
        """The robot has just been switched on and lies still: roll and pitch from the mean force, heading zero."""
        self.turn = gyro
        strength = sqrt(accel[0] ** 2 + accel[1] ** 2 + accel[2] ** 2)
        if abs(strength / GRAVITY - 1.0) < BUMP:
            x, y, z = self._force
            self._force = (x + accel[0], y + accel[1], z + accel[2])
            self.level(self._force)

    def _rotate(self, x: float, y: float, z: float) -> None:
        angle = sqrt(x * x + y * y + z * z)
        scale = 0.5 - angle * angle / 48.0  # formula: Taylor series of sin(a / 2) / a
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
