"""Topics between our nodes and those of zenoh-ros2-sdk and pyzeros, both ways.

Both send a sequence number that begins at 0, where ROS 2 begins at 1, and announce an endpoint before they have declared it, so that a
message sent on sight of the token may be lost (`deliver` sends the first one until it arrives).
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import Any

import pytest

from actors import Topic
from actors.interfaces import from_plain, get_message
from tests.interop.parties import Ours, Program, deliver

pytestmark = [pytest.mark.interop, pytest.mark.realtime]

StartProgram = Callable[[str], Awaitable[Program]]
PROGRAMS = ("with_zenoh_ros2_sdk", "with_pyzeros")

HEADER = {"stamp": {"sec": 12, "nanosec": 345}, "frame_id": "base_link"}
XYZ = {"x": 1.5, "y": -2.25, "z": 1e300}
MESSAGES: dict[str, list[dict[str, Any]]] = {
    "std_msgs/msg/String": [{"data": text} for text in ("first", "Grüße, 世界 🦊", "", "x" * 70_000, "last")],
    "geometry_msgs/msg/Twist": [{"linear": XYZ}, {"linear": {"x": 0.25}, "angular": {"z": -0.5}}],
    "sensor_msgs/msg/Imu": [
        {"header": HEADER},
        {
            "header": HEADER,
            "orientation": {"x": 0.5, "y": 0.5, "z": 0.5, "w": -0.5},
            "orientation_covariance": [0.125 * number for number in range(9)],
            "angular_velocity": XYZ,
            "linear_acceleration_covariance": [-1.0] + 8 * [0.0],
        },
    ],
    "sensor_msgs/msg/LaserScan": [
        {"header": HEADER, "ranges": [1.0, 2.5]},
        {"header": HEADER, "angle_max": 3.0, "ranges": [0.5 * number for number in range(720)], "intensities": []},
    ],
    "sensor_msgs/msg/JointState": [
        {"name": ["one"]},
        {"header": HEADER, "name": ["hip", "knee", "Füße"], "position": [0.5, -0.5, 0.0], "effort": [1e-9]},
    ],
    "sensor_msgs/msg/Image": [
        {"height": 1, "width": 1, "encoding": "mono8", "step": 1, "data": [1]},
        {"header": HEADER, "height": 2, "width": 3, "encoding": "rgb8", "step": 9, "data": list(range(18))},
    ],
}

every_type = pytest.mark.parametrize("type", [pytest.param(type, id=type.split("/")[-1]) for type in MESSAGES])
every_program = pytest.mark.parametrize("program", PROGRAMS)


@every_program
@every_type
async def test_what_we_publish_arrives_there_in_order_and_unchanged(
    program: str, type: str, ours: Ours, start: StartProgram
) -> None:
    there = await start(program)
    await there.do("subscription", topic="/a/topic", type=type, qos={})
    cls = get_message(type)
    publisher = ours.node.publisher(Topic(cls, "/a/topic"))

    await deliver(lambda one: publisher(from_plain(cls, one)), lambda: there.heard("/a/topic"), type, MESSAGES[type])


@every_program
@every_type
async def test_what_is_published_there_arrives_here_in_order_and_unchanged(
    program: str, type: str, ours: Ours, start: StartProgram
) -> None:
    got = ours.listen(Topic(get_message(type), "/a/topic"))
    there = await start(program)
    await there.do("publisher", topic="/a/topic", type=type, qos={})

    await deliver(lambda one: there.do("publish", topic="/a/topic", message=one), lambda: got, type, MESSAGES[type])
