"""`get_type_description`: a type as another process learns it."""

from __future__ import annotations

import json
from hashlib import sha256
from typing import Any

import pytest

from actors import Child, Node, Service, ServiceUnavailable
from actors.interfaces import load, to_plain, type_description
from actors.interfaces.describing import described
from actors.interfaces.type_description_interfaces.srv import GetTypeDescription
from actors.testing import Rig

STRING_HASH = "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
"""Of std_msgs/msg/String, as every ROS 2 announces it."""
ADD_HASH = "RIHS01_e118de6bf5eeb66a2491b5bda11202e7b68f198d6f67922cf30364858239c81a"
"""Of example_interfaces/srv/AddTwoInts."""
SEND_GOAL_HASH = "RIHS01_d1a57fb2a4afe8c21e34fb10db206f16ce6729b28531141472df92277c55b557"
"""Of example_interfaces/action/Fibonacci_SendGoal."""


def ask(name: str, type_hash: str = "", *, sources: bool = True) -> Any:
    return described(GetTypeDescription.Request(type_name=name, type_hash=type_hash, include_type_sources=sources))


def without_defaults(plain: Any) -> Any:
    """Default values are part of a description, and not of the hash."""
    if isinstance(plain, dict):
        return {name: without_defaults(each) for name, each in plain.items() if name != "default_value"}
    return [without_defaults(each) for each in plain] if isinstance(plain, list) else plain


@pytest.mark.parametrize(
    ("name", "type_hash"),
    [
        ("std_msgs/msg/String", STRING_HASH),
        ("example_interfaces/srv/AddTwoInts", ADD_HASH),
        ("example_interfaces/action/Fibonacci_SendGoal", SEND_GOAL_HASH),
    ],
)
def test_what_is_described_has_the_hash_that_ros_2_gives_the_type(name: str, type_hash: str) -> None:
    answer = ask(name, type_hash)
    assert (answer.successful, answer.failure_reason) == (True, "")
    assert answer.type_description.type_description.type_name == name
    canonical = json.dumps(without_defaults(to_plain(answer.type_description)))
    assert f"RIHS01_{sha256(canonical.encode()).hexdigest()}" == type_hash


def test_the_texts_of_the_definitions_are_given_for_the_type_and_all_that_it_contains() -> None:
    answer = ask("geometry_msgs/msg/Vector3Stamped")
    texts = {source.type_name: (source.encoding, source.raw_file_contents) for source in answer.type_sources}
    assert set(texts) == {
        "geometry_msgs/msg/Vector3Stamped",
        "geometry_msgs/msg/Vector3",
        "std_msgs/msg/Header",
        "builtin_interfaces/msg/Time",
    }
    encoding, text = texts["geometry_msgs/msg/Vector3"]
    assert encoding == "msg"
    assert [line.split() for line in text.splitlines() if line] == [
        ["float64", "x"],
        ["float64", "y"],
        ["float64", "z"],
    ]
    assert ask("geometry_msgs/msg/Vector3Stamped", sources=False).type_sources == ()


def test_the_text_of_a_service_is_that_of_its_file() -> None:
    (source,) = [each for each in ask("std_srvs/srv/SetBool").type_sources if each.encoding == "srv"]
    assert source.type_name == "std_srvs/srv/SetBool"
    assert "---" in source.raw_file_contents


@pytest.mark.parametrize(
    ("name", "type_hash", "reason"),
    [
        ("nobodys_msgs/msg/Thing", "", "nobodys_msgs/msg/Thing is not known here"),
        ("String", "", "'String'"),
        ("std_msgs/msg/String", ADD_HASH, f"std_msgs/msg/String has the hash {STRING_HASH} here, not {ADD_HASH}"),
    ],
)
def test_a_type_that_cannot_be_described_is_answered_with_the_reason(name: str, type_hash: str, reason: str) -> None:
    answer = ask(name, type_hash)
    assert not answer.successful
    assert reason in answer.failure_reason
    assert answer.type_sources == ()


class Silent(Node):
    pass


async def test_every_node_describes_types_unless_a_parameter_says_no(rig: Rig) -> None:
    await rig.start(
        Child(Silent, name="open"), Child(Silent, name="shut", parameters={"start_type_description_service": False})
    )
    request = GetTypeDescription.Request(type_name="std_msgs/msg/String", type_hash=STRING_HASH)
    answer = await rig.me.call(Service(GetTypeDescription, "/open/get_type_description"), request)
    assert answer.successful
    with pytest.raises(ServiceUnavailable):
        await rig.me.call(Service(GetTypeDescription, "/shut/get_type_description"), request, timeout=0.5)


def test_a_sequence_of_bounded_wstrings_is_described_as_ros_2_does_it() -> None:
    """rosidl_parser reads `sequence<wstring<3>>` as bounded by 3, and `sequence<string<3>>` as unbounded (Kilted and Lyrical)."""
    cls: Any = load("wstring<=3[] wide\nstring<=3[] words\nwstring<=3[<=7] few", "tests/msg/Odd")
    fields = type_description(cls)["type_description"]["fields"]

    assert [(field["type"]["type_id"], field["type"]["capacity"]) for field in fields] == [(118, 3), (165, 0), (118, 7)]
