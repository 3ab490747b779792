"""robactor_msgs/msg. Generated from its definitions in share; do not edit."""

from typing import Annotated

from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.message import Message
from actors.interfaces.types import Exactly, bool_array, default, float64, float64_array, string

__all__ = [
    "BodyDrive",
    "FootContacts",
    "GaitStatus",
    "GoalReport",
    "MotorPower",
    "MotorTargets",
]


class BodyDrive(Message, frozen=True, kw_only=True):
    """robactor_msgs/msg/BodyDrive

    How the kinematic body is to move; the physics body takes MotorTargets instead.
    """

    stamp: Time = default()
    vx: float64 = 0.0
    """forward [m/s]"""
    vy: float64 = 0.0
    """left [m/s]"""
    wz: float64 = 0.0
    """counter-clockwise [rad/s]"""
    height: float64 = 0.0
    """of the hips over the foot centres [m]"""
    mode: string = ""
    """sit, stand or walk"""


class FootContacts(Message, frozen=True, kw_only=True):
    """robactor_msgs/msg/FootContacts

    Which feet press on the ground with more than 5 N, in the order fl, fr, rl, rr.
    """

    stamp: Time = default()
    contact: Annotated[bool_array, Exactly(4)] = default()


class GaitStatus(Message, frozen=True, kw_only=True):
    """robactor_msgs/msg/GaitStatus

    What the gait controller is doing.
    """

    stamp: Time = default()
    mode: string = ""
    """sit, rising, stand, walk, stopping, lowering"""
    goal: string = ""
    """the mode asked for last: sit, stand or walk"""
    height: float64 = 0.0
    """of the body over the soles [m]"""
    sensors_ok: bool = False
    """false while IMU or encoders are silent"""


class GoalReport(Message, frozen=True, kw_only=True):
    """robactor_msgs/msg/GoalReport

    How one goal of the mission ended.
    """

    stamp: Time = default()
    name: string = ""
    """patrol_3, dock, goal"""
    x: float64 = 0.0
    """[m]"""
    y: float64 = 0.0
    """[m]"""
    theta: float64 = 0.0
    """[rad]"""
    outcome: string = ""
    """succeeded, canceled, aborted, rejected"""
    reason: string = ""
    seconds: float64 = 0.0
    """from the start to the end"""
    behind_obstacle: bool = False
    """the straight line to it was blocked when it was set"""


class MotorPower(Message, frozen=True, kw_only=True):
    """robactor_msgs/msg/MotorPower

    Electrical power that the joint motors took since the last message, and whether charging contacts are closed.
    """

    stamp: Time = default()
    mean: float64 = 0.0
    """[W]"""
    charger: bool = False
    """the dock's contacts touch"""


class MotorTargets(Message, frozen=True, kw_only=True):
    """robactor_msgs/msg/MotorTargets

    What the drives of all 12 joints are told: torque = effort + kp (position - q) + kd (velocity - qd), then limited.
    Joint order: fl, fr, rl, rr; in each leg hip, shoulder, knee.
    """

    stamp: Time = default()
    position: Annotated[float64_array, Exactly(12)] = default()
    """[rad]"""
    velocity: Annotated[float64_array, Exactly(12)] = default()
    """[rad/s]"""
    effort: Annotated[float64_array, Exactly(12)] = default()
    """[N m]"""
    kp: Annotated[float64_array, Exactly(12)] = default()
    """[N m/rad]"""
    kd: Annotated[float64_array, Exactly(12)] = default()
    """[N m s/rad]"""
