"""The tutorials as others meet them: name, type, quality of service and node of every endpoint, word for word. The notation is that of
`tests.robot.test_contracts`.
"""

from __future__ import annotations

from importlib import import_module

import pytest

from actors.testing import Rig
from robot.tutorials.__main__ import summaries
from tests.robot.shown import shown_services, shown_topics

ENDPOINTS = {
    "add_two_ints": """\
/add_two_ints example_interfaces/srv/AddTwoInts <- add_server
""",
    "battery_service": """\
/get_battery_status my_robot_interfaces/srv/GetBatteryStatus <- battery_service_server
""",
    "calibration": """\
/calibrate_sensor your_package/srv/SensorCalibration <- calibration_service
""",
    "camera_detector": """\
/camera/image sensor_msgs/msg/Image
    <- camera best_effort 5
    -> detector best_effort 5
/cmd_vel geometry_msgs/msg/Twist
    <- controller reliable 10
/detections robactor_msgs/msg/Detection
    <- detector reliable 10
    -> controller reliable 10
""",
    "camera_topics": """\
/camera/rgb sensor_msgs/msg/Image
    <- camera_publisher best_effort 5
    -> image_processor best_effort 5
""",
    "communication_demo": """\
/robot_status std_msgs/msg/String
    <- sensor_simulator reliable 10
    -> data_processor reliable 10
/temperature std_msgs/msg/Float32
    <- sensor_simulator reliable 10
    -> data_processor reliable 10
/temperature_alert std_msgs/msg/String
    <- data_processor reliable 10
/get_average_temperature proposed_interfaces/srv/GetAverageTemperature <- data_processor
""",
    "distance_service": """\
/calculate_distance my_robot_pkg/srv/CalculateDistance <- distance_service
""",
    "fibonacci": """\
/fibonacci my_robot_pkg/action/Fibonacci <- fibonacci_action_server
""",
    "humanoid_lab": """\
/motor/commands humanoid_control_interfaces/msg/MotorCommand
    <- motor_controller reliable 10
/sensor/data humanoid_control_interfaces/msg/SensorData
    <- sensor_simulator reliable 10
    -> planner reliable 10
/plan_trajectory humanoid_control_interfaces/srv/PlanTrajectory <- planner
""",
    "humanoid_navigation": """\
/humanoid_navigate your_package/action/HumanoidNav <- humanoid_nav_action_server
""",
    "imu_publisher": """\
/imu/data sensor_msgs/msg/Imu
    <- imu_publisher best_effort 5
""",
    "map_sweep": """\
/sweep_map robot/action/Sweep <- sweep_server
""",
    "minimal_node": """\
""",
    "minimal_service": """\
/add_two_ints example_interfaces/srv/AddTwoInts <- minimal_service
""",
    "motor_controller": """\
/motor_velocity std_msgs/msg/Float64
    <- motor_controller reliable 10
""",
    "move_to_position": """\
/move_to_position my_robot_interfaces/action/MoveToPosition <- move_action_server
""",
    "navigate_stand_in": """\
/navigate_to_goal example_interfaces/action/Fibonacci <- navigation_action_server
""",
    "physical_ai": """\
/robot_status std_msgs/msg/String
    <- physical_ai_cpp_node reliable 10
    <- physical_ai_node reliable 10
/sensor_input std_msgs/msg/Float32 and std_msgs/msg/String
    <- sensor_feed reliable 10
    -> physical_ai_cpp_node reliable 10
    -> physical_ai_node reliable 10
/control_command std_srvs/srv/SetBool <- physical_ai_node
""",
    "planner_service": """\
/plan_path example_interfaces/srv/AddTwoInts <- planner_server
""",
    "ring": """\
/ring/hop_0 std_msgs/msg/Int32
    <- starter reliable 1
    -> link_0 reliable 1
/ring/hop_1 std_msgs/msg/Int32
    <- link_0 reliable 1
    -> link_1 reliable 1
""",
    "robot_arm": """\
/arm_state robactor_msgs/msg/ArmState
    <- move_arm_server reliable latched 1
    -> position_service reliable latched 1
/get_current_position robot_arm_control/srv/GetPosition <- position_service
/move_arm robot_arm_control/action/MoveArm <- move_arm_server
""",
    "robot_controller": """\
/autonomy/cmd_vel geometry_msgs/msg/Twist
    -> robot_controller reliable 10
/cmd_vel geometry_msgs/msg/Twist
    <- robot_controller reliable 10
/drive_status robactor_msgs/msg/DriveStatus
    <- robot_controller reliable latched 1
/joy/cmd_vel geometry_msgs/msg/Twist
    -> robot_controller reliable 10
/safety/state robactor_msgs/msg/SafetyState
    -> robot_controller reliable latched 1
/teleop/cmd_vel geometry_msgs/msg/Twist
    -> robot_controller reliable 10
/voice_command std_msgs/msg/String
    -> robot_controller reliable 10
/robot/enable std_srvs/srv/SetBool <- robot_controller
""",
    "robot_status": """\
/robot/get_status std_srvs/srv/Trigger <- robot_status_service
""",
    "sensor_data": """\
/sensor_data my_robot_interfaces/msg/SensorData
    <- sensor_data_publisher reliable 10
""",
    "sensor_fusion": """\
/sensor/fused sensor_msgs/msg/Image
    <- fused_camera reliable 10
    <- fused_lidar reliable 10
    -> sensor_fusion reliable 10
""",
    "sensor_pair": """\
/camera/image_raw sensor_msgs/msg/Image
    <- sensor_publisher best_effort 5
/cmd_vel geometry_msgs/msg/Twist
    <- sensor_publisher reliable 1
    -> sensor_subscriber reliable 1
/joint_states sensor_msgs/msg/JointState
    <- sensor_publisher reliable 10
    -> sensor_subscriber reliable 10
/pressure_sensor std_msgs/msg/Float32
    -> sensor_subscriber reliable 10
""",
    "slow_processor": """\
/readings std_msgs/msg/Int32
    <- fast_sensor reliable 5
    -> mended_processor reliable 90
    -> slow_processor reliable 5
""",
    "spot_by_voice": """\
/autonomy/cmd_vel geometry_msgs/msg/Twist
    -> robot_controller reliable 10
/cmd_vel geometry_msgs/msg/Twist
    <- robot_controller reliable 10
    -> spot_controller reliable 10
/drive_status robactor_msgs/msg/DriveStatus
    <- robot_controller reliable latched 1
/imu/data sensor_msgs/msg/Imu
    <- imu_publisher best_effort 5
    -> spot_controller best_effort 5
/joint_states sensor_msgs/msg/JointState
    <- spot_controller reliable 10
/joy/cmd_vel geometry_msgs/msg/Twist
    -> robot_controller reliable 10
/safety/state robactor_msgs/msg/SafetyState
    -> robot_controller reliable latched 1
/teleop/cmd_vel geometry_msgs/msg/Twist
    -> robot_controller reliable 10
/voice_command std_msgs/msg/String
    -> robot_controller reliable 10
/robot/enable std_srvs/srv/SetBool <- robot_controller
/spot/sit std_srvs/srv/Trigger <- spot_controller
/spot/stand std_srvs/srv/Trigger <- spot_controller
/spot/walk std_srvs/srv/Trigger <- spot_controller
""",
    "spot_controller": """\
/cmd_vel geometry_msgs/msg/Twist
    -> spot_controller reliable 10
/imu/data sensor_msgs/msg/Imu
    -> spot_controller best_effort 5
/joint_states sensor_msgs/msg/JointState
    <- spot_controller reliable 10
/spot/sit std_srvs/srv/Trigger <- spot_controller
/spot/stand std_srvs/srv/Trigger <- spot_controller
/spot/walk std_srvs/srv/Trigger <- spot_controller
""",
    "talker_listener": """\
/chatter std_msgs/msg/String
    <- talker reliable 10
    -> listener reliable 10
""",
    "text_topics": """\
/motor_commands std_msgs/msg/String
    -> motor_subscriber reliable 10
/sensor_data std_msgs/msg/String
    <- sensor_publisher reliable 10
""",
    "velocity_trio": """\
/cmd_vel geometry_msgs/msg/Twist
    <- autonomy reliable 10
    <- teleop reliable 10
    -> safety_monitor reliable 10
""",
}


FIRST = {"ring": 6}
"""The lines that are compared of a long graph whose names are numbered."""


def test_the_table_has_every_tutorial() -> None:
    assert list(ENDPOINTS) == list(summaries())


@pytest.mark.parametrize("tutorial", ENDPOINTS)
async def test_every_endpoint_has_the_name_type_and_quality_of_service_of_the_document(tutorial: str, rig: Rig) -> None:
    await rig.start(import_module(f"robot.tutorials.{tutorial}").tree())

    snapshot = rig.system.snapshot()

    shown = shown_topics(snapshot) + shown_services(snapshot)
    assert shown[: FIRST.get(tutorial)] == ENDPOINTS[tutorial].splitlines()
