"""The small systems of the ROS 2 tutorials, each in one file."""

from __future__ import annotations

from typing import Final

_NODES: Final = {
    "my_first_robot": {
        "sensor_data_publisher": "sensor_data:SensorDataPublisher",
        "battery_server": "battery_service:BatteryServer",
        "battery_service_server": "battery_service:BatteryServer",
        "battery_client": "battery_service:BatteryClient",
        "battery_service_client": "battery_service:BatteryClient",
        "move_action_server": "move_to_position:MoveServer",
        "move_action_client": "move_to_position:MoveClient",
    },
    "communication_demo": {
        "sensor_simulator": "communication_demo:SensorSimulator",
        "processor": "communication_demo:DataProcessor",
        "data_processor": "communication_demo:DataProcessor",
    },
    "my_package": {
        "my_node": "minimal_node:MinimalNode",
        "minimal_node": "minimal_node:MinimalNode",
        "sensor_publisher": "text_topics:SensorPublisher",
        "motor_subscriber": "text_topics:MotorSubscriber",
    },
    "camera_driver": {
        "camera_node": "camera_detector:Camera",
        "camera_publisher": "camera_topics:CameraPublisher",
        "image_processor": "camera_topics:ImageProcessor",
        "detector": "camera_detector:Detector",
        "controller": "camera_detector:Controller",
    },
    "control": {
        "motor_node": "motor_controller:MotorController",
    },
    "planning": {
        "planner_server": "planner_service:PlannerServer",
        "planner_client": "planner_service:PlannerClient",
        "motion_planner": "planner_service:MotionPlanner",
        "navigation_action_server": "navigate_stand_in:NavigationServer",
        "navigation_action_client": "navigate_stand_in:NavigationClient",
    },
    "humanoid_control": {
        "sensor_simulator": "humanoid_lab:SensorSimulator",
        "planner": "humanoid_lab:Planner",
        "motor_controller": "humanoid_lab:MotorController",
    },
    "physical_ai": {
        "physical_ai_node": "physical_ai:PhysicalAi",
        "physical_ai_cpp_node": "physical_ai:PhysicalAiTwin",
        "sensor_publisher": "sensor_pair:SensorPublisher",
        "sensor_subscriber": "sensor_pair:SensorSubscriber",
        "calibration_service": "calibration:CalibrationService",
        "calibration_client": "calibration:CalibrationClient",
        "humanoid_nav_action_server": "humanoid_navigation:HumanoidNavServer",
        "humanoid_nav_action_client": "humanoid_navigation:HumanoidNavClient",
    },
    "my_robot_pkg": {
        "service_server": "minimal_service:MinimalService",
        "service_client": "minimal_service:MinimalClient",
        "minimal_service": "minimal_service:MinimalService",
        "minimal_client": "minimal_service:MinimalClient",
        "distance_service": "distance_service:DistanceService",
        "fibonacci_action_server": "fibonacci:FibonacciServer",
        "fibonacci_action_client": "fibonacci:FibonacciClient",
    },
    "robot_arm_control": {
        "position_service": "robot_arm:PositionService",
        "move_arm_server": "robot_arm:MoveArmServer",
        "arm_control_client": "robot_arm:ArmControlClient",
    },
    "my_robot_controller": {
        "talker": "talker_listener:Talker",
        "listener": "talker_listener:Listener",
        "robot_controller": "robot_controller:tree",
        "imu_publisher": "imu_publisher:ImuPublisher",
        "add_server": "add_two_ints:AddServer",
        "add_client": "add_two_ints:AddClient",
        "robot_status_service": "robot_status:RobotStatusService",
        "spot_controller": "spot_controller:SpotController",
    },
}

EXECUTABLES: Final = {
    package: {name: f"robot.tutorials.{node}" for name, node in nodes.items()} for package, nodes in _NODES.items()
}
"""The executables of the tutorials' packages, by the names under which ROS 2's documents start them:
package -> name -> MODULE:NAME of a node, a tree, or a function that makes one.
"""
