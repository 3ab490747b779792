"""Messages as YAML, word for word as `ros2 topic echo` prints them."""

from __future__ import annotations

import numpy as np

from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.geometry_msgs.msg import Twist, Vector3
from actors.interfaces.sensor_msgs.msg import Image, JointState, LaserScan
from actors.interfaces.std_msgs.msg import Bool, Empty, Header, String, UInt8MultiArray
from cli.text import message_yaml


def test_nested_fields_are_indented_by_two_and_keep_the_order_of_their_definition() -> None:
    assert message_yaml(Twist(linear=Vector3(x=0.5), angular=Vector3(z=-0.3))) == (
        "linear:\n  x: 0.5\n  y: 0.0\n  z: 0.0\nangular:\n  x: 0.0\n  y: 0.0\n  z: -0.3\n"
    )


def test_a_sequence_is_a_list_below_its_name_and_an_empty_one_is_two_brackets() -> None:
    message = JointState(header=Header(stamp=Time(sec=3)), name=["hip", "knee"], position=[0.25, 1.0])
    assert message_yaml(message) == (
        "header:\n  stamp:\n    sec: 3\n    nanosec: 0\n  frame_id: ''\nname:\n- hip\n- knee\n"
        "position:\n- 0.25\n- 1.0\nvelocity: []\neffort: []\n"
    )


def test_text_keeps_its_letters_and_is_never_wrapped() -> None:
    assert message_yaml(String(data="grüße " + "x" * 100)) == "data: grüße " + "x" * 100 + "\n"
    assert message_yaml(String(data="on")) == "data: 'on'\n"


def test_bytes_are_numbers() -> None:
    assert message_yaml(UInt8MultiArray(data=b"\x00\xff")).endswith("data:\n- 0\n- 255\n")


def test_true_is_small_and_a_message_without_fields_is_two_braces() -> None:
    assert message_yaml(Bool(data=True)) == "data: true\n"
    assert message_yaml(Empty()) == "{}\n"


def test_long_arrays_and_texts_end_in_dots_after_128() -> None:
    lines = message_yaml(LaserScan(ranges=np.arange(1000.0))).splitlines()
    ranges = lines[lines.index("ranges:") + 1 : lines.index("intensities: []")]
    assert len(ranges) == 129
    assert ranges[-2:] == ["- 127.0", "- '...'"]
    assert message_yaml(String(data="y" * 129)) == "data: " + "y" * 128 + "...\n"
    assert message_yaml(String(data="y" * 128)) == "data: " + "y" * 128 + "\n"


def test_what_is_asked_for_in_full_is_printed_in_full() -> None:
    lines = message_yaml(Image(data=bytes(300)), truncate=None).splitlines()
    assert len(lines[lines.index("data:") + 1 :]) == 300


def test_on_one_line_if_asked_for() -> None:
    assert message_yaml(Vector3(x=1.0), flow=True) == "{x: 1.0, y: 0.0, z: 0.0}\n"
