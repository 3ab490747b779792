"""What is meant by names, patterns and types."""

from __future__ import annotations

import pytest

from actors.bag import Selection
from actors.bag.selection import EVERYTHING, action_of, service_of

TOPICS = {
    "/scan": "sensor_msgs/msg/LaserScan",
    "/camera/image": "sensor_msgs/msg/Image",
    "/camera/info": "sensor_msgs/msg/CameraInfo",
    "/_hidden": "std_msgs/msg/String",
    "/add/_service_event": "example_interfaces/srv/AddTwoInts_Event",
    "/dock/_service_event": "std_srvs/srv/Trigger_Event",
    "/move/_action/feedback": "example_interfaces/action/Fibonacci_FeedbackMessage",
    "/move/_action/send_goal/_service_event": "example_interfaces/action/Fibonacci_SendGoal_Event",
}


def taken(selection: Selection) -> list[str]:
    return [name for name, type in TOPICS.items() if selection.takes(name, type)]


@pytest.mark.parametrize(
    ("selection", "expected"),
    [
        (Selection(), []),
        (EVERYTHING, list(TOPICS)),
        (Selection(all_topics=True), ["/scan", "/camera/image", "/camera/info"]),
        (Selection(all_topics=True, hidden=True), ["/scan", "/camera/image", "/camera/info", "/_hidden"]),
        (Selection(topics=["scan", "/_hidden"]), ["/scan", "/_hidden"]),
        (Selection(topics=["/add/_service_event"]), ["/add/_service_event"]),
        (Selection(types=["sensor_msgs/msg/Image"]), ["/camera/image"]),
        (Selection(regex="camera"), ["/camera/image", "/camera/info"]),
        (Selection(regex="^/(scan|add)$"), ["/scan", "/add/_service_event"]),
        (Selection(regex="move"), ["/move/_action/feedback", "/move/_action/send_goal/_service_event"]),
        (Selection(all_topics=True, exclude_regex="ima"), ["/scan", "/camera/info"]),
        (Selection(all_topics=True, exclude_topics=["scan"]), ["/camera/image", "/camera/info"]),
        (Selection(all_topics=True, exclude_types=["sensor_msgs/msg/Image"]), ["/scan", "/camera/info"]),
        (Selection(all_services=True), ["/add/_service_event", "/dock/_service_event"]),
        (Selection(services=["/add"]), ["/add/_service_event"]),
        (Selection(all_services=True, exclude_services=["dock"]), ["/add/_service_event"]),
        (Selection(all_services=True, exclude_regex="add"), ["/dock/_service_event"]),
        (Selection(actions=["move"]), ["/move/_action/feedback", "/move/_action/send_goal/_service_event"]),
        (Selection(all_actions=True, exclude_actions=["/move"]), []),
        (Selection(all_actions=True, exclude_regex="m"), []),
        (Selection(topics=["/scan"], exclude_regex="scan"), []),
    ],
)
def test_what_a_selection_takes(selection: Selection, expected: list[str]) -> None:
    assert taken(selection) == expected


def test_topics_of_services_and_actions_are_known_by_their_names() -> None:
    assert service_of("/a/b/_service_event") == "/a/b"
    assert service_of("/a/b") is None
    assert service_of("/move/_action/send_goal/_service_event") is None
    assert action_of("/move/_action/send_goal/_service_event") == "/move"
    assert action_of("/move") is None
    assert Selection(topics=["scan"]).names == {"/scan"}


def test_a_pattern_that_is_none_is_refused() -> None:
    with pytest.raises(ValueError, match=r"'\(' is no regular expression"):
        Selection(regex="(")


def test_what_is_given_by_name_and_is_not_there_is_named_with_what_is_near() -> None:
    selection = Selection(topics=["/scan", "/skan"], services=["/add"], actions=["/mov"])
    assert list(selection.absent(TOPICS)) == [
        "topic /skan; did you mean '/scan'?",
        "action /mov; did you mean '/move'?",
    ]
