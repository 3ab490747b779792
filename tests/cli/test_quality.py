"""The quality of service that commands choose."""

from __future__ import annotations

import argparse

import pytest

from actors import QoS, qos
from actors.qos import Durability, History, Reliability
from cli.quality import add_qos_options, fitting_qos, objections, stated_qos

RELIABLE, BEST_EFFORT = QoS(depth=1), qos.SENSOR_DATA
KEPT = QoS(depth=3, durability=Durability.TRANSIENT_LOCAL)


def options(*words: str) -> argparse.Namespace:
    parser = argparse.ArgumentParser()
    add_qos_options(parser, "subscription", "what fits")
    return parser.parse_args(list(words))


@pytest.mark.parametrize(
    ("offered", "reliability", "durability"),
    [
        ([], "best_effort", "volatile"),
        ([RELIABLE], "reliable", "volatile"),
        ([RELIABLE, BEST_EFFORT], "best_effort", "volatile"),
        ([KEPT], "reliable", "transient_local"),
        ([KEPT, RELIABLE], "reliable", "volatile"),
    ],
)
def test_a_subscription_asks_for_the_strongest_that_all_publishers_offer(
    offered: list[QoS], reliability: str, durability: str
) -> None:
    fitting = fitting_qos(offered, options())
    assert (fitting.reliability, fitting.durability, fitting.depth) == (reliability, durability, 5)
    assert all(qos.compatible(offer, fitting) for offer in offered)


def test_what_the_options_say_counts_more() -> None:
    said = options("--qos-reliability", "best_effort", "--qos-depth", "7", "--qos-history", "keep_last")
    fitting = fitting_qos([KEPT], said)
    assert (fitting.reliability, fitting.depth, fitting.history) == (Reliability.BEST_EFFORT, 7, History.KEEP_LAST)
    assert fitting.durability is Durability.TRANSIENT_LOCAL
    profile = fitting_qos([KEPT], options("--qos-profile", "sensor_data"))
    assert profile == qos.SENSOR_DATA
    lease = stated_qos(options("--qos-liveliness-lease-duration-seconds", "2.5"), qos.DEFAULT)
    assert lease.liveliness_lease == 2.5


def test_a_publisher_that_is_shut_out_is_named_with_the_flags_that_let_it_in() -> None:
    (line,) = objections([("/camera", BEST_EFFORT), ("/map", KEPT)], KEPT)
    assert line.startswith("nothing comes from /camera, ")
    assert line.endswith(": use --qos-reliability best_effort --qos-durability volatile")
    assert objections([("/map", KEPT)], BEST_EFFORT) == []
