"""Every topic, service and action of the robot in one place: what its nodes say to each other, and what others may ask of it.

Frames: `odom` starts under the robot and drifts, `map` is the map's; `base_link` is the body. Units are SI.
"""

from __future__ import annotations

from actors import Action, Service, Topic, qos
from actors.interfaces.geometry_msgs.msg import PoseStamped, Twist
from actors.interfaces.nav_msgs.msg import OccupancyGrid, Odometry, Path
from actors.interfaces.sensor_msgs.msg import BatteryState, Imu, JointState, LaserScan
from actors.interfaces.std_srvs.srv import Trigger
from robot.interfaces.humanoid_control_interfaces.action import NavigateToGoal
from robot.interfaces.humanoid_control_interfaces.srv import PlanPath
from robot.interfaces.my_robot_interfaces.action import MoveToPosition
from robot.interfaces.my_robot_interfaces.srv import GetBatteryStatus
from robot.interfaces.robactor_msgs.msg import BodyDrive, FootContacts, GaitStatus, GoalReport, MotorPower, MotorTargets

__all__ = [
    "BATTERY_STATE", "BODY_DRIVE", "CMD_VEL", "CONTACTS", "GAIT_STATUS", "GET_BATTERY_STATUS", "GOAL_REPORT", "IMU", "JOINT_STATES", "MAP", "MOTOR_POWER",
    "MOTOR_TARGETS", "MOVE_TO_POSITION", "NAVIGATE_TO_GOAL", "ODOMETRY", "PATH", "PLAN_PATH", "POSE", "SCAN", "SIT", "STAND", "WALK",
]  # fmt: skip

# Sensors: best effort, the newest counts.
IMU = Topic(Imu, "/imu/data", qos.SENSOR_DATA)
"""200 Hz. Orientation is not measured: its covariance starts with -1."""
JOINT_STATES = Topic(JointState, "/joint_states", qos.SENSOR_DATA)
"""200 Hz, the 12 leg joints, measured."""
CONTACTS = Topic(FootContacts, "/foot_contacts", qos.SENSOR_DATA)
"""200 Hz, of the same instants as the joint states."""
SCAN = Topic(LaserScan, "/lidar/scan", qos.SENSOR_DATA)
"""10 Hz, 360 beams."""
MOTOR_POWER = Topic(MotorPower, "/motor_power", qos.SENSOR_DATA)
"""10 Hz."""

# Commands: reliable.
CMD_VEL = Topic(Twist, "/cmd_vel", qos.COMMANDS)
"""The body's velocity in its own axes; forgotten after 0.5 s."""
MOTOR_TARGETS = Topic(MotorTargets, "/motor_targets", qos.QoS(depth=1))
"""200 Hz from the gait controller; the motors sit the robot down 100 ms after the last one."""
BODY_DRIVE = Topic(BodyDrive, "/body_drive", qos.QoS(depth=1))
"""The same for the kinematic body, which has no forces."""

# State: late joiners get the latest.
BATTERY_STATE = Topic(BatteryState, "/battery_state", qos.STATE)
"""1 Hz. `percentage` is the coulomb count, 0..1."""
GAIT_STATUS = Topic(GaitStatus, "/gait_status", qos.STATE)
"""10 Hz, and at every change of mode."""
MAP = Topic(OccupancyGrid, "/map", qos.MAP)
ODOMETRY = Topic(Odometry, "/odom", qos.DEFAULT)
"""50 Hz, frame `odom`: from legs and IMU alone."""
POSE = Topic(PoseStamped, "/pose", qos.DEFAULT)
"""50 Hz, frame `map`: odometry corrected by matching scans to the map."""
PATH = Topic(Path, "/plan", qos.STATE)
"""The path being followed, frame `map`."""
GOAL_REPORT = Topic(GoalReport, "/mission/goals", qos.QoS(depth=100))
"""One message for each goal of the mission that has ended."""

# Questions.
GET_BATTERY_STATUS = Service(GetBatteryStatus, "/get_battery_status")
"""The tutorials' voltage gauge; not the coulomb count of BATTERY_STATE."""
STAND = Service(Trigger, "/spot/stand")
SIT = Service(Trigger, "/spot/sit")
WALK = Service(Trigger, "/spot/walk")
PLAN_PATH = Service(PlanPath, "/plan_path")

# Long jobs.
NAVIGATE_TO_GOAL = Action(NavigateToGoal, "/navigate_to_goal")
MOVE_TO_POSITION = Action(MoveToPosition, "/move_to_position")
