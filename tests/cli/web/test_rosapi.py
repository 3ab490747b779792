"""The questions of rosbridge clients about the graph."""

from __future__ import annotations

from typing import Any

import pytest

from tests.cli.web.stage import serving

QUESTIONS: list[tuple[str, dict[str, Any], dict[str, Any]]] = [
    ("topic_type", {"topic": "chatter"}, {"type": "std_msgs/msg/String"}),
    ("topic_type", {"topic": "/nothing"}, {"type": ""}),
    ("topics_for_type", {"type": "std_msgs/String"}, {"topics": ["/chatter", "/latched"]}),
    ("service_type", {"service": "/add"}, {"type": "example_interfaces/srv/AddTwoInts"}),
    ("service_type", {"service": "/talker/set_parameters"}, {"type": "rcl_interfaces/srv/SetParameters"}),
    ("services_for_type", {"type": "example_interfaces/AddTwoInts"}, {"services": ["/add"]}),
    ("service_node", {"service": "/add"}, {"node": "/worker"}),
    ("service_node", {"service": "/talker/set_parameters"}, {"node": "/talker"}),
    ("service_providers", {"service": "/add"}, {"providers": ["/worker"]}),
    ("nodes", {}, {"nodes": ["/talker", "/worker"]}),
    ("publishers", {"topic": "/chatter"}, {"publishers": ["/talker"]}),
    ("subscribers", {"topic": "/chatter"}, {"subscribers": []}),
    ("action_servers", {}, {"action_servers": ["/count"]}),
    ("action_type", {"action": "/count"}, {"type": "example_interfaces/action/Fibonacci"}),
    ("get_param", {"name": "/talker:speed"}, {"value": "0.5", "successful": True, "reason": ""}),
    ("get_param", {"name": "/talker:label"}, {"value": '"red"', "successful": True, "reason": ""}),
    ("get_param", {"name": "/talker:none", "default_value": "7"}, {"value": "7", "successful": False, "reason": "/talker:none is not set"}),
    ("has_param", {"name": "/talker:speed"}, {"exists": True}),
    ("has_param", {"name": "/talker:none"}, {"exists": False}),
    ("get_ros_version", {}, {"version": 2, "distro": "lyrical"}),
]  # fmt: skip


@pytest.mark.parametrize(("name", "args", "values"), QUESTIONS, ids=[f"{name} {args}" for name, args, _ in QUESTIONS])
async def test_a_question_is_answered(name: str, args: dict[str, Any], values: dict[str, Any]) -> None:
    async with serving() as stage, stage.rosbridge() as client:
        for spelling in (f"/rosapi/{name}", f"rosapi/{name}"):
            answer = await client.call(spelling, args)
            assert (answer["result"], answer["values"]) == (True, values)


async def test_the_lists_of_topics_and_services_have_what_the_nodes_have() -> None:
    async with serving() as stage, stage.rosbridge() as client:
        topics = (await client.call("/rosapi/topics"))["values"]
        pairs = dict(zip(topics["topics"], topics["types"], strict=True))
        assert pairs["/chatter"] == "std_msgs/msg/String" and pairs["/rosout"] == "rcl_interfaces/msg/Log"
        assert not any("_action" in name for name in pairs)
        services = (await client.call("/rosapi/services"))["values"]["services"]
        assert "/add" in services and "/talker/describe_parameters" in services
        raw = (await client.call("/rosapi/topics_and_raw_types"))["values"]
        assert raw["typedefs_full_text"][raw["topics"].index("/chatter")] == "string data\n"
        details = (await client.call("/rosapi/node_details", {"node": "/talker"}))["values"]
        assert "/chatter" in details["publishing"] and "/talker/get_parameters" in details["services"]


async def test_a_type_is_described_with_the_types_in_it() -> None:
    async with serving() as stage, stage.rosbridge() as client:
        answer = (await client.call("/rosapi/message_details", {"type": "geometry_msgs/Polygon"}))["values"]["typedefs"]
        assert [one["type"] for one in answer] == ["geometry_msgs/msg/Polygon", "geometry_msgs/msg/Point32"]
        assert answer[0]["fieldnames"] == ["points"] and answer[0]["fieldarraylen"] == [0]
        assert answer[1]["fieldtypes"] == ["float32"] * 3 and answer[1]["fieldarraylen"] == [-1] * 3
        goal = await client.call("/rosapi/action_goal_details", {"type": "example_interfaces/action/Fibonacci"})
        assert goal["values"]["typedefs"][0]["fieldnames"] == ["order"]
        parts = [
            await client.call(f"/rosapi/service_{part}_details", {"type": "example_interfaces/AddTwoInts"})
            for part in ("request", "response")
        ]
        assert [part["values"]["typedefs"][0]["fieldnames"] for part in parts] == [["a", "b"], ["sum"]]
        status = await client.call("/rosapi/message_details", {"type": "diagnostic_msgs/DiagnosticStatus"})
        assert (
            dict(zip(*(status["values"]["typedefs"][0][key] for key in ("constnames", "constvalues")), strict=True))[
                "STALE"
            ]
            == "3"
        )


async def test_a_parameter_is_set_and_refused_with_the_reason() -> None:
    async with serving() as stage, stage.rosbridge() as client:
        assert (await client.call("/rosapi/set_param", {"name": "/talker:speed", "value": "1"}))["result"] is True
        assert stage.talker.speed == 1.0
        answer = await client.call("/rosapi/set_param", {"name": "/talker:speed", "value": "3.5"})
        assert answer["result"] is False and "out of range" in answer["values"]
        assert (await client.call("/rosapi/set_param", {"name": "/talker:label", "value": '"blue"'}))["result"] is True
        assert stage.talker.label == "blue"
        names = (await client.call("/rosapi/get_param_names"))["values"]["names"]
        assert "/talker:gains" in names
        assert (await client.call("/rosapi/delete_param", {"name": "/talker:speed"}))["result"] is False
        for service in ("get_param", "has_param", "set_param", "delete_param"):
            answer = await client.call(f"/rosapi/{service}", {"name": "/speed", "value": "1"})
            assert (answer["result"], answer["values"]) == (False, "'/speed' is no parameter: write /node:name")


async def test_the_time_has_the_names_of_both_ros_versions() -> None:
    async with serving() as stage, stage.rosbridge() as client:
        before = stage.system.clock.wall_ns()
        time = (await client.call("/rosapi/get_time"))["values"]["time"]
        assert (time["sec"], time["nanosec"]) == (time["secs"], time["nsecs"])
        assert before <= time["sec"] * 10**9 + time["nanosec"] <= stage.system.clock.wall_ns()


async def test_a_question_that_nobody_knows_is_refused_with_the_nearest_one() -> None:
    async with serving() as stage, stage.rosbridge() as client:
        answer = await client.call("/rosapi/topic_typ", {})
        assert answer["result"] is False and "topic_type" in answer["values"]
