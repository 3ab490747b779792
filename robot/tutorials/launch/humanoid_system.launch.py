"""The three-node lab of `humanoid_lab`, as ROS 2's own launch would start it."""

from launch import LaunchDescription
from launch_ros.actions import Node


def generate_launch_description():
    return LaunchDescription(
        [
            Node(package="humanoid_control", executable="sensor_simulator", name="sensor_simulator"),
            Node(package="humanoid_control", executable="planner", name="planner"),
            Node(package="humanoid_control", executable="motor_controller", name="motor_controller"),
        ]
    )
