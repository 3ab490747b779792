"""Every topic, service and action of the robot in one place: what its nodes say to each other, and what others may ask of it.

First the robot's own: types of ROS 2's common packages and of robactor_msgs. Then what the tutorials ask of a robot, by types of their own
packages: the same nodes serve it, and the names of these types and topics are the tutorials'.

Where frames are to each other is on tf2's topics: `/tf`, 50 Hz, map -> odom, odom -> base_link, base_link -> gimbal_link, and 20 Hz
the links of legs and arm, while somebody listens; `/tf_static`, base_link -> imu_link, gimbal_link -> lidar_link and camera_link.

Frames: `odom` starts under the robot and drifts, `map` is the map's; `base_link` is the body. Units are SI.
"""

from __future__ import annotations

from typing import Final

from actors import Action, QoS, Service, Topic, qos
from actors.interfaces.diagnostic_msgs.msg import DiagnosticArray
from actors.interfaces.geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, Twist, TwistStamped
from actors.interfaces.nav_msgs.msg import OccupancyGrid, Odometry, Path
from actors.interfaces.sensor_msgs.msg import BatteryState, CameraInfo, Image, Imu, JointState, LaserScan, PointCloud2
from actors.interfaces.std_msgs.msg import Float64, String
from actors.interfaces.std_srvs.srv import SetBool, Trigger
from actors.interfaces.visualization_msgs.msg import MarkerArray
from actors.tf2 import TF as TF
from actors.tf2 import TF_STATIC as TF_STATIC
from robot.interfaces.nav2_msgs.action import NavigateThroughPoses, NavigateToPose
from robot.interfaces.robactor_msgs.action import Dock, FetchAndCarry
from robot.interfaces.robactor_msgs.msg import (
    BatteryStatus,
    BodyDrive,
    Detection,
    DockStatus,
    DriveStatus,
    FootContacts,
    GaitStatus,
    GoalReport,
    GripperState,
    ImuCalibration,
    MotorPower,
    MotorTargets,
    SafetyState,
)
from robot.interfaces.robactor_msgs.srv import ConfirmObject, GetPlace
from robot.interfaces.tutorials.humanoid_control_interfaces.action import NavigateToGoal
from robot.interfaces.tutorials.humanoid_control_interfaces.srv import PlanPath
from robot.interfaces.tutorials.my_robot_interfaces.action import MoveToPosition
from robot.interfaces.tutorials.my_robot_interfaces.msg import SensorData
from robot.interfaces.tutorials.my_robot_interfaces.srv import GetBatteryStatus
from robot.interfaces.tutorials.proposed_interfaces.action import NavigateAndGrab
from robot.interfaces.tutorials.proposed_interfaces.srv import GetRobotPose
from robot.interfaces.tutorials.robot_arm_control.action import MoveArm
from robot.interfaces.tutorials.robot_arm_control.srv import GetPosition
from robot.interfaces.tutorials.your_package.action import HumanoidNav
from robot.interfaces.tutorials.your_package.srv import SensorCalibration

# -- the robot's own ---------------------------------------------------------------------------------------------------------------

# Sensors: best effort, the newest counts; joint states reliable, because ROS 2's tools ask for that.
IMU = Topic(Imu, "/imu/data", qos.SENSOR_DATA)
"""200 Hz, without the bias that a calibration has found. Orientation is not measured: its covariance starts with -1."""
IMU_RAW = Topic(Imu, "/imu/data_raw", qos.SENSOR_DATA)
"""The same as it was measured. The gait's estimator takes this one: it learns the bias itself, all the time, and a jump would mislead it."""
JOINT_STATES = Topic(JointState, "/joint_states", QoS(depth=10))
"""200 Hz, the 12 leg joints, measured."""
CONTACTS = Topic(FootContacts, "/foot_contacts", qos.SENSOR_DATA)
"""200 Hz, of the same instants as the joint states."""
SCAN = Topic(LaserScan, "/lidar/scan", qos.SENSOR_DATA)
"""10 Hz, 360 beams of one instant, frame `lidar_link`; a range of 0 is a beam of which nothing is known."""
SCAN_RAW = Topic(LaserScan, "/lidar/scan_raw", qos.SENSOR_DATA)
"""10 Hz, 360 beams as a LiDAR that turns takes them one after the other, frame `base_link`; only with real sensors."""
LIDAR_POINTS = Topic(PointCloud2, "/lidar/points", qos.SENSOR_DATA)
"""10 Hz, the returns of the scan of the same stamp; made only while somebody listens."""
CAMERA_RGB = Topic(Image, "/camera/rgb", qos.SENSOR_DATA)
"""30 Hz, 640 x 480 rgb8, frame `camera_link` (x forward); rendered only while somebody listens to a topic of the camera."""
CAMERA_DEPTH = Topic(Image, "/camera/depth", qos.SENSOR_DATA)
"""30 Hz, 640 x 480 16UC1: millimetres along the camera's axis, pixel by pixel with CAMERA_RGB; 0 is nothing within 10 m."""
CAMERA_INFO = Topic(CameraInfo, "/camera/camera_info", qos.SENSOR_DATA)
"""30 Hz, of both images."""
CAMERA_POINTS = Topic(PointCloud2, "/camera/points", qos.SENSOR_DATA)
"""10 Hz, every eighth pixel of every eighth row of the depth image, frame `camera_link`."""
DEPTH_POINTS = Topic(PointCloud2, "/depth/points", qos.SENSOR_DATA)
"""10 Hz, of all depth cameras, frame `base_link`: always as many points in the same order, NaN without a depth; taken only while somebody listens."""
DETECTIONS = Topic(Detection, "/camera/detections", qos.DEFAULT)
"""Coloured objects in the camera image, one message each, at most 5 images a second; looked for only while somebody listens."""
ARM_JOINT_STATES = Topic(JointState, "/arm/joint_states", qos.SENSOR_DATA)
"""50 Hz, the arm's four joints, measured; only of a robot with an arm, like all that has to do with it."""
MOTOR_POWER = Topic(MotorPower, "/motor_power", qos.SENSOR_DATA)
"""10 Hz."""

ROBOT_DESCRIPTION = Topic(String, "/robot_description", qos.STATE)
"""The robot as URDF: links with masses and shapes, joints with limits. Viewers draw it by /tf."""

# Commands: reliable.
CMD_VEL = Topic(Twist, "/cmd_vel", qos.COMMANDS)
"""The body's velocity in its own axes; forgotten after 0.5 s. Only the robot controller publishes it."""
TELEOP_CMD = Topic(Twist, "/teleop/cmd_vel", qos.COMMANDS)
"""What an operator asks of the robot controller: of its four sources the first, before joystick, voice and autonomy."""
TELEOP_CMD_STAMPED = Topic(TwistStamped, "/teleop/cmd_vel_stamped", qos.COMMANDS)
"""The same from ROS 2's tools that stamp their commands; the stamp is not judged."""
JOY_CMD = Topic(Twist, "/joy/cmd_vel", qos.COMMANDS)
VOICE = Topic(String, "/voice_command", qos.COMMANDS)
"""One word, English or Portuguese: see `robot.nodes.voice`."""
AUTONOMY_CMD = Topic(Twist, "/autonomy/cmd_vel", qos.COMMANDS)
"""What navigation asks for."""
AUTONOMY_CMD_STAMPED = Topic(TwistStamped, "/autonomy/cmd_vel_stamped", qos.COMMANDS)
"""The same from another navigation, as Nav2 publishes it."""
MOTOR_TARGETS = Topic(MotorTargets, "/motor_targets", QoS(depth=1))
"""200 Hz from the gait controller; the motors sit the robot down 100 ms after the last one."""
BODY_DRIVE = Topic(BodyDrive, "/body_drive", QoS(depth=1))
"""The same for the kinematic body, which has no forces."""

# State: late joiners get the latest.
BATTERY_STATE = Topic(BatteryState, "/battery_state", qos.STATE)
"""1 Hz. `percentage` is the coulomb count, 0..1."""
BATTERY_STATUS = Topic(BatteryStatus, "/battery_status", qos.STATE)
"""1 Hz, and at every change of level."""
DRIVE_STATUS = Topic(DriveStatus, "/drive_status", qos.STATE)
"""At every change, and once a second."""
SAFETY_STATE = Topic(SafetyState, "/safety/state", qos.STATE)
"""20 Hz, and at once when it changes. While `stopped`, nobody may start a motion."""
RELOCALIZE = Service(Trigger, "/relocalize")
"""Looks on the whole map for the place where the newest scan was taken, and takes it for the robot's own if there is no second one like it."""
DOCK_STATUS = Topic(DockStatus, "/dock_status", qos.STATE)
"""At every change."""
GAIT_STATUS = Topic(GaitStatus, "/gait_status", qos.STATE)
"""10 Hz, and at every change of mode."""
GRIPPER_STATE = Topic(GripperState, "/gripper/state", qos.STATE)
"""At every change of what it does, and 10 Hz while it moves."""
IMU_CALIBRATION = Topic(ImuCalibration, "/imu/calibration", qos.STATE)
"""What is taken off the samples of IMU."""
MAP = Topic(OccupancyGrid, "/map", qos.MAP)
RELIEF = Topic(OccupancyGrid, "/elevation", qos.SENSOR_DATA)
"""10 Hz, 8 m around the robot, frame `map`: 0 is floor, 50 a step that can be crossed, 90, 95 and 100 what cannot (90: the LiDAR
sees it, too; 95: it is hidden behind an edge), -1 what was not seen."""
ELEVATION_POINTS = Topic(PointCloud2, "/elevation/points", qos.SENSOR_DATA)
"""2 Hz, how high each cell is, frame `map`, z over the floor that odometry began on, with `doubt` (m) and `age` (s);
made only while somebody listens."""
ODOMETRY = Topic(Odometry, "/odom", qos.DEFAULT)
"""50 Hz, frame `odom`: from legs and IMU; its heading is turned slowly to where HEADING_ERROR says. It never jumps."""
HEADING_ERROR = Topic(Float64, "/odom/heading_error", qos.SENSOR_DATA)
"""5 Hz while the LiDAR sees enough: by how much the heading of ODOMETRY is too large, rad, against the scans of the last way."""
POSE = Topic(PoseStamped, "/pose", qos.DEFAULT)
"""50 Hz, frame `map`: odometry corrected by matching scans to the map."""
LOCALIZATION = Topic(String, "/localization", qos.STATE)
"""What POSE is worth, published when it changes: `tracking`, also before the first message, `blind` while the LiDAR sees nothing where the map has
walls, `lost` while scans do not fit the map there, until the robot has been found on it, and `ambiguous` while they fit several places alike."""
INITIAL_POSE = Topic(PoseWithCovarianceStamped, "/initialpose", qos.DEFAULT)
"""Where the robot is, frame `map`, as rviz tells it: the localizer looks for its newest scan about there, within three times the standard deviations."""
GLOBAL_COSTMAP = Topic(OccupancyGrid, "/global_costmap/costmap", qos.MAP)
"""1 Hz while somebody listens, frame `map`: the map and what is seen that it does not show, at what the planner pays for being near; 99 and 100
is where the robot's middle may not go."""
LOCAL_COSTMAP = Topic(OccupancyGrid, "/local_costmap/costmap", qos.MAP)
"""The same 4 m around the robot, 2 Hz while somebody listens, frame `odom`; -1 is outside of the map."""
GOAL_POSE = Topic(PoseStamped, "/goal_pose", qos.DEFAULT)
"""A goal for NAVIGATE_TO_POSE, frame `map`, as rviz's "2D Goal Pose" sends it."""
PATH = Topic(Path, "/plan", qos.STATE)
"""The path being followed, frame `map`; without poses when a walk has ended."""
MARKERS = Topic(MarkerArray, "/markers", qos.DEFAULT)
"""5 Hz while somebody listens: which feet stand, the path that is followed, and the goal at its end."""
DIAGNOSTICS = Topic(DiagnosticArray, "/diagnostics", qos.DEFAULT)
"""1 Hz: battery, motors, gait, localization, safety and rates, each with a level."""
GOAL_REPORT = Topic(GoalReport, "/mission/goals", QoS(depth=100))
"""One message for each goal of the mission that has ended."""

# Questions.
CAPTURE_PHOTO = Service(Trigger, "/capture_photo")
"""Stores one camera image as PNG; the message of the answer is its path."""
STAND = Service(Trigger, "/spot/stand")
SIT = Service(Trigger, "/spot/sit")
WALK = Service(Trigger, "/spot/walk")
GRIPPER = Service(SetBool, "/gripper")
"""True closes it, and succeeds when it then grips something; false opens it."""
CALIBRATE_GRIPPER = Service(Trigger, "/calibrate_gripper")
"""Closes and opens it once. Refused while it grips something."""
CONFIRM_OBJECT = Service(ConfirmObject, "/confirm_object_detection")
"""Whether the camera sees an object now, and where: frame `base_link`."""
GET_PLACE = Service(GetPlace, "/get_place")
"""A name of the map, such as ``shelf_3`` -> the pose to stand at."""
ENABLE = Service(SetBool, "/robot/enable")
"""Whether the robot controller lets velocity commands through."""
EMERGENCY_STOP = Service(SetBool, "/emergency_stop")
"""True stops the robot; false clears the stop, if its causes are gone."""
GET_STATUS = Service(Trigger, "/robot/get_status")
SAVE_CONFIG = Service(Trigger, "/robot/save_config")
"""All parameters of all nodes to the file `config_file` of the node that serves it, which RESTORE_CONFIG reads."""
RESTORE_CONFIG = Service(Trigger, "/robot/restore_config")

# Long jobs.
NAVIGATE_TO_POSE = Action(NavigateToPose, "/navigate_to_pose")
"""Walks to a pose, frame `map`; a newer goal preempts. What cannot be reached is aborted at once: `error_code` is a
`robot.planning.errors.ErrorCode`, `error_msg` says it in words."""
NAVIGATE_THROUGH_POSES = Action(NavigateThroughPoses, "/navigate_through_poses")
"""Walks to each pose in turn."""
STRAIGHT: Final = "straight"
"""The one `behavior_tree` that the two know beside the usual one, "": it goes along the line, and aborts where something stands on it."""
DOCK = Action(Dock, "/dock")
"""To the charging station, and sit down on it."""
UNDOCK = Action(Dock, "/undock")
"""Up, and away from it."""
FETCH_AND_CARRY = Action(FetchAndCarry, "/fetch_and_carry")
"""Fetches an object as NAVIGATE_AND_GRAB does, and puts it down elsewhere."""

# -- what the tutorials ask of a robot: the same nodes serve these, by types of the tutorials' packages ------------------------------

SENSOR_DATA = Topic(SensorData, "/sensor_data", qos.DEFAULT)
"""The tutorials' message; its `emergency_stop` stops the robot."""
GET_BATTERY_STATUS = Service(GetBatteryStatus, "/get_battery_status")
"""The tutorials' voltage gauge; not the coulomb count of BATTERY_STATE."""
CALIBRATE_SENSOR = Service(SensorCalibration, "/calibrate_sensor")
"""For `imu` the robot must stand still for 3 s: ask with a timeout of more."""
GET_CURRENT_POSITION = Service(GetPosition, "/get_current_position")
"""Where the arm is, IDLE or MOVING: the same arm that MOVE_ARM moves."""
CALIBRATE_ARM = Service(SensorCalibration, "/calibrate_arm")
"""For `arm` and `gripper`; the arm must rest and hold nothing."""
PLAN_PATH = Service(PlanPath, "/plan_path")
"""A path by the map alone, frame `map`; nothing moves."""
GET_ROBOT_POSE = Service(GetRobotPose, "/get_robot_pose")
"""The latest of POSE, answered at once, whatever else the robot does."""
NAVIGATE_TO_GOAL = Action(NavigateToGoal, "/navigate_to_goal")
"""Asks for NAVIGATE_TO_POSE, as the next two do: a goal of one preempts those of the others."""
MOVE_TO_POSITION = Action(MoveToPosition, "/move_to_position")
HUMANOID_NAVIGATE = Action(HumanoidNav, "/humanoid_navigate")
"""Without `avoid_obstacles` it goes straight, or aborts."""
MOVE_ARM = Action(MoveArm, "/move_arm")
"""Moves the arm within its limits; a new goal preempts. Feedback 10 Hz."""
NAVIGATE_AND_GRAB = Action(NavigateAndGrab, "/navigate_and_grab")
"""Fetches an object: the target pose is about where the object is."""
