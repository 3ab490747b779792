"""Poses on the floor as messages, and taken from them."""

from __future__ import annotations

from math import cos, isfinite, sin

from actors.interfaces.builtin_interfaces.msg import Duration, Time
from actors.interfaces.geometry_msgs.msg import Point, Pose, PoseStamped, Quaternion
from actors.interfaces.std_msgs.msg import Header
from robot.geometry.angles import yaw_of
from robot.geometry.planar import Pose2


def from_pose(pose: Pose) -> Pose2:
    """The floor part of a pose message."""
    q = pose.orientation
    return Pose2(pose.position.x, pose.position.y, yaw_of(q.w, q.x, q.y, q.z))


def is_pose(pose: Pose) -> bool:
    """Whether a message, which anybody may have sent, holds finite numbers and a rotation."""
    p, q = pose.position, pose.orientation
    return isfinite(p.x + p.y + p.z) and 1e-6 < q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w < 1e6


def to_pose(pose: Pose2) -> Pose:
    """A pose message on the floor, level."""
    return Pose(position=Point(x=pose.x, y=pose.y), orientation=Quaternion(z=sin(pose.yaw / 2), w=cos(pose.yaw / 2)))


def pose_stamped(pose: Pose2, stamp: Time, frame: str = "map") -> PoseStamped:
    return PoseStamped(header=Header(stamp=stamp, frame_id=frame), pose=to_pose(pose))


def seconds(stamp: Time | Duration) -> float:
    """A stamp or a duration as seconds."""
    return stamp.sec + 1e-9 * stamp.nanosec
