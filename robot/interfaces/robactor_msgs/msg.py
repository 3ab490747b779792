"""robactor_msgs/msg. Generated from its definitions in share; do not edit."""

from typing import Annotated

from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.geometry_msgs.msg import Point, Vector3
from actors.interfaces.message import Message
from actors.interfaces.std_msgs.msg import Header
from actors.interfaces.types import (
    Exactly,
    bool_array,
    default,
    float64,
    float64_array,
    string,
    string_array,
    uint16,
    uint32,
    uint64,
)

__all__ = [
    "ArmState",
    "BatteryStatus",
    "BodyDrive",
    "Detection",
    "DockStatus",
    "DriveStatus",
    "FootContacts",
    "GaitStatus",
    "GoalReport",
    "GripperState",
    "ImuCalibration",
    "MotorPower",
    "MotorTargets",
    "SafetyState",
]


class ArmState(Message, frozen=True, kw_only=True):
    """robactor_msgs/msg/ArmState

    Where the tutorial's arm is, so that a node that is asked for it need not move it.
    """

    joint_angles: float64_array = default()
    """[rad]"""
    arm_status: string = ""
    """IDLE or MOVING"""


class BatteryStatus(Message, frozen=True, kw_only=True):
    """robactor_msgs/msg/BatteryStatus

    What the charge means: beside sensor_msgs/BatteryState, which has no place for it.
    """

    stamp: Time = default()
    level: string = ""
    """good, low or critical, with hysteresis"""
    percent: float64 = 0.0
    """by coulomb count"""
    runtime: float64 = 0.0
    """until 10.0 V at the mean load of the last minute [s]"""
    mean_load: float64 = 0.0
    """[W]"""
    energy: float64 = 0.0
    """that this load can draw before the charge is critical [Wh]"""
    charging: bool = False
    supply: float64 = 1.0
    """share of the nominal voltage that the motor drives get: 0 from when the pack is empty until it is charged"""


class BodyDrive(Message, frozen=True, kw_only=True):
    """robactor_msgs/msg/BodyDrive

    How the kinematic body is to move; the physics body takes MotorTargets instead.
    """

    stamp: Time = default()
    fence: uint64 = 0
    """Node.fencing_token of the sender: what an older life of it sends late is refused"""
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


class Detection(Message, frozen=True, kw_only=True):
    """robactor_msgs/msg/Detection

    A coloured object in one camera image: where it is in the picture and in space.
    """

    header: Header = default()
    """stamp of the image; the frame of position"""
    label: string = ""
    """its colour: red, green, blue, yellow"""
    x: uint32 = 0
    """leftmost column of its bounding box [px]"""
    y: uint32 = 0
    """uppermost row of it [px]"""
    width: uint32 = 0
    """[px]"""
    height: uint32 = 0
    """[px]"""
    pixels: uint32 = 0
    """how many pixels of the box are the object's"""
    position: Point = default()
    """of the middle of what is seen of it [m]"""


class DockStatus(Message, frozen=True, kw_only=True):
    """robactor_msgs/msg/DockStatus

    Where the robot stands with its charging station.
    """

    stamp: Time = default()
    state: string = ""
    """UNDOCKED, DOCKING, DOCKED"""
    outcome: string = ""
    """how the last attempt ended; empty before the first"""
    charging: bool = False


class DriveStatus(Message, frozen=True, kw_only=True):
    """robactor_msgs/msg/DriveStatus

    Who drives the robot.
    """

    stamp: Time = default()
    enabled: bool = False
    source: string = ""
    """teleop, joystick, voice or autonomy; empty when nobody drives"""
    reason: string = ""
    """the source again, or why the robot stands still"""
    dropped: uint32 = 0
    """commands that were not numbers, so far"""


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
    gait: string = ""
    """in use, or chosen for the next walk: trot, crawl, pace, bound, pronk"""


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
    error_code: uint16 = 0
    """of /navigate_to_pose, 0 if it succeeded: robot.planning.errors.ErrorCode"""
    seconds: float64 = 0.0
    """from the start to the end"""
    behind_obstacle: bool = False
    """the straight line to it was blocked when it was set"""


class GripperState(Message, frozen=True, kw_only=True):
    """robactor_msgs/msg/GripperState

    What the gripper's own sensors tell; what it holds they do not know.
    """

    stamp: Time = default()
    opening: float64 = 0.0
    """between the jaws [m]"""
    closing: bool = False
    """told last to close, not to open"""
    moving: bool = False
    gripping: bool = False
    """the jaws were stopped by something and press on it"""


class ImuCalibration(Message, frozen=True, kw_only=True):
    """robactor_msgs/msg/ImuCalibration

    What the IMU's driver takes off its samples from now on, and what it was told from. All zero: not calibrated.
    """

    stamp: Time = default()
    gyro_bias: Vector3 = default()
    """mean of the gyro at rest, body axes [rad/s]"""
    gyro_sd: Vector3 = default()
    """standard deviation of one sample [rad/s]"""
    gravity: Vector3 = default()
    """mean of the accelerometer at rest, body axes, not taken off [m/s2]"""
    roll: float64 = 0.0
    """attitude of the accelerometer as gravity tells it [rad]"""
    pitch: float64 = 0.0
    """the same [rad]"""
    samples: uint32 = 0
    """how many samples the means are of"""


class MotorPower(Message, frozen=True, kw_only=True):
    """robactor_msgs/msg/MotorPower

    Electrical power that the joint motors took since the last message, whether charging contacts are closed, and what was refused.
    """

    stamp: Time = default()
    mean: float64 = 0.0
    """[W]"""
    charger: bool = False
    """the dock's contacts touch"""
    refused: uint64 = 0
    """commands of older lives of their sender so far, which were not followed"""
    supplied: bool = True
    """the battery gives the drives current"""
    temperature: float64_array = default()
    """of each motor's winding, in the order of the leg joints; empty where they do not get warm [C]"""
    torque_left: float64 = 1.0
    """share of its torque that heat leaves to the hottest drive"""
    real_time_factor: float64 = 1.0
    """simulated seconds in a second, where the body is simulated; less than 1 on a machine that is too slow for it"""


class MotorTargets(Message, frozen=True, kw_only=True):
    """robactor_msgs/msg/MotorTargets

    What the drives of all 12 joints are told: torque = effort + kp (position - q) + kd (velocity - qd), then limited.
    Joint order: fl, fr, rl, rr; in each leg hip, shoulder, knee.
    """

    stamp: Time = default()
    fence: uint64 = 0
    """Node.fencing_token of the sender: what an older life of it sends late is refused"""
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


class SafetyState(Message, frozen=True, kw_only=True):
    """robactor_msgs/msg/SafetyState

    Whether the robot must stand still, and why. Sent 20 times a second: who obeys it stops when it is no longer heard.
    """

    stamp: Time = default()
    """rises from message to message"""
    stopped: bool = False
    reasons: string_array = default()
    """of the stop, the oldest first"""
    present: string_array = default()
    """those of them whose cause is still there: they cannot be cleared yet"""
