"""`do_transform`: messages with positions and directions, given in another frame."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from actors.interfaces.geometry_msgs import msg as geometry
from actors.interfaces.message import M, Message
from actors.interfaces.sensor_msgs.msg import PointCloud2
from actors.suggest import did_you_mean
from actors.tf2.transform import Transform


def do_transform(message: M, transform: geometry.TransformStamped) -> M:
    """`message`, of the transform's child frame, given in its parent frame.

    Takes Point, Point32, Vector3, Quaternion, Pose, PoseWithCovariance, PoseArray, Polygon, Transform, Wrench, those of them that are
    stamped, VelocityStamped, and PointCloud2 (of which x, y and z change, and nothing else). The header is that of the transform; a cloud
    keeps its stamp. A vector is rotated only; a wrench is that of the same force at the new origin, and a velocity that of the same body
    there.

    Raises ``TypeError`` for other types, `InvalidArgumentException` for a transform that is none.
    """
    way: Callable[[Any, Transform], Any] | None = _WAYS.get(type(message))
    moved = Transform.from_msg(transform)
    if way is not None:
        result: M = way(message, moved)
        return result
    inner = _STAMPED.get(type(message))
    if inner is not None:
        changed = _WAYS[type(getattr(message, inner))](getattr(message, inner), moved)
        return message.replace(header=transform.header, **{inner: changed})
    if isinstance(
        message, geometry.VelocityStamped
    ):  # a Twist has no frame of its own, and nobody knows of which point it is
        return message.replace(header=transform.header, velocity=_velocity(message.velocity, moved))
    if isinstance(message, geometry.PoseArray):
        poses = tuple(_pose(pose, moved) for pose in message.poses)
        return message.replace(header=transform.header, poses=poses)
    if isinstance(message, PointCloud2):
        from actors.tf2.clouds import transformed  # late: it needs numpy

        header = message.header.replace(frame_id=transform.header.frame_id)
        return message.replace(header=header, data=transformed(message, moved))
    kinds: tuple[type[Message], ...] = (*_WAYS, *_STAMPED, geometry.VelocityStamped, geometry.PoseArray, PointCloud2)
    known = [kind.__name__ for kind in kinds]
    name = type(message).__name__
    raise TypeError(f"do_transform does not know {name}{did_you_mean(name, known)}; it takes {', '.join(known)}")


def _point(point: geometry.Point, moved: Transform) -> geometry.Point:
    x, y, z = moved.point((point.x, point.y, point.z))
    return geometry.Point(x=x, y=y, z=z)


def _point32(point: geometry.Point32, moved: Transform) -> geometry.Point32:
    x, y, z = moved.point((point.x, point.y, point.z))
    return geometry.Point32(x=x, y=y, z=z)


def _vector(vector: geometry.Vector3, moved: Transform) -> geometry.Vector3:
    x, y, z = moved.vector((vector.x, vector.y, vector.z))
    return geometry.Vector3(x=x, y=y, z=z)


def _pose(pose: geometry.Pose, moved: Transform) -> geometry.Pose:
    there = moved @ Transform.from_msg(pose)
    x, y, z = there.translation
    return geometry.Pose(position=geometry.Point(x=x, y=y, z=z), orientation=there.to_msg().rotation)


def _quaternion(rotation: geometry.Quaternion, moved: Transform) -> geometry.Quaternion:
    return _pose(geometry.Pose(orientation=rotation), moved).orientation


def _pose_with_covariance(pose: geometry.PoseWithCovariance, moved: Transform) -> geometry.PoseWithCovariance:
    import numpy as np  # late: not every program that uses transforms needs it

    both = np.kron(np.eye(2), moved.matrix)  # position and rotation turn alike
    covariance = both @ np.reshape(pose.covariance, (6, 6)) @ both.T
    return pose.replace(pose=_pose(pose.pose, moved), covariance=covariance.ravel())


def _transform(transform: geometry.Transform, moved: Transform) -> geometry.Transform:
    return (moved @ Transform.from_msg(transform)).to_msg()


def _velocity(velocity: geometry.Twist, moved: Transform) -> geometry.Twist:
    """Both are screws: of a wrench the force, of a velocity the rotation is the same at every point."""
    there = _wrench(geometry.Wrench(force=velocity.angular, torque=velocity.linear), moved)
    return geometry.Twist(linear=there.torque, angular=there.force)


def _polygon(polygon: geometry.Polygon, moved: Transform) -> geometry.Polygon:
    return polygon.replace(points=tuple(_point32(point, moved) for point in polygon.points))


def _wrench(wrench: geometry.Wrench, moved: Transform) -> geometry.Wrench:
    force, torque = _vector(wrench.force, moved), _vector(wrench.torque, moved)
    x, y, z = moved.translation
    return geometry.Wrench(
        force=force,
        torque=geometry.Vector3(
            x=torque.x + y * force.z - z * force.y,
            y=torque.y + z * force.x - x * force.z,
            z=torque.z + x * force.y - y * force.x,
        ),
    )


_WAYS: dict[type[Message], Callable[[Any, Transform], object]] = {
    geometry.Point: _point,
    geometry.Point32: _point32,
    geometry.Vector3: _vector,
    geometry.Quaternion: _quaternion,
    geometry.Pose: _pose,
    geometry.PoseWithCovariance: _pose_with_covariance,
    geometry.Polygon: _polygon,
    geometry.Transform: _transform,
    geometry.Wrench: _wrench,
}
_STAMPED: dict[type[Message], str] = {
    geometry.PointStamped: "point",
    geometry.Vector3Stamped: "vector",
    geometry.QuaternionStamped: "quaternion",
    geometry.PoseStamped: "pose",
    geometry.PoseWithCovarianceStamped: "pose",
    geometry.PolygonStamped: "polygon",
    geometry.TransformStamped: "transform",
    geometry.WrenchStamped: "wrench",
}
"""Stamped types, and their field that is transformed."""
