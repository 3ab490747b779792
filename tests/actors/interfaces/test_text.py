"""Definitions as text: what `interface show` prints and what bags carry."""

from __future__ import annotations

import pytest

import robot.interfaces.tutorials  # noqa: F401  # makes the types of the robot and of the tutorials known
from actors.interfaces import UnknownInterface, definition_text, schema_text, show
from actors.interfaces.std_srvs.srv import SetBool


def test_a_service_is_shown_with_both_sections() -> None:
    assert show("my_robot_interfaces/srv/GetBatteryStatus", comments="none") == (
        "string robot_id\n---\nfloat32 voltage\nfloat32 percentage\nfloat32 estimated_runtime_minutes\n"
        "string health_status\nbool is_charging\n"
    )


def test_the_fields_of_the_sensor_data_are_shown_in_order() -> None:
    lines = show("my_robot_interfaces/msg/SensorData", comments="none").splitlines()
    assert [line for line in lines if not line.startswith("\t")] == [
        "std_msgs/Header header",
        "float32 temperature",
        "float32 humidity",
        "float32 battery_voltage",
        "bool emergency_stop",
        "string status_message",
    ]


def test_nested_types_are_expanded_one_tab_a_level() -> None:
    assert (
        show("std_msgs/msg/Header") == "builtin_interfaces/Time stamp\n\tint32 sec\n\tuint32 nanosec\nstring frame_id\n"
    )
    assert show("std_srvs/srv/SetBool_Event").splitlines()[-5:] == [
        "std_srvs/SetBool_Request[<=1] request",
        "\tbool data",
        "std_srvs/SetBool_Response[<=1] response",
        "\tbool success",
        "\tstring message",
    ]


def test_comments_of_the_top_level_stay_and_others_go_unless_asked_for() -> None:
    action = "my_robot_pkg/action/Fibonacci"
    assert show(action).startswith("# The fields are those of example_interfaces/action/Fibonacci")
    assert "#" not in show(action, comments="none")


def test_the_schema_of_a_bag_has_the_definition_of_every_nested_type_once() -> None:
    schema = schema_text("geometry_msgs/msg/PoseStamped")
    assert schema.startswith("std_msgs/Header header\nPose pose\n" + "=" * 80 + "\nMSG: std_msgs/Header\n")
    assert [line for line in schema.splitlines() if line.startswith("MSG: ")] == [
        "MSG: std_msgs/Header",
        "MSG: geometry_msgs/Pose",
        "MSG: builtin_interfaces/Time",
        "MSG: geometry_msgs/Point",
        "MSG: geometry_msgs/Quaternion",
    ]


def test_the_parts_of_a_service_have_definitions_of_their_own() -> None:
    assert definition_text(SetBool.Response) == "bool success\nstring message\n"
    assert definition_text(SetBool) == "bool data\n---\nbool success\nstring message\n"


def test_an_unknown_type_is_an_error_with_the_closest_names() -> None:
    with pytest.raises(UnknownInterface, match=r"unknown type 'std_msgs/Heder'\. Did you mean 'std_msgs/msg/Header'"):
        show("std_msgs/Heder")


def test_a_type_that_is_nested_twice_stands_once_in_the_schema() -> None:
    lines = schema_text("geometry_msgs/msg/Twist").splitlines()
    assert [line for line in lines if line.startswith("MSG: ")] == ["MSG: geometry_msgs/Vector3"]
