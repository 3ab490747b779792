"""A rigid transform as a value: rotation and translation, put together, taken back, and blended.

Plain floats throughout: a tree of frames composes a handful of these at a time, and numpy would cost more than the arithmetic.
Quaternions are (w, x, y, z). Slerp: Shoemake, "Animating rotation with quaternion curves" (1985).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import acos, cos, hypot, isfinite, sin

import numpy as np
from numpy.typing import ArrayLike, NDArray

from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.geometry_msgs.msg import Quaternion, TransformStamped, Vector3
from actors.interfaces.geometry_msgs.msg import Transform as TransformMessage
from actors.interfaces.std_msgs.msg import Header
from robot.geometry.errors import InvalidTransform
from robot.geometry.vectors import Triple

__all__ = ["Transform", "stamped"]

Quad = tuple[float, float, float, float]

NEARLY_UNIT = 1e-3
"""A quaternion whose length differs from 1 by more than this is a mistake, not rounding."""
NEARLY_ALIGNED = 1.0 - 1e-9
"""Above this cosine of the half angle, slerp divides by next to nothing; a straight line is exact to rounding."""


@dataclass(frozen=True, slots=True)
class Transform:
    """Takes points given in one frame (the child, or source) to another (the parent, or target): p' = rotation p + translation.

    It is also the pose of the source frame in the target frame. Immutable; rotations are kept at length 1.
    """

    translation: Triple = (0.0, 0.0, 0.0)
    """m."""
    rotation: Quad = (1.0, 0.0, 0.0, 0.0)
    """Quaternion (w, x, y, z)."""

    @classmethod
    def planar(cls, x: float, y: float, yaw: float) -> Transform:
        """On the floor: metres and radians."""
        return cls((x, y, 0.0), (cos(yaw / 2), 0.0, 0.0, sin(yaw / 2)))

    @classmethod
    def from_message(cls, message: TransformMessage) -> Transform:
        """Raises `InvalidTransform` for numbers that are not finite or a rotation that is not of length 1 (to 0.1 %)."""
        t, r = message.translation, message.rotation
        norm = hypot(r.w, r.x, r.y, r.z)
        if not (isfinite(t.x) and isfinite(t.y) and isfinite(t.z) and abs(norm - 1.0) <= NEARLY_UNIT):
            raise InvalidTransform(
                f"translation ({t.x:g}, {t.y:g}, {t.z:g}), rotation w {r.w:g}, x {r.x:g}, y {r.y:g}, z {r.z:g}: all numbers must be "
                f"finite and the rotation of length 1, not {norm:g}"
            )
        return cls((t.x, t.y, t.z), (r.w / norm, r.x / norm, r.y / norm, r.z / norm))

    def to_message(self) -> TransformMessage:
        x, y, z = self.translation
        qw, qx, qy, qz = self.rotation
        return TransformMessage(translation=Vector3(x=x, y=y, z=z), rotation=Quaternion(x=qx, y=qy, z=qz, w=qw))

    def __matmul__(self, inner: Transform) -> Transform:
        """First `inner`, then this: a_from_c = a_from_b @ b_from_c."""
        return Transform(self.point(inner.translation), _unit(_product(self.rotation, inner.rotation)))

    def inverse(self) -> Transform:
        """The other way round: ``t @ t.inverse()`` is the identity."""
        w, x, y, z = self.rotation
        back = (w, -x, -y, -z)
        tx, ty, tz = self.translation
        return Transform(_rotate(back, (-tx, -ty, -tz)), back)

    def point(self, point: Sequence[float]) -> Triple:
        """Take one point across."""
        x, y, z = point
        rx, ry, rz = _rotate(self.rotation, (x, y, z))
        tx, ty, tz = self.translation
        return (rx + tx, ry + ty, rz + tz)

    def points(self, points: ArrayLike) -> NDArray[np.float64]:
        """Take many points across, shape (n, 3)."""
        moved = np.asarray(points, dtype=np.float64) @ self.matrix.T + np.array(self.translation)
        return np.asarray(moved, dtype=np.float64)

    @property
    def matrix(self) -> NDArray[np.float64]:
        """The rotation as a matrix, shape (3, 3)."""
        columns = [_rotate(self.rotation, axis) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))]
        return np.array(columns, dtype=np.float64).T

    def towards(self, other: Transform, share: float) -> Transform:
        """The pose that lies `share` (0..1) of the way to `other`: linear in place, slerp in rotation, the short way round."""
        ax, ay, az = self.translation
        bx, by, bz = other.translation
        between = (ax + share * (bx - ax), ay + share * (by - ay), az + share * (bz - az))
        return Transform(between, _slerp(self.rotation, other.rotation, share))


def stamped(parent: str, child: str, transform: Transform, stamp: Time) -> TransformStamped:
    """A message that says where `child` is in `parent` at `stamp`."""
    return TransformStamped(
        header=Header(stamp=stamp, frame_id=parent), child_frame_id=child, transform=transform.to_message()
    )


def _product(a: Quad, b: Quad) -> Quad:
    aw, ax, ay, az = a
    bw, bx, by, bz = b
    return (
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    )


def _unit(q: Quad) -> Quad:
    w, x, y, z = q
    scale = 1.0 / hypot(w, x, y, z)
    return (w * scale, x * scale, y * scale, z * scale)


def _rotate(q: Quad, p: Triple) -> Triple:
    """p + 2 w (v x p) + 2 v x (v x p)."""
    w, x, y, z = q
    px, py, pz = p
    cx, cy, cz = 2.0 * (y * pz - z * py), 2.0 * (z * px - x * pz), 2.0 * (x * py - y * px)
    return (px + w * cx + y * cz - z * cy, py + w * cy + z * cx - x * cz, pz + w * cz + x * cy - y * cx)


def _slerp(a: Quad, b: Quad, share: float) -> Quad:
    cosine = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]
    sign = 1.0
    if cosine < 0.0:  # both q and -q are the same rotation: take the nearer one
        cosine, sign = -cosine, -1.0
    if cosine > NEARLY_ALIGNED:
        first, second = 1.0 - share, sign * share
    else:
        angle = acos(cosine)
        first, second = sin((1.0 - share) * angle) / sin(angle), sign * sin(share * angle) / sin(angle)
    return _unit(
        (
            first * a[0] + second * b[0],
            first * a[1] + second * b[1],
            first * a[2] + second * b[2],
            first * a[3] + second * b[3],
        )
    )
