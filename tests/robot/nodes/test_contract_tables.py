"""Every contract of the robot and of the tutorials, letter by letter: what others rely on is changed here on purpose, or not at all.

The other tests import the contracts, so they would follow any change of a name, a type or a profile.
"""

from __future__ import annotations

import importlib
import pkgutil
import subprocess
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from actors import Action, Service, Topic
from robot import contracts, tutorials
from robot.interfaces import tutorials as tutorial_types

KINDS: dict[type, str] = {Topic: "topic", Service: "service", Action: "action"}

# contract, kind, name, type, profile
ROBOT = """
ARM_JOINT_STATES      topic    /arm/joint_states          sensor_msgs/msg/JointState                         keep_last 5, best_effort, volatile
AUTONOMY_CMD          topic    /autonomy/cmd_vel          geometry_msgs/msg/Twist                            keep_last 10, reliable, volatile
AUTONOMY_CMD_STAMPED  topic    /autonomy/cmd_vel_stamped  geometry_msgs/msg/TwistStamped                     keep_last 10, reliable, volatile
BATTERY_STATE         topic    /battery_state             sensor_msgs/msg/BatteryState                       keep_last 1, reliable, transient_local
BATTERY_STATUS        topic    /battery_status            robactor_msgs/msg/BatteryStatus                    keep_last 1, reliable, transient_local
BODY_DRIVE            topic    /body_drive                robactor_msgs/msg/BodyDrive                        keep_last 1, reliable, volatile
CALIBRATE_ARM         service  /calibrate_arm             your_package/srv/SensorCalibration                 -
CALIBRATE_GRIPPER     service  /calibrate_gripper         std_srvs/srv/Trigger                               -
CALIBRATE_SENSOR      service  /calibrate_sensor          your_package/srv/SensorCalibration                 -
CAMERA_DEPTH          topic    /camera/depth              sensor_msgs/msg/Image                              keep_last 5, best_effort, volatile
CAMERA_INFO           topic    /camera/camera_info        sensor_msgs/msg/CameraInfo                         keep_last 5, best_effort, volatile
CAMERA_POINTS         topic    /camera/points             sensor_msgs/msg/PointCloud2                        keep_last 5, best_effort, volatile
CAMERA_RGB            topic    /camera/rgb                sensor_msgs/msg/Image                              keep_last 5, best_effort, volatile
CAPTURE_PHOTO         service  /capture_photo             std_srvs/srv/Trigger                               -
CMD_VEL               topic    /cmd_vel                   geometry_msgs/msg/Twist                            keep_last 10, reliable, volatile
CONFIRM_OBJECT        service  /confirm_object_detection  robactor_msgs/srv/ConfirmObject                    -
CONTACTS              topic    /foot_contacts             robactor_msgs/msg/FootContacts                     keep_last 5, best_effort, volatile
DEPTH_POINTS          topic    /depth/points              sensor_msgs/msg/PointCloud2                        keep_last 5, best_effort, volatile
DETECTIONS            topic    /camera/detections         robactor_msgs/msg/Detection                        keep_last 10, reliable, volatile
DIAGNOSTICS           topic    /diagnostics               diagnostic_msgs/msg/DiagnosticArray                keep_last 10, reliable, volatile
DOCK                  action   /dock                      robactor_msgs/action/Dock                          -
DOCK_STATUS           topic    /dock_status               robactor_msgs/msg/DockStatus                       keep_last 1, reliable, transient_local
DRIVE_STATUS          topic    /drive_status              robactor_msgs/msg/DriveStatus                      keep_last 1, reliable, transient_local
ELEVATION_POINTS      topic    /elevation/points          sensor_msgs/msg/PointCloud2                        keep_last 5, best_effort, volatile
EMERGENCY_STOP        service  /emergency_stop            std_srvs/srv/SetBool                               -
ENABLE                service  /robot/enable              std_srvs/srv/SetBool                               -
FETCH_AND_CARRY       action   /fetch_and_carry           robactor_msgs/action/FetchAndCarry                 -
GAIT_STATUS           topic    /gait_status               robactor_msgs/msg/GaitStatus                       keep_last 1, reliable, transient_local
GET_BATTERY_STATUS    service  /get_battery_status        my_robot_interfaces/srv/GetBatteryStatus           -
GET_CURRENT_POSITION  service  /get_current_position      robot_arm_control/srv/GetPosition                  -
GET_PLACE             service  /get_place                 robactor_msgs/srv/GetPlace                         -
GET_ROBOT_POSE        service  /get_robot_pose            proposed_interfaces/srv/GetRobotPose               -
GET_STATUS            service  /robot/get_status          std_srvs/srv/Trigger                               -
GLOBAL_COSTMAP        topic    /global_costmap/costmap    nav_msgs/msg/OccupancyGrid                         keep_last 1, reliable, transient_local
GOAL_POSE             topic    /goal_pose                 geometry_msgs/msg/PoseStamped                      keep_last 10, reliable, volatile
GOAL_REPORT           topic    /mission/goals             robactor_msgs/msg/GoalReport                       keep_last 100, reliable, volatile
GRIPPER               service  /gripper                   std_srvs/srv/SetBool                               -
GRIPPER_STATE         topic    /gripper/state             robactor_msgs/msg/GripperState                     keep_last 1, reliable, transient_local
HEADING_ERROR         topic    /odom/heading_error        std_msgs/msg/Float64                               keep_last 5, best_effort, volatile
HUMANOID_NAVIGATE     action   /humanoid_navigate         your_package/action/HumanoidNav                    -
IMU                   topic    /imu/data                  sensor_msgs/msg/Imu                                keep_last 5, best_effort, volatile
IMU_CALIBRATION       topic    /imu/calibration           robactor_msgs/msg/ImuCalibration                   keep_last 1, reliable, transient_local
IMU_RAW               topic    /imu/data_raw              sensor_msgs/msg/Imu                                keep_last 5, best_effort, volatile
INITIAL_POSE          topic    /initialpose               geometry_msgs/msg/PoseWithCovarianceStamped        keep_last 10, reliable, volatile
JOINT_STATES          topic    /joint_states              sensor_msgs/msg/JointState                         keep_last 10, reliable, volatile
JOY_CMD               topic    /joy/cmd_vel               geometry_msgs/msg/Twist                            keep_last 10, reliable, volatile
LIDAR_POINTS          topic    /lidar/points              sensor_msgs/msg/PointCloud2                        keep_last 5, best_effort, volatile
LOCAL_COSTMAP         topic    /local_costmap/costmap     nav_msgs/msg/OccupancyGrid                         keep_last 1, reliable, transient_local
LOCALIZATION          topic    /localization             std_msgs/msg/String                                keep_last 1, reliable, transient_local
MAP                   topic    /map                       nav_msgs/msg/OccupancyGrid                         keep_last 1, reliable, transient_local
MARKERS               topic    /markers                   visualization_msgs/msg/MarkerArray                 keep_last 10, reliable, volatile
MOTOR_POWER           topic    /motor_power               robactor_msgs/msg/MotorPower                       keep_last 5, best_effort, volatile
MOTOR_TARGETS         topic    /motor_targets             robactor_msgs/msg/MotorTargets                     keep_last 1, reliable, volatile
MOVE_ARM              action   /move_arm                  robot_arm_control/action/MoveArm                   -
MOVE_TO_POSITION      action   /move_to_position          my_robot_interfaces/action/MoveToPosition          -
NAVIGATE_AND_GRAB     action   /navigate_and_grab         proposed_interfaces/action/NavigateAndGrab         -
NAVIGATE_THROUGH_POSES action  /navigate_through_poses    nav2_msgs/action/NavigateThroughPoses              -
NAVIGATE_TO_GOAL      action   /navigate_to_goal          humanoid_control_interfaces/action/NavigateToGoal  -
NAVIGATE_TO_POSE      action   /navigate_to_pose          nav2_msgs/action/NavigateToPose                    -
ODOMETRY              topic    /odom                      nav_msgs/msg/Odometry                              keep_last 10, reliable, volatile
PATH                  topic    /plan                      nav_msgs/msg/Path                                  keep_last 1, reliable, transient_local
PLAN_PATH             service  /plan_path                 humanoid_control_interfaces/srv/PlanPath           -
POSE                  topic    /pose                      geometry_msgs/msg/PoseStamped                      keep_last 10, reliable, volatile
RELIEF                topic    /elevation                 nav_msgs/msg/OccupancyGrid                         keep_last 5, best_effort, volatile
RELOCALIZE            service  /relocalize               std_srvs/srv/Trigger                               -
RESTORE_CONFIG        service  /robot/restore_config      std_srvs/srv/Trigger                               -
ROBOT_DESCRIPTION     topic    /robot_description         std_msgs/msg/String                                keep_last 1, reliable, transient_local
SAFETY_STATE          topic    /safety/state              robactor_msgs/msg/SafetyState                      keep_last 1, reliable, transient_local
SAVE_CONFIG           service  /robot/save_config         std_srvs/srv/Trigger                               -
SCAN                  topic    /lidar/scan                sensor_msgs/msg/LaserScan                          keep_last 5, best_effort, volatile
SCAN_RAW              topic    /lidar/scan_raw            sensor_msgs/msg/LaserScan                          keep_last 5, best_effort, volatile
SENSOR_DATA           topic    /sensor_data               my_robot_interfaces/msg/SensorData                 keep_last 10, reliable, volatile
SIT                   service  /spot/sit                  std_srvs/srv/Trigger                               -
STAND                 service  /spot/stand                std_srvs/srv/Trigger                               -
TELEOP_CMD            topic    /teleop/cmd_vel            geometry_msgs/msg/Twist                            keep_last 10, reliable, volatile
TF                    topic    /tf                        tf2_msgs/msg/TFMessage                             keep_last 100, reliable, volatile
TF_STATIC             topic    /tf_static                 tf2_msgs/msg/TFMessage                             keep_last 100, reliable, transient_local
TELEOP_CMD_STAMPED    topic    /teleop/cmd_vel_stamped    geometry_msgs/msg/TwistStamped                     keep_last 10, reliable, volatile
UNDOCK                action   /undock                    robactor_msgs/action/Dock                          -
VOICE                 topic    /voice_command             std_msgs/msg/String                                keep_last 10, reliable, volatile
WALK                  service  /spot/walk                 std_srvs/srv/Trigger                               -
"""

TUTORIALS = """
add_two_ints.ADD_TWO_INTS              service  /add_two_ints            example_interfaces/srv/AddTwoInts               -
battery_service.GET_BATTERY_STATUS     service  /get_battery_status      my_robot_interfaces/srv/GetBatteryStatus        -
calibration.CALIBRATE_SENSOR           service  calibrate_sensor         your_package/srv/SensorCalibration              -
camera_detector.CMD_VEL                topic    /cmd_vel                 geometry_msgs/msg/Twist                         keep_last 10, reliable, volatile
camera_detector.DETECTIONS             topic    /detections              robactor_msgs/msg/Detection                     keep_last 10, reliable, volatile
camera_detector.IMAGE                  topic    /camera/image            sensor_msgs/msg/Image                           keep_last 5, best_effort, volatile
camera_topics.CAMERA_RGB               topic    /camera/rgb              sensor_msgs/msg/Image                           keep_last 5, best_effort, volatile
communication_demo.ALERT               topic    temperature_alert        std_msgs/msg/String                             keep_last 10, reliable, volatile
communication_demo.AVERAGE             service  get_average_temperature  proposed_interfaces/srv/GetAverageTemperature   -
communication_demo.ROBOT_STATUS        topic    robot_status             std_msgs/msg/String                             keep_last 10, reliable, volatile
communication_demo.TEMPERATURE         topic    temperature              std_msgs/msg/Float32                            keep_last 10, reliable, volatile
distance_service.CALCULATE_DISTANCE    service  calculate_distance       my_robot_pkg/srv/CalculateDistance              -
fibonacci.FIBONACCI                    action   fibonacci                my_robot_pkg/action/Fibonacci                   -
humanoid_lab.MOTOR_COMMANDS            topic    /motor/commands          humanoid_control_interfaces/msg/MotorCommand    keep_last 10, reliable, volatile
humanoid_lab.PLAN_TRAJECTORY           service  plan_trajectory          humanoid_control_interfaces/srv/PlanTrajectory  -
humanoid_lab.SENSOR_DATA               topic    /sensor/data             humanoid_control_interfaces/msg/SensorData      keep_last 10, reliable, volatile
humanoid_navigation.HUMANOID_NAVIGATE  action   humanoid_navigate        your_package/action/HumanoidNav                 -
imu_publisher.IMU                      topic    /imu/data                sensor_msgs/msg/Imu                             keep_last 5, best_effort, volatile
map_sweep.SWEEP                        action   sweep_map                robot/action/Sweep                              -
minimal_service.ADD_TWO_INTS           service  add_two_ints             example_interfaces/srv/AddTwoInts               -
motor_controller.MOTOR_VELOCITY        topic    motor_velocity           std_msgs/msg/Float64                            keep_last 10, reliable, volatile
move_to_position.MOVE_TO_POSITION      action   /move_to_position        my_robot_interfaces/action/MoveToPosition       -
navigate_stand_in.NAVIGATE_TO_GOAL     action   navigate_to_goal         example_interfaces/action/Fibonacci             -
physical_ai.CONTROL_COMMAND            service  control_command          std_srvs/srv/SetBool                            -
physical_ai.ROBOT_STATUS               topic    robot_status             std_msgs/msg/String                             keep_last 10, reliable, volatile
physical_ai.SENSOR_INPUT               topic    sensor_input             std_msgs/msg/Float32                            keep_last 10, reliable, volatile
physical_ai.SENSOR_TEXT                topic    sensor_input             std_msgs/msg/String                             keep_last 10, reliable, volatile
planner_service.ADD_TO_PLAN            service  plan_path                example_interfaces/srv/AddTwoInts               -
planner_service.PLAN_PATH              service  plan_path                humanoid_control_interfaces/srv/PlanPath        -
robot_arm.ARM_STATE                    topic    arm_state                robactor_msgs/msg/ArmState                      keep_last 1, reliable, transient_local
robot_arm.GET_CURRENT_POSITION         service  get_current_position     robot_arm_control/srv/GetPosition               -
robot_arm.MOVE_ARM                     action   move_arm                 robot_arm_control/action/MoveArm                -
robot_status.GET_STATUS                service  /robot/get_status        std_srvs/srv/Trigger                            -
sensor_data.SENSOR_DATA                topic    /sensor_data             my_robot_interfaces/msg/SensorData              keep_last 10, reliable, volatile
sensor_fusion.FUSED                    topic    /sensor/fused            sensor_msgs/msg/Image                           keep_last 10, reliable, volatile
sensor_pair.CMD_VEL                    topic    /cmd_vel                 geometry_msgs/msg/Twist                         keep_last 1, reliable, volatile
sensor_pair.IMAGE                      topic    /camera/image_raw        sensor_msgs/msg/Image                           keep_last 5, best_effort, volatile
sensor_pair.JOINT_STATES               topic    /joint_states            sensor_msgs/msg/JointState                      keep_last 10, reliable, volatile
sensor_pair.PRESSURE                   topic    /pressure_sensor         std_msgs/msg/Float32                            keep_last 10, reliable, volatile
slow_processor.READINGS                topic    readings                 std_msgs/msg/Int32                              keep_last 5, reliable, volatile
spot_controller.CMD_VEL                topic    /cmd_vel                 geometry_msgs/msg/Twist                         keep_last 10, reliable, volatile
spot_controller.IMU                    topic    /imu/data                sensor_msgs/msg/Imu                             keep_last 5, best_effort, volatile
spot_controller.JOINT_STATES           topic    /joint_states            sensor_msgs/msg/JointState                      keep_last 10, reliable, volatile
spot_controller.SIT                    service  /spot/sit                std_srvs/srv/Trigger                            -
spot_controller.STAND                  service  /spot/stand              std_srvs/srv/Trigger                            -
spot_controller.WALK                   service  /spot/walk               std_srvs/srv/Trigger                            -
talker_listener.CHATTER                topic    /chatter                 std_msgs/msg/String                             keep_last 10, reliable, volatile
text_topics.MOTOR_COMMANDS             topic    motor_commands           std_msgs/msg/String                             keep_last 10, reliable, volatile
text_topics.SENSOR_DATA                topic    sensor_data              std_msgs/msg/String                             keep_last 10, reliable, volatile
velocity_trio.CMD_VEL                  topic    /cmd_vel                 geometry_msgs/msg/Twist                         keep_last 10, reliable, volatile
"""


def rows(table: str) -> dict[str, list[str]]:
    """Contract -> kind, name, type, profile."""
    return {line.split()[0]: line.split(maxsplit=4)[1:] for line in table.strip().splitlines()}


def described(contract: Any) -> list[str]:
    """The same of a contract."""
    profile = repr(contract.qos).removeprefix("QoS(").removesuffix(")") if isinstance(contract, Topic) else "-"
    return [KINDS[type(contract)], contract.name, contract.type.__ros_type__, profile]


def contracts_of(module: ModuleType) -> dict[str, Any]:
    return {name: value for name, value in vars(module).items() if type(value) in KINDS}


def tutorial_contracts() -> dict[str, Any]:
    """`module.NAME` of every contract that a tutorial declares or takes from others."""
    names = [module.name for module in pkgutil.iter_modules(tutorials.__path__) if module.name != "__main__"]
    modules = {name: importlib.import_module(f"robot.tutorials.{name}") for name in names}
    return {f"{name}.{key}": value for name, module in modules.items() for key, value in contracts_of(module).items()}


@pytest.mark.parametrize("name", rows(ROBOT))
def test_a_contract_of_the_robot_is_as_it_is_written_here(name: str) -> None:
    assert described(contracts_of(contracts)[name]) == rows(ROBOT)[name]


@pytest.mark.parametrize("name", rows(TUTORIALS))
def test_a_contract_of_the_tutorials_is_as_it_is_written_here(name: str) -> None:
    assert described(tutorial_contracts()[name]) == rows(TUTORIALS)[name]


def test_the_robots_own_contracts_come_first_and_use_no_type_of_the_tutorials() -> None:
    theirs = {path.name for path in (Path(tutorial_types.__file__).parent / "share").iterdir()}
    assert len(theirs) == 6
    sections = [
        "tutorials" if described(one)[2].split("/")[0] in theirs else "own" for one in contracts_of(contracts).values()
    ]
    assert (sections.count("own"), sections.count("tutorials")) == (69, 12)
    assert sections == sorted(sections)


def test_importing_the_robots_own_types_does_not_make_those_of_the_tutorials_known() -> None:
    program = (
        "import robot.interfaces; from actors.interfaces import known_names; names = known_names();"
        "print(sum(n.startswith('robactor_msgs/') for n in names), sum(n.startswith('my_robot_interfaces/') for n in names))"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["18", "0"]


def test_every_contract_has_a_row() -> None:
    assert contracts_of(contracts).keys() == rows(ROBOT).keys()
    assert tutorial_contracts().keys() == rows(TUTORIALS).keys()
