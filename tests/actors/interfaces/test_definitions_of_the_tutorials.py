"""The interfaces that the tutorials define or use: every field, in its order, as their documents print them."""

from __future__ import annotations

import pytest

import robot.interfaces.tutorials  # noqa: F401  # its packages are known by name from here on
from actors import Node, Topic
from actors.interfaces import definition_text
from actors.interfaces.action_msgs.srv import CancelGoal
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.std_msgs.msg import Empty
from actors.interfaces.std_srvs.srv import SetBool
from actors.testing import Rig
from robot.interfaces.tutorials.my_robot_pkg.action import Fibonacci as OwnFibonacci

DEFINITIONS = {
    "std_srvs/srv/SetBool": "bool data --- bool success; string message",
    "example_interfaces/action/Fibonacci": "int32 order --- int32[] sequence --- int32[] sequence",
    "rcl_interfaces/msg/SetParametersResult": "bool successful; string reason",
    "action_msgs/srv/CancelGoal": "GoalInfo goal_info --- int8 return_code; GoalInfo[] goals_canceling",
    "my_robot_interfaces/msg/SensorData": (
        "std_msgs/Header header; float32 temperature; float32 humidity; float32 battery_voltage; bool emergency_stop; string status_message"
    ),
    "humanoid_control_interfaces/msg/SensorData": (
        "std_msgs/Header header; float64 position_x; float64 position_y; float64 velocity_x; float64 velocity_y"
    ),
    "humanoid_control_interfaces/msg/MotorCommand": (
        "std_msgs/Header header; float64 left_motor_velocity; float64 right_motor_velocity"
    ),
    "my_robot_interfaces/srv/GetBatteryStatus": (
        "string robot_id --- float32 voltage; float32 percentage; float32 estimated_runtime_minutes; string health_status; bool is_charging"
    ),
    "your_package/srv/SensorCalibration": "string sensor_name; bool reset_only --- bool success; string message",
    "humanoid_control_interfaces/srv/PlanTrajectory": (
        "geometry_msgs/Point start; geometry_msgs/Point goal --- nav_msgs/Path trajectory; bool success"
    ),
    "humanoid_control_interfaces/srv/PlanPath": (
        "geometry_msgs/PoseStamped start; geometry_msgs/PoseStamped goal --- nav_msgs/Path path; bool success; string message"
    ),
    "my_robot_pkg/srv/CalculateDistance": (
        "float64 x1; float64 y1; float64 x2; float64 y2 --- float64 distance; bool success; string message"
    ),
    "robot_arm_control/srv/GetPosition": " --- float64[] joint_angles; string arm_status",
    "my_robot_interfaces/action/MoveToPosition": (
        "float32 target_x; float32 target_y; float32 target_theta"
        " --- bool success; float32 final_x; float32 final_y; float32 total_time_seconds; string message"
        " --- float32 current_x; float32 current_y; float32 distance_remaining; float32 estimated_time_remaining"
    ),
    "your_package/action/HumanoidNav": (
        "float64[] target_position; bool avoid_obstacles --- bool success; float64[] final_position; string message"
        " --- int32 current_waypoint; float64[] current_position; float64 distance_remaining; string status_message"
    ),
    "humanoid_control_interfaces/action/NavigateToGoal": (
        "geometry_msgs/PoseStamped target_pose --- bool success; string message; float32 total_distance"
        " --- geometry_msgs/PoseStamped current_pose; float32 distance_remaining; float32 progress_percent"
    ),
    "robot_arm_control/action/MoveArm": (
        "float64[] target_angles --- bool success; float64[] final_angles; string message"
        " --- float64[] current_angles; float64 progress_percentage; string status"
    ),
    "my_robot_pkg/action/Fibonacci": "int32 order --- int32[] sequence --- int32[] sequence",
}
"""Sections are separated by ---, fields by semicolons."""


def fields(name: str) -> str:
    """The definition without comments and blank lines, in the notation above."""
    lines = [line.partition("#")[0].strip() for line in definition_text(name).splitlines()]
    sections: list[list[str]] = [[]]
    for line in filter(None, lines):
        if line == "---":
            sections.append([])
        elif "=" not in line:  # a constant is no field
            sections[-1].append(" ".join(line.split()))
    return " --- ".join("; ".join(section) for section in sections)


@pytest.mark.parametrize("name", DEFINITIONS)
def test_a_definition_has_the_fields_of_its_document_in_their_order(name: str) -> None:
    assert fields(name) == DEFINITIONS[name]


def test_a_service_and_an_action_bring_their_parts_as_classes_of_their_own() -> None:
    assert SetBool.Request is not SetBool.Response
    assert SetBool.Request(data=True).data
    assert SetBool.Response(success=True, message="on").message == "on"
    parts = {Fibonacci.Goal, Fibonacci.Result, Fibonacci.Feedback}
    assert len(parts) == 3
    assert Fibonacci.Goal(order=3).order == 3


def test_the_result_of_setting_parameters_can_be_imported_from_the_parameters() -> None:
    from actors.parameters import SetParametersResult

    refusal = SetParametersResult(successful=False, reason="max_velocity must be between 0.0 and 10.0")
    assert (refusal.successful, refusal.reason) == (False, "max_velocity must be between 0.0 and 10.0")


def test_the_answer_to_a_cancel_lists_the_goals_that_are_being_canceled() -> None:
    assert CancelGoal.Response().goals_canceling == ()


def test_both_fibonacci_types_are_there_and_differ() -> None:
    assert OwnFibonacci is not Fibonacci
    assert OwnFibonacci.__ros_type__ == "my_robot_pkg/action/Fibonacci"
    assert Fibonacci.__ros_type__ == "example_interfaces/action/Fibonacci"


async def test_an_empty_message_runs_the_callback_once(rig: Rig) -> None:
    class Counter(Node):
        def __init__(self) -> None:
            self.calls: list[Empty] = []

        @Topic(Empty, "reset").on()
        def count(self, message: Empty) -> None:
            self.calls.append(message)

    await rig.start(Counter)
    rig.publish(Topic(Empty, "reset"), Empty())
    await rig.quiet()
    assert rig.node(Counter).calls == [Empty()]
