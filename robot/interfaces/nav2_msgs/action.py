"""nav2_msgs/action. Generated from its definitions in share; do not edit."""

from typing import ClassVar, TypeAlias

from actors.interfaces.builtin_interfaces.msg import Duration
from actors.interfaces.geometry_msgs.msg import PoseStamped
from actors.interfaces.message import ActionType, Message
from actors.interfaces.nav_msgs.msg import Goals
from actors.interfaces.types import Many, default, float32, int16, string, uint16

from .msg import WaypointStatus

__all__ = [
    "NavigateThroughPoses",
    "NavigateThroughPoses_Feedback",
    "NavigateThroughPoses_Goal",
    "NavigateThroughPoses_Result",
    "NavigateToPose",
    "NavigateToPose_Feedback",
    "NavigateToPose_Goal",
    "NavigateToPose_Result",
]


class NavigateThroughPoses_Goal(Message, frozen=True, kw_only=True):
    """nav2_msgs/action/NavigateThroughPoses_Goal"""

    poses: Goals = default()
    """goal definition"""
    behavior_tree: string = ""


class NavigateThroughPoses_Result(Message, frozen=True, kw_only=True):
    """nav2_msgs/action/NavigateThroughPoses_Result

    result definition
    """

    NONE: ClassVar[uint16] = 0
    GOAL_REJECTED: ClassVar[uint16] = 1
    SEND_GOAL_FAILURE: ClassVar[uint16] = 2
    UNKNOWN: ClassVar[uint16] = 9100
    FAILED_TO_LOAD_BEHAVIOR_TREE: ClassVar[uint16] = 9101
    TF_ERROR: ClassVar[uint16] = 9102
    TIMEOUT: ClassVar[uint16] = 9103

    error_code: uint16 = 0
    error_msg: string = ""
    waypoint_statuses: Many[WaypointStatus] = default()


class NavigateThroughPoses_Feedback(Message, frozen=True, kw_only=True):
    """nav2_msgs/action/NavigateThroughPoses_Feedback

    feedback definition
    """

    current_pose: PoseStamped = default()
    navigation_time: Duration = default()
    estimated_time_remaining: Duration = default()
    number_of_recoveries: int16 = 0
    distance_remaining: float32 = 0.0
    position_tracking_error: float32 = 0.0
    heading_tracking_error: float32 = 0.0
    number_of_poses_remaining: int16 = 0
    waypoint_statuses: Many[WaypointStatus] = default()


class NavigateThroughPoses(
    ActionType[NavigateThroughPoses_Goal, NavigateThroughPoses_Result, NavigateThroughPoses_Feedback]
):
    """nav2_msgs/action/NavigateThroughPoses"""

    Goal: TypeAlias = NavigateThroughPoses_Goal
    Result: TypeAlias = NavigateThroughPoses_Result
    Feedback: TypeAlias = NavigateThroughPoses_Feedback


class NavigateToPose_Goal(Message, frozen=True, kw_only=True):
    """nav2_msgs/action/NavigateToPose_Goal

    goal definition
    """

    pose: PoseStamped = default()
    behavior_tree: string = ""


class NavigateToPose_Result(Message, frozen=True, kw_only=True):
    """nav2_msgs/action/NavigateToPose_Result

    result definition
    """

    NONE: ClassVar[uint16] = 0
    GOAL_REJECTED: ClassVar[uint16] = 1
    SEND_GOAL_FAILURE: ClassVar[uint16] = 2
    UNKNOWN: ClassVar[uint16] = 9000
    FAILED_TO_LOAD_BEHAVIOR_TREE: ClassVar[uint16] = 9001
    TF_ERROR: ClassVar[uint16] = 9002
    TIMEOUT: ClassVar[uint16] = 9003

    error_code: uint16 = 0
    error_msg: string = ""


class NavigateToPose_Feedback(Message, frozen=True, kw_only=True):
    """nav2_msgs/action/NavigateToPose_Feedback

    feedback definition
    """

    current_pose: PoseStamped = default()
    navigation_time: Duration = default()
    estimated_time_remaining: Duration = default()
    number_of_recoveries: int16 = 0
    distance_remaining: float32 = 0.0
    position_tracking_error: float32 = 0.0
    heading_tracking_error: float32 = 0.0


class NavigateToPose(ActionType[NavigateToPose_Goal, NavigateToPose_Result, NavigateToPose_Feedback]):
    """nav2_msgs/action/NavigateToPose"""

    Goal: TypeAlias = NavigateToPose_Goal
    Result: TypeAlias = NavigateToPose_Result
    Feedback: TypeAlias = NavigateToPose_Feedback
