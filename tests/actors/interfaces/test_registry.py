"""Types by their ROS names, and the types that ROS derives from services and actions."""

from __future__ import annotations

from pathlib import Path
from typing import Any
from unittest.mock import patch

import pytest

from actors.interfaces import (
    UnknownInterface,
    get_action,
    get_message,
    get_service,
    known_names,
    lookup,
    registry,
    type_hash,
    type_name,
)
from actors.interfaces.action_msgs.msg import GoalStatus
from actors.interfaces.derived import event_message, feedback_message, get_result_service, send_goal_service
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.std_msgs.msg import Header
from actors.interfaces.std_srvs.srv import SetBool
from robot.interfaces.tutorials.my_robot_interfaces.msg import SensorData


def test_both_spellings_of_a_name_mean_the_same_class() -> None:
    assert get_message("std_msgs/Header") is get_message("std_msgs/msg/Header") is Header
    assert get_service("std_srvs/SetBool") is get_service("std_srvs/srv/SetBool") is SetBool
    assert get_action("example_interfaces/Fibonacci") is Fibonacci
    assert SensorData.__ros_fields__[0].message is Header


def test_every_definition_that_ships_is_a_usable_type() -> None:
    getters: dict[str, Any] = {"msg": get_message, "srv": get_service, "action": get_action}
    shipped = [name for name in known_names() if not name.startswith(("tests/", "my_pkg/", "other/"))]
    assert len(shipped) >= 247
    for name in shipped:
        cls = getters[name.split("/")[1]](name)
        assert type_name(cls) == name
        assert type_hash(cls).startswith("RIHS01_")


def test_two_types_of_one_name_in_two_packages_are_two_types() -> None:
    other = get_message("humanoid_control_interfaces/msg/SensorData")
    assert other is not SensorData
    assert type_hash(other) != type_hash(SensorData)


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("std_msgs/Heder", r"unknown message 'std_msgs/Heder'\. Did you mean 'std_msgs/msg/Header'"),
        ("std_msg/Header", r"no package 'std_msg' is known here\. Did you mean 'std_msgs'"),
        ("Header", r"'Header' is not the name of a type; write package/msg/Name"),
        ("std_msgs//Header", "is not the name of a type"),
        ("std_msgs/message/Header", "is not the name of a type"),
        ("std_srvs/srv/SetBool", "is not a message but belongs to srv"),
    ],
)
def test_an_unknown_name_is_answered_with_the_closest_ones(name: str, text: str) -> None:
    with pytest.raises(UnknownInterface, match=text):
        get_message(name)


def test_a_message_is_no_service_and_no_action() -> None:
    with pytest.raises(UnknownInterface, match="is not a service but belongs to msg"):
        get_service("std_msgs/msg/Header")
    with pytest.raises(UnknownInterface, match="unknown action"):
        get_action("std_msgs/Header")
    with pytest.raises(UnknownInterface, match="unknown type 'std_msgs/Heder'"):
        type_hash("std_msgs/Heder")


def test_the_parts_of_services_and_actions_have_names_too() -> None:
    assert get_message("std_srvs/srv/SetBool_Request") is SetBool.Request
    assert get_message("example_interfaces/action/Fibonacci_Goal") is Fibonacci.Goal


def test_derived_types_are_made_once_and_found_by_name() -> None:
    event = event_message(SetBool)
    assert event is event_message(SetBool) is get_message("std_srvs/srv/SetBool_Event")
    assert [str(field) for field in event.__ros_fields__] == [
        "service_msgs/ServiceEventInfo info",
        "std_srvs/SetBool_Request[<=1] request",
        "std_srvs/SetBool_Response[<=1] response",
    ]
    feedback = feedback_message(Fibonacci)
    assert feedback is get_message("example_interfaces/action/Fibonacci_FeedbackMessage")
    assert feedback(feedback=Fibonacci.Feedback(sequence=[1, 1])).feedback.sequence.tolist() == [1, 1]  # type: ignore[attr-defined]
    send: Any = send_goal_service(Fibonacci)
    assert get_service("example_interfaces/action/Fibonacci_SendGoal") == send
    assert send.Request(goal=Fibonacci.Goal(order=5)).goal.order == 5
    result: Any = get_result_service(Fibonacci)
    assert result.Response(status=GoalStatus.STATUS_SUCCEEDED).status == 4
    assert get_message("example_interfaces/action/Fibonacci_GetResult_Response") is result.Response
    assert get_message("example_interfaces/action/Fibonacci_SendGoal_Event") is event_message(send)


@pytest.mark.parametrize(
    "name",
    [
        "std_srvs/srv/SetBool_FeedbackMessage",
        "example_interfaces/action/Fibonacci_Event",
        "std_msgs/msg/Header_Event",
        "std_srvs/srv/SetBool_SendGoal_Request",
        "example_interfaces/action/Fibonacci_SendGoal_Result",
        "nowhere/srv/Nothing_Event",
    ],
)
def test_what_is_not_derived_from_a_type_is_unknown(name: str) -> None:
    with pytest.raises(UnknownInterface):
        get_message(name)


def test_derived_types_are_made_when_their_names_are_asked_for_first() -> None:
    derived = ("_SendGoal", "_GetResult", "_FeedbackMessage", "_Event")
    plain = {name: cls for name, cls in registry._types.items() if not any(part in name for part in derived)}
    with patch.object(registry, "_types", plain):
        asked: Any = get_message("example_interfaces/action/Fibonacci_SendGoal_Event")
        assert asked is event_message(send_goal_service(Fibonacci))
        assert get_message("std_srvs/srv/SetBool_Event") is event_message(SetBool)
        assert get_message("example_interfaces/action/Fibonacci_FeedbackMessage") is feedback_message(Fibonacci)


def test_a_folder_may_hold_other_files_and_definitions_without_modules(tmp_path: Path) -> None:
    folder = tmp_path / "loose_pkg" / "msg"
    folder.mkdir(parents=True)
    (folder / "Loose.msg").write_text("int32 x\n")
    (folder / "README.md").write_text("not a definition")
    with patch.object(registry, "_types", dict(registry._types)), patch.object(registry, "_folders", []):
        registry.add_folder(tmp_path, "modules_that_were_never_generated")
        assert [name for name in known_names() if name.startswith("loose_pkg/")] == ["loose_pkg/msg/Loose"]
        loose: Any = get_message("loose_pkg/Loose")
        assert loose(x=3).x == 3


def test_a_generated_module_that_lacks_something_else_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "torn_home" / "torn_pkg").mkdir(parents=True)
    (tmp_path / "torn_home" / "torn_pkg" / "msg.py").write_text("import a_library_that_is_not_installed\n")
    (tmp_path / "share" / "torn_pkg" / "msg").mkdir(parents=True)
    (tmp_path / "share" / "torn_pkg" / "msg" / "Torn.msg").write_text("int32 x\n")
    monkeypatch.syspath_prepend(tmp_path)
    with patch.object(registry, "_types", dict(registry._types)), patch.object(registry, "_folders", []):
        registry.add_folder(tmp_path / "share", "torn_home")
        with pytest.raises(ModuleNotFoundError, match="a_library_that_is_not_installed"):
            get_message("torn_pkg/Torn")


@pytest.mark.parametrize(
    "name", ["", "Hello", "a/b", "a/msg/b/c", "../msg/String", "std_msgs/../String", "std_msgs/msg/*", "a::b"]
)
def test_what_is_no_full_name_is_not_found_and_not_looked_for(name: str) -> None:
    assert lookup.find(name) is None
