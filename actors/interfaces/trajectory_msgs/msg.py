"""trajectory_msgs/msg. Generated from its definitions in share; do not edit."""

from actors.interfaces.builtin_interfaces.msg import Duration
from actors.interfaces.geometry_msgs.msg import Transform, Twist
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg import Header
from actors.interfaces.types import Many, default, float64_array, string_array

__all__ = [
    "JointTrajectory",
    "JointTrajectoryPoint",
    "MultiDOFJointTrajectory",
    "MultiDOFJointTrajectoryPoint",
]


class JointTrajectoryPoint(Message, frozen=True, kw_only=True):
    """trajectory_msgs/msg/JointTrajectoryPoint"""

    positions: float64_array = default()
    velocities: float64_array = default()
    accelerations: float64_array = default()
    effort: float64_array = default()
    time_from_start: Duration = default()


class JointTrajectory(Message, frozen=True, kw_only=True):
    """trajectory_msgs/msg/JointTrajectory"""

    header: Header = default()
    joint_names: string_array = default()
    points: Many[JointTrajectoryPoint] = default()


class MultiDOFJointTrajectoryPoint(Message, frozen=True, kw_only=True):
    """trajectory_msgs/msg/MultiDOFJointTrajectoryPoint"""

    transforms: Many[Transform] = default()
    velocities: Many[Twist] = default()
    accelerations: Many[Twist] = default()
    time_from_start: Duration = default()


class MultiDOFJointTrajectory(Message, frozen=True, kw_only=True):
    """trajectory_msgs/msg/MultiDOFJointTrajectory"""

    header: Header = default()
    joint_names: string_array = default()
    points: Many[MultiDOFJointTrajectoryPoint] = default()
