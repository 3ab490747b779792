"""Offered quality of service, read from what different versions of rosbag2 have written."""

from __future__ import annotations

import pytest

from actors import QoS, qos
from actors.bag.qos_text import parse_qos_profiles, qos_from_mapping, qos_profiles_text
from actors.qos import InvalidQoS
from actors.qos.policies import History, Liveliness

JAZZY = """- history: keep_last
  depth: 7
  reliability: best_effort
  durability: volatile
  deadline: {sec: 0, nsec: 100000000}
  lifespan: {sec: 9223372036, nsec: 854775807}
  liveliness: manual_by_topic
  liveliness_lease_duration: {sec: 2, nsec: 500000000}
  avoid_ros_namespace_conventions: false
"""
FOXY = """- history: 1
  depth: 1
  reliability: 1
  durability: 1
  deadline: {sec: 2147483647, nsec: 4294967295}
  lifespan: {sec: 0, nsec: 0}
  liveliness: 1
  liveliness_lease_duration: {sec: 9223372036, nsec: 854775807}
  avoid_ros_namespace_conventions: false
"""


def test_the_words_of_a_new_bag_are_read() -> None:
    assert parse_qos_profiles(JAZZY) == (
        qos.SENSOR_DATA.replace(depth=7, deadline=0.1, liveliness=Liveliness.MANUAL_BY_TOPIC, liveliness_lease=2.5),
    )


def test_the_numbers_of_an_old_bag_are_read() -> None:
    (read,) = parse_qos_profiles(FOXY)
    assert read == qos.LATCHED.replace(liveliness=Liveliness.AUTOMATIC, deadline=read.deadline)
    assert read.transient_local


def test_no_text_is_no_profile() -> None:
    assert parse_qos_profiles("") == ()


@pytest.mark.parametrize(
    "offered", [qos.DEFAULT, qos.SENSOR_DATA, qos.LATCHED, QoS(history=History.KEEP_ALL), qos.ROSOUT, QoS(depth=1)]
)
def test_what_is_written_is_read_again(offered: QoS) -> None:
    resolved = qos.resolve_publisher(offered)
    assert parse_qos_profiles(qos_profiles_text([offered])) == (resolved,)


def test_a_profile_may_leave_out_what_is_usual() -> None:
    assert qos_from_mapping({"reliability": "best_effort"}) == qos.DEFAULT.replace(reliability="best_effort")  # type: ignore[arg-type]
    assert qos_from_mapping({"depth": 0}).depth == 1
    assert qos_from_mapping({"history": "keep_all", "depth": 3}).keep_all


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("- {depth: 1, speed: 3}", "'speed' is no policy of a profile; there are history, reliability"),
        ("- {depth: 1, reliability: sometimes}", "'sometimes' is no reliability policy"),
        ("- {depth: 1, reliability: 9}", "9 is no number of a reliability policy"),
        ("- {depth: 1, deadline: 3}", "deadline is given by sec and nsec, not 3"),
        ("- {depth: 1, deadline: {sec: -1, nsec: 0}}", "deadline cannot be negative"),
        ("- 3", "a profile is a mapping of policies, not 3"),
        ("depth: 1", "a list of profiles, not {'depth': 1}"),
        ("{", "cannot be read: it is no YAML"),
    ],
)
def test_what_is_no_profile_is_refused_with_the_reason(text: str, said: str) -> None:
    with pytest.raises(InvalidQoS) as caught:
        parse_qos_profiles(text)
    assert said in str(caught.value)
