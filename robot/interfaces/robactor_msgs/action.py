"""robactor_msgs/action. Generated from its definitions in share; do not edit."""

from typing import TypeAlias

from actors.interfaces.geometry_msgs.msg import PoseStamped
from actors.interfaces.message import ActionType, Message
from actors.interfaces.types import default, float64, string

__all__ = [
    "Dock",
    "Dock_Feedback",
    "Dock_Goal",
    "Dock_Result",
    "FetchAndCarry",
    "FetchAndCarry_Feedback",
    "FetchAndCarry_Goal",
    "FetchAndCarry_Result",
]


class Dock_Goal(Message, frozen=True, kw_only=True):
    """robactor_msgs/action/Dock_Goal

    Sit down on the charging station (/dock), or leave it (/undock).
    seconds for all of it; 0: the server's own limit
    """

    timeout: float64 = 0.0


class Dock_Result(Message, frozen=True, kw_only=True):
    """robactor_msgs/action/Dock_Result"""

    success: bool = False
    outcome: string = ""
    """docked, undocked, misaligned, dock not found, dock lost, timed out"""
    message: string = ""


class Dock_Feedback(Message, frozen=True, kw_only=True):
    """robactor_msgs/action/Dock_Feedback

    going, looking, approaching, sitting, rising, leaving
    """

    stage: string = ""
    distance_remaining: float64 = 0.0
    """to the end of this stage [m]"""


class Dock(ActionType[Dock_Goal, Dock_Result, Dock_Feedback]):
    """robactor_msgs/action/Dock"""

    Goal: TypeAlias = Dock_Goal
    Result: TypeAlias = Dock_Result
    Feedback: TypeAlias = Dock_Feedback


class FetchAndCarry_Goal(Message, frozen=True, kw_only=True):
    """robactor_msgs/action/FetchAndCarry_Goal

    Pick an object up where it is and put it down elsewhere.
    """

    object_name: string = ""
    target_pose: PoseStamped = default()
    """about where the object is; frame map"""
    place_pose: PoseStamped = default()
    """where to put it: the point it shall stand on, z included; frame map"""


class FetchAndCarry_Result(Message, frozen=True, kw_only=True):
    """robactor_msgs/action/FetchAndCarry_Result"""

    success: bool = False
    held_object: string = ""
    """what is still in the gripper"""
    final_pose: PoseStamped = default()
    """of the robot"""
    message: string = ""


class FetchAndCarry_Feedback(Message, frozen=True, kw_only=True):
    """robactor_msgs/action/FetchAndCarry_Feedback"""

    stage: string = ""
    """calibrate, confirm, navigate, grab, carry, release"""
    distance_remaining: float64 = 0.0
    """to walk [m]"""
    progress_percent: float64 = 0.0


class FetchAndCarry(ActionType[FetchAndCarry_Goal, FetchAndCarry_Result, FetchAndCarry_Feedback]):
    """robactor_msgs/action/FetchAndCarry"""

    Goal: TypeAlias = FetchAndCarry_Goal
    Result: TypeAlias = FetchAndCarry_Result
    Feedback: TypeAlias = FetchAndCarry_Feedback
