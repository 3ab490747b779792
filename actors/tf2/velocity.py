"""How a body moves, from two of its poses."""

from __future__ import annotations

from actors.interfaces.geometry_msgs.msg import Twist, Vector3, VelocityStamped
from actors.tf2.quaternions import Triple, product, rotation_vector
from actors.tf2.transform import Transform


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
