"""Who publishes, takes and serves what in the running robot, with the quality of service of each endpoint, word for word. The contracts
themselves are pinned in `tests.robot.nodes.test_contract_tables`.

In `TOPICS`, ``<-`` is a publisher and ``->`` a subscription: its node, its reliability, ``latched`` if late joiners get what was published, and
its depth. The standard services of every node are left out.
"""

from __future__ import annotations

import re

from actors.graph.snapshot import Snapshot
from actors.testing import Rig
from robot import Robot

TOPICS = """\
/arm/joint_states sensor_msgs/msg/JointState
    <- arm best_effort 5
    -> robot_state_publisher best_effort 1
/autonomy/cmd_vel geometry_msgs/msg/Twist
    <- docking reliable 10
    <- navigation reliable 10
    -> robot_controller reliable 10
/autonomy/cmd_vel_stamped geometry_msgs/msg/TwistStamped
    -> robot_controller reliable 10
/battery_state sensor_msgs/msg/BatteryState
    <- battery reliable latched 1
    -> docking reliable latched 1
    -> patrol reliable latched 1
/battery_status robactor_msgs/msg/BatteryStatus
    <- battery reliable latched 1
    -> diagnostics reliable latched 1
    -> gait reliable latched 1
    -> motors reliable latched 1
    -> navigation reliable latched 1
    -> robot_status reliable latched 1
    -> safety_monitor reliable latched 1
/body_drive robactor_msgs/msg/BodyDrive
    <- gait reliable 1
    -> motors reliable 1
/camera/camera_info sensor_msgs/msg/CameraInfo
    <- camera best_effort 5
/camera/depth sensor_msgs/msg/Image
    <- camera best_effort 5
/camera/detections robactor_msgs/msg/Detection
    <- detector reliable 10
/camera/points sensor_msgs/msg/PointCloud2
    <- camera best_effort 5
/camera/rgb sensor_msgs/msg/Image
    <- camera best_effort 5
/camera/rgb/compressed sensor_msgs/msg/CompressedImage
    <- image_compressor best_effort 5
/cmd_vel geometry_msgs/msg/Twist
    <- robot_controller reliable 10
    -> gait reliable 10
    -> safety_monitor reliable 10
/diagnostics diagnostic_msgs/msg/DiagnosticArray
    <- diagnostics reliable 10
/dock_status robactor_msgs/msg/DockStatus
    <- docking reliable latched 1
/drive_status robactor_msgs/msg/DriveStatus
    <- robot_controller reliable latched 1
/foot_contacts robactor_msgs/msg/FootContacts
    <- proprioception best_effort 5
    -> gait best_effort 5
/gait_status robactor_msgs/msg/GaitStatus
    <- gait reliable latched 1
    -> calibration reliable latched 1
    -> diagnostics reliable latched 1
    -> docking reliable latched 1
    -> fetch reliable latched 1
    -> navigation reliable latched 1
    -> patrol reliable latched 1
    -> robot_status reliable latched 1
    -> safety_monitor reliable latched 1
/global_costmap/costmap nav_msgs/msg/OccupancyGrid
    <- navigation reliable latched 1
/goal_pose geometry_msgs/msg/PoseStamped
    -> navigation reliable 10
/gripper/state robactor_msgs/msg/GripperState
    <- arm reliable latched 1
    -> fetch reliable latched 1
/imu/calibration robactor_msgs/msg/ImuCalibration
    <- calibration reliable latched 1
    -> proprioception reliable latched 1
/imu/data sensor_msgs/msg/Imu
    <- proprioception best_effort 5
/imu/data_raw sensor_msgs/msg/Imu
    <- proprioception best_effort 5
    -> gait best_effort 5
/initialpose geometry_msgs/msg/PoseWithCovarianceStamped
    -> localizer reliable 10
/joint_states sensor_msgs/msg/JointState
    <- proprioception reliable 10
    -> gait reliable 10
    -> robot_state_publisher reliable 1
/joy/cmd_vel geometry_msgs/msg/Twist
    -> robot_controller reliable 10
/lidar/points sensor_msgs/msg/PointCloud2
    <- lidar best_effort 5
/lidar/scan sensor_msgs/msg/LaserScan
    <- lidar best_effort 5
    -> diagnostics best_effort 5
    -> docking best_effort 5
    -> heading best_effort 5
    -> localizer best_effort 5
    -> navigation best_effort 5
    -> robot_controller best_effort 5
/local_costmap/costmap nav_msgs/msg/OccupancyGrid
    <- navigation reliable latched 1
/localization std_msgs/msg/String
    <- localizer reliable latched 1
    -> navigation reliable latched 1
/map nav_msgs/msg/OccupancyGrid
    <- map_server reliable latched 1
/markers visualization_msgs/msg/MarkerArray
    <- markers reliable 10
/mission/goals robactor_msgs/msg/GoalReport
    <- patrol reliable 100
/motor_power robactor_msgs/msg/MotorPower
    <- motors best_effort 5
    -> battery best_effort 5
    -> diagnostics best_effort 5
/motor_targets robactor_msgs/msg/MotorTargets
    <- gait reliable 1
    -> motors reliable 1
/odom nav_msgs/msg/Odometry
    <- gait reliable 10
    -> diagnostics reliable 20
    -> frames reliable 10
    -> heading reliable 10
    -> localizer reliable 10
    -> navigation reliable 20
    -> safety_monitor reliable 1
/odom/heading_error std_msgs/msg/Float64
    <- heading best_effort 5
    -> gait best_effort 5
/plan nav_msgs/msg/Path
    <- navigation reliable latched 1
    -> docking reliable latched 1
    -> markers reliable latched 1
/pose geometry_msgs/msg/PoseStamped
    <- localizer reliable 10
    -> diagnostics reliable 20
    -> docking reliable 20
    -> fetch reliable 1
    -> frames reliable 10
    -> navigation reliable 20
    -> patrol reliable 20
    -> robot_status reliable 20
    -> tutorial_walks reliable 20
/robot_description std_msgs/msg/String
    <- robot_state_publisher reliable latched 1
/safety/state robactor_msgs/msg/SafetyState
    <- safety_monitor reliable latched 1
    -> arm reliable latched 1
    -> diagnostics reliable latched 1
    -> docking reliable latched 1
    -> gait reliable latched 1
    -> navigation reliable latched 1
    -> patrol reliable latched 1
    -> robot_controller reliable latched 1
/sensor_data my_robot_interfaces/msg/SensorData
    -> safety_monitor reliable 10
/teleop/cmd_vel geometry_msgs/msg/Twist
    -> robot_controller reliable 10
/teleop/cmd_vel_stamped geometry_msgs/msg/TwistStamped
    -> robot_controller reliable 10
/tf tf2_msgs/msg/TFMessage
    <- frames reliable 100
    <- robot_state_publisher reliable 100
    -> object_confirmation reliable 100
/tf_static tf2_msgs/msg/TFMessage
    <- frames reliable latched 1
    <- robot_state_publisher reliable latched 1
    -> object_confirmation reliable latched 100
/voice_command std_msgs/msg/String
    -> robot_controller reliable 10
"""

SERVICES = """\
/calibrate_arm your_package/srv/SensorCalibration <- arm
/calibrate_gripper std_srvs/srv/Trigger <- arm
/calibrate_sensor your_package/srv/SensorCalibration <- calibration
/capture_photo std_srvs/srv/Trigger <- camera
/confirm_object_detection robactor_msgs/srv/ConfirmObject <- object_confirmation
/dock robactor_msgs/action/Dock <- docking
/emergency_stop std_srvs/srv/SetBool <- safety_monitor
/fetch_and_carry robactor_msgs/action/FetchAndCarry <- fetch
/get_battery_status my_robot_interfaces/srv/GetBatteryStatus <- battery
/get_current_position robot_arm_control/srv/GetPosition <- arm
/get_place robactor_msgs/srv/GetPlace <- map_server
/get_robot_pose proposed_interfaces/srv/GetRobotPose <- localizer
/gripper std_srvs/srv/SetBool <- arm
/humanoid_navigate your_package/action/HumanoidNav <- tutorial_walks
/move_arm robot_arm_control/action/MoveArm <- arm
/move_to_position my_robot_interfaces/action/MoveToPosition <- tutorial_walks
/navigate_and_grab proposed_interfaces/action/NavigateAndGrab <- fetch
/navigate_through_poses nav2_msgs/action/NavigateThroughPoses <- navigation
/navigate_to_goal humanoid_control_interfaces/action/NavigateToGoal <- tutorial_walks
/navigate_to_pose nav2_msgs/action/NavigateToPose <- navigation
/plan_path humanoid_control_interfaces/srv/PlanPath <- navigation
/relocalize std_srvs/srv/Trigger <- localizer
/robot/enable std_srvs/srv/SetBool <- robot_controller
/robot/get_status std_srvs/srv/Trigger <- robot_status
/robot/restore_config std_srvs/srv/Trigger <- robot_status
/robot/save_config std_srvs/srv/Trigger <- robot_status
/spot/sit std_srvs/srv/Trigger <- gait
/spot/stand std_srvs/srv/Trigger <- gait
/spot/walk std_srvs/srv/Trigger <- gait
/undock robactor_msgs/action/Dock <- docking
"""


STANDARD = ("get_parameters", "set_parameters", "set_parameters_atomically", "list_parameters", "describe_parameters",
            "get_parameter_types", "get_type_description")  # fmt: skip


def endpoint(node: str, qos: str) -> str:
    """``gait reliable 10``, from what the graph shows."""
    shown = re.fullmatch(r"QoS\(keep_last (\d+), (reliable|best_effort), (volatile|transient_local), automatic\)", qos)
    assert shown, qos
    depth, reliability, durability = shown.groups()
    return " ".join((node[1:], reliability, *(["latched"] if durability == "transient_local" else []), depth))


def shown_topics(snapshot: Snapshot) -> list[str]:
    """A line for each topic with its types, and one for each of its endpoints."""
    lines: list[str] = []
    for topic in snapshot.topics:
        lines.append(f"{topic.name} {' and '.join(topic.types)}")
        for arrow, edges in (("<-", topic.publishers), ("->", topic.subscriptions)):
            lines += sorted(f"    {arrow} {endpoint(edge.node, edge.qos)}" for edge in edges)
    return lines


def shown_services(snapshot: Snapshot) -> list[str]:
    """A line for each service and action with its type and the node that serves it, but for the standard services of nodes."""
    served = [one for one in snapshot.services if not one.name.endswith(STANDARD)]
    return sorted(f"{one.name} {one.type} <- {one.server[1:]}" for one in served)


async def test_every_endpoint_of_the_robot_has_the_name_type_and_quality_of_service_that_users_rely_on(
    rig: Rig,
) -> None:
    await rig.start(Robot("kitchen", body="kinematic", seed=1, arm=True, mission="patrol").tree)

    snapshot = rig.system.snapshot()

    assert shown_topics(snapshot) == TOPICS.splitlines()
    assert shown_services(snapshot) == SERVICES.splitlines()
