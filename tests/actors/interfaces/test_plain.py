"""Messages as plain data and back."""

from __future__ import annotations

from typing import Any

import pytest

from actors.interfaces import MessageTypeError, MessageValueError, from_plain, to_plain
from actors.interfaces.diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from actors.interfaces.geometry_msgs.msg import Point, PoseStamped, Twist
from actors.interfaces.nav_msgs.msg import Path
from actors.interfaces.sensor_msgs.msg import Imu, JointState
from actors.interfaces.std_msgs.msg import Empty, UInt8MultiArray


def test_plain_data_are_dicts_lists_numbers_and_text() -> None:
    path = Path(poses=[PoseStamped()])
    plain = to_plain(path)
    assert plain["header"] == {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""}
    assert plain["poses"][0]["pose"]["orientation"] == {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}
    assert to_plain(UInt8MultiArray(data=b"ab"))["data"] == [97, 98]
    assert to_plain(Empty()) == {}


@pytest.mark.parametrize(
    "message",
    [
        Path(poses=[PoseStamped()]),
        JointState(name=["a"], position=[1]),
        Imu(),
        DiagnosticStatus(values=[KeyValue(key="k")]),
    ],
)
def test_there_and_back(message: Any) -> None:
    assert from_plain(type(message), to_plain(message)) == message


def test_what_is_left_out_keeps_its_default() -> None:
    assert from_plain(Twist, None) == from_plain(Twist, {}) == Twist()
    assert from_plain(Twist, {"linear": None}) == Twist()
    assert from_plain(JointState, {"name": None, "position": None}) == JointState()
    assert from_plain(PoseStamped, {"pose": {"position": Point(x=1.0)}}).pose.position.x == 1.0


@pytest.mark.parametrize(
    ("cls", "data", "text"),
    [
        (
            Twist,
            {"linaer": {}},
            r"Twist: geometry_msgs/msg/Twist has no field 'linaer'; it has linear, angular\. Did you mean 'linear'",
        ),
        (Twist, {"linear": {"x": "fast"}}, r"Twist\.linear\.x: expected float64 .* got str 'fast'"),
        (Twist, {"linear": 3}, r"Twist\.linear: expected the fields of geometry_msgs/msg/Vector3, got 3"),
        (
            Path,
            {"poses": [{}, {"pose": {"position": {"x": []}}}]},
            r"Path\.poses\[1\]\.pose\.position\.x: expected float64",
        ),
        (Path, {"poses": 3}, r"Path\.poses: expected geometry_msgs/PoseStamped\[\]"),
        (Empty, {"a": 1}, "has no field 'a'; it has no fields at all"),
    ],
)
def test_an_error_names_the_path(cls: Any, data: Any, text: str) -> None:
    with pytest.raises(MessageTypeError, match=text):
        from_plain(cls, data)


def test_a_value_out_of_range_names_the_path() -> None:
    with pytest.raises(MessageValueError, match=r"PoseStamped\.header\.stamp\.nanosec: -1 is out of range"):
        from_plain(PoseStamped, {"header": {"stamp": {"nanosec": -1}}})


def test_a_surrogate_pair_is_the_character_that_it_stands_for_and_half_of_one_is_refused() -> None:
    assert from_plain(KeyValue, {"key": "a\ud83d\ude00b", "value": "\u00e4"}) == KeyValue(
        key="a\U0001f600b", value="\u00e4"
    )
    assert from_plain(JointState, {"name": ["\ud83d\ude00", "b"]}).name == ("\U0001f600", "b")
    with pytest.raises(MessageValueError, match=r"KeyValue\.key: .* holds half of a surrogate pair"):
        from_plain(KeyValue, {"key": "a\ud83d"})
