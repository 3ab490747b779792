"""The last steps onto the dock: the control law and the filter of sights, without a node."""

from __future__ import annotations

import math

import pytest

from robot.geometry.planar import Pose2, compose
from robot.navigation.dock import DockConfig, Sight, approach, remaining

CONFIG = DockConfig()
DOCK = Pose2(0.0, 0.0)


@pytest.mark.parametrize(
    "start", [Pose2(-0.8, 0.0), Pose2(-0.7, 0.15, 0.3), Pose2(0.2, -0.1, -0.4), Pose2(0.0, 0.0, 1.0)]
)
def test_the_law_brings_the_body_onto_the_dock_within_its_bounds(start: Pose2) -> None:
    pose, seconds = start, 0.0
    while (command := approach(pose, DOCK, CONFIG)) is not None:
        assert abs(command.vx) <= CONFIG.ahead_speed + 1e-12
        assert abs(command.vy) <= CONFIG.side_speed + 1e-12
        assert abs(command.wz) <= CONFIG.turn_speed
        dt = CONFIG.period
        pose = compose(pose, Pose2(command.vx * dt, command.vy * dt, command.wz * dt))
        seconds += dt
        assert seconds < 10.0, pose
    assert remaining(pose, DOCK) < CONFIG.close
    assert abs(pose.yaw) < CONFIG.straight


def test_where_one_axis_is_bounded_the_way_still_leads_straight_to_the_dock() -> None:
    command = approach(Pose2(-0.6, 0.4), DOCK, CONFIG)
    assert command is not None
    assert command.vy == pytest.approx(-CONFIG.side_speed)
    assert command.vx / command.vy == pytest.approx(0.6 / -0.4)


def test_near_but_crooked_it_only_turns() -> None:
    command = approach(Pose2(0.0, 0.0, 0.05), DOCK, CONFIG)
    assert command is not None
    assert (command.vx, command.vy) == (0.0, 0.0)
    assert command.wz == pytest.approx(-0.05 * CONFIG.turn_gain)


def test_sights_are_averaged_at_first_and_then_filtered() -> None:
    by_map, sight = Pose2(-0.5, 0.0), Sight()
    for at, off in enumerate((0.00, 0.06, 0.03)):
        sight = sight.with_one_more(Pose2(-0.5 + off, 0.0), by_map, float(at), CONFIG.share)
    assert sight.correction.x == pytest.approx(0.03)
    assert (sight.count, sight.at) == (3, 2.0)
    for _ in range(20):
        sight = sight.with_one_more(Pose2(-0.5, 0.0), by_map, 3.0, CONFIG.share)
    before = sight.correction.x
    sight = sight.with_one_more(Pose2(-0.4, 0.0), by_map, 4.0, CONFIG.share)
    assert sight.correction.x - before == pytest.approx(CONFIG.share * (0.1 - before))


def test_sights_on_both_sides_of_half_a_turn_are_averaged_the_short_way_round() -> None:
    here = Pose2(0.0, 0.0, 0.0)
    sight = Sight().with_one_more(Pose2(0.0, 0.0, math.pi - 0.1), here, 0.0, CONFIG.share)
    sight = sight.with_one_more(Pose2(0.0, 0.0, -math.pi + 0.1), here, 0.1, CONFIG.share)
    assert sight.correction.yaw == pytest.approx(math.pi)
