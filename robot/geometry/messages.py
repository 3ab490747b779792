"""Poses on the floor, put together and taken apart, and their messages."""

from __future__ import annotations

from math import atan2, cos, sin

from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.geometry_msgs.msg import Point, Pose, PoseStamped, Quaternion
from actors.interfaces.std_msgs.msg import Header
from robot.planning.path import wrap
from robot.scenes.scene import Pose2

__all__ = ["compose", "from_pose", "inverse", "pose_stamped", "seconds", "to_pose"]


def compose(outer: Pose2, inner: Pose2) -> Pose2:
    """`inner`, given in the frame that `outer` is the pose of, in the frame of `outer`."""
    c, s = cos(outer.yaw), sin(outer.yaw)
    return Pose2(outer.x + c * inner.x - s * inner.y, outer.y + s * inner.x + c * inner.y, wrap(outer.yaw + inner.yaw))


def inverse(pose: Pose2) -> Pose2:
    """The pose of the outer frame in the inner one: `compose(pose, inverse(pose))` is the origin."""
    c, s = cos(pose.yaw), sin(pose.yaw)
    return Pose2(-c * pose.x - s * pose.y, s * pose.x - c * pose.y, -pose.yaw)


def from_pose(pose: Pose) -> Pose2:
    """The floor part of a pose message."""
    q = pose.orientation
    yaw = atan2(2.0 * (q.w * q.z + q.x * q.y), 1.0 - 2.0 * (q.y * q.y + q.z * q.z))
    return Pose2(pose.position.x, pose.position.y, yaw)


def to_pose(pose: Pose2) -> Pose:
    """A pose message on the floor, level."""
    return Pose(position=Point(x=pose.x, y=pose.y), orientation=Quaternion(z=sin(pose.yaw / 2), w=cos(pose.yaw / 2)))


def pose_stamped(pose: Pose2, stamp: Time, frame: str = "map") -> PoseStamped:
    return PoseStamped(header=Header(stamp=stamp, frame_id=frame), pose=to_pose(pose))


def seconds(stamp: Time) -> float:
    """A stamp as seconds."""
    return stamp.sec + 1e-9 * stamp.nanosec
