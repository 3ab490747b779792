"""The quality of service of a channel, as rosbag2 writes it and rosbags reads it."""

from __future__ import annotations

import pytest
from rosbags.rosbag2.metadata import parse_qos

from actors import QoS, qos
from actors.bag.qos_text import qos_profiles_text
from actors.qos.policies import History, Liveliness


def test_the_text_has_the_words_of_rosbag2() -> None:
    text = qos_profiles_text([qos.LATCHED.replace(lifespan=1.5)])
    assert text == (
        "- history: keep_last\n  depth: 1\n  reliability: reliable\n  durability: transient_local\n"
        "  deadline:\n    sec: 9223372036\n    nsec: 854775807\n  lifespan:\n    sec: 1\n    nsec: 500000000\n"
        "  liveliness: automatic\n  liveliness_lease_duration:\n    sec: 9223372036\n    nsec: 854775807\n"
        "  avoid_ros_namespace_conventions: false\n"
    )


@pytest.mark.parametrize(
    "offered",
    [
        [],
        [qos.DEFAULT],
        [qos.SENSOR_DATA, qos.LATCHED],
        [qos.SYSTEM_DEFAULT],
        [QoS(history=History.KEEP_ALL)],
        [QoS(depth=3, deadline=0.1, liveliness=Liveliness.MANUAL_BY_TOPIC, liveliness_lease=0.000000001)],
    ],
)
def test_rosbags_reads_what_was_offered(offered: list[QoS]) -> None:
    read = parse_qos(qos_profiles_text(offered))
    assert [(one.history.name.lower(), one.depth) for one in read] == [
        (str(one.history), one.given_depth) for one in map(qos.resolve_publisher, offered)
    ]
    assert [
        (one.reliability.name.lower(), one.durability.name.lower(), one.liveliness.name.lower()) for one in read
    ] == [
        (str(one.reliability), str(one.durability), str(one.liveliness)) for one in map(qos.resolve_publisher, offered)
    ]
    assert [one.deadline.sec * 10**9 + one.deadline.nsec for one in read if one.deadline.sec < 9223372036] == [
        round(one.deadline * 1e9) for one in offered if one.deadline is not None
    ]
