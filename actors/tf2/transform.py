"""A rigid transform as a value: rotation and translation, put together, taken back, and interpolated.

Plain floats throughout: a tree of frames composes a handful of these at a time, and numpy would cost more than the arithmetic.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, hypot, inf, isfinite, sin
from typing import TYPE_CHECKING

from actors.interfaces.geometry_msgs.msg import Pose, Quaternion, TransformStamped, Twist, Vector3, VelocityStamped
from actors.interfaces.geometry_msgs.msg import Transform as TransformMessage
from actors.interfaces.std_msgs.msg import Header
from actors.tf2.errors import InvalidArgumentException
from actors.tf2.quaternions import Quad, Triple, between, of_rpy, product, rotated, rotation_vector, rpy_of, unit

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike, NDArray

    from actors.interfaces.builtin_interfaces.msg import Time

SHORTEST = 1e-6
"""A quaternion shorter than this has no direction: most often it was never set."""


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
    def from_rpy(cls, translation: Triple, roll: float, pitch: float, yaw: float) -> Transform:
        """Metres and radians, about fixed axes: first roll about x, then pitch about y, then yaw about z."""
        return cls(translation, of_rpy(roll, pitch, yaw))

    @classmethod
    def from_msg(cls, message: TransformMessage | TransformStamped | Pose) -> Transform:
        """The rotation is brought to length 1, as tf2 does. Raises `InvalidArgumentException` for one of length 0, or for numbers that are
        not finite."""
        if isinstance(message, TransformStamped):
            message = message.transform
        if isinstance(message, Pose):
            t, r = (message.position.x, message.position.y, message.position.z), message.orientation
        else:
            t, r = (message.translation.x, message.translation.y, message.translation.z), message.rotation
        norm = hypot(r.w, r.x, r.y, r.z)
        if not (isfinite(sum(t)) and SHORTEST <= norm < inf):
            raise InvalidArgumentException(
                f"translation ({t[0]:g}, {t[1]:g}, {t[2]:g}), rotation w {r.w:g}, x {r.x:g}, y {r.y:g}, z {r.z:g}: all numbers must be "
                f"finite and the rotation not of length {norm:g}"
            )
        return cls(t, (r.w / norm, r.x / norm, r.y / norm, r.z / norm))

    def to_msg(self) -> TransformMessage:
        """The transform as ``geometry_msgs/msg/Transform``."""
        x, y, z = self.translation
        qw, qx, qy, qz = self.rotation
        return TransformMessage(translation=Vector3(x=x, y=y, z=z), rotation=Quaternion(x=qx, y=qy, z=qz, w=qw))

    def __matmul__(self, inner: Transform) -> Transform:
        """First `inner`, then this: a_from_c = a_from_b @ b_from_c."""
        return Transform(self.point(inner.translation), unit(product(self.rotation, inner.rotation)))

    def inverse(self) -> Transform:
        """The other way round: ``t @ t.inverse()`` is the identity."""
        w, x, y, z = self.rotation
        back = (w, -x, -y, -z)
        tx, ty, tz = self.translation
        return Transform(rotated(back, (-tx, -ty, -tz)), back)

    def point(self, point: Sequence[float]) -> Triple:
        """Take one point across."""
        x, y, z = point
        rx, ry, rz = rotated(self.rotation, (x, y, z))
        tx, ty, tz = self.translation
        return (rx + tx, ry + ty, rz + tz)

    def vector(self, vector: Sequence[float]) -> Triple:
        """Take one free vector across: it is rotated only."""
        x, y, z = vector
        return rotated(self.rotation, (x, y, z))

    def points(self, points: ArrayLike) -> NDArray[np.float64]:
        """Take many points across, shape (n, 3)."""
        import numpy as np  # late: not every program that uses transforms needs it

        moved = np.asarray(points, dtype=np.float64) @ self.matrix.T + np.array(self.translation)
        return np.asarray(moved, dtype=np.float64)

    @property
    def matrix(self) -> NDArray[np.float64]:
        """The rotation as a matrix, shape (3, 3)."""
        import numpy as np  # late, as above

        columns = [rotated(self.rotation, axis) for axis in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))]
        return np.array(columns, dtype=np.float64).T

    @property
    def rpy(self) -> Triple:
        """Roll, pitch and yaw, rad, as `from_rpy` takes them; with the nose straight up or down, roll is 0."""
        return rpy_of(self.rotation)

    def towards(self, other: Transform, share: float) -> Transform:
        """The pose that lies `share` (0..1) of the way to `other`: linear in place, slerp in rotation, the short way round."""
        ax, ay, az = self.translation
        bx, by, bz = other.translation
        middle = (ax + share * (bx - ax), ay + share * (by - ay), az + share * (bz - az))
        return Transform(middle, between(self.rotation, other.rotation, share))


def stamped(parent: str, child: str, transform: Transform, stamp: Time) -> TransformStamped:
    """A message that says where `child` is in `parent` at `stamp`."""
    return TransformStamped(
        header=Header(stamp=stamp, frame_id=parent), child_frame_id=child, transform=transform.to_msg()
    )


def velocity_in(
    message: VelocityStamped,
    *,
    before: Transform,
    after: Transform,
    seconds: float,
    now: Transform,
    point: Triple,
    axes: Transform,
) -> VelocityStamped:
    """`message` with the velocity of a body that went from `before` to `after` in so many `seconds`.

    The poses and the `point` of the body whose linear velocity it is are given in the frame of the observer, for the instant at which the
    body is `now`; `axes` takes vectors of that frame to the frame in which the answer is expressed.
    """
    w, x, y, z = before.rotation
    turned = rotation_vector(product(after.rotation, (w, -x, -y, -z)))
    wx, wy, wz = (part / seconds for part in turned)
    vx, vy, vz = ((b - a) / seconds for a, b in zip(before.translation, after.translation, strict=True))
    rx, ry, rz = (there - here for here, there in zip(now.translation, point, strict=True))
    linear = axes.vector((vx + wy * rz - wz * ry, vy + wz * rx - wx * rz, vz + wx * ry - wy * rx))
    angular = axes.vector((wx, wy, wz))
    return message.replace(velocity=Twist(linear=_message(linear), angular=_message(angular)))


def _message(vector: Triple) -> Vector3:
    x, y, z = vector
    return Vector3(x=x, y=y, z=z)
