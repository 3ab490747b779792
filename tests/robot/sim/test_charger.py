"""The contacts of the charging station close where the robot truly sits on its dock."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot.geometry.planar import Pose2
from robot.sim.charger import charger_connected
from robot.sim.simulation import Truth

DOCK = Pose2(1.0, -2.0, 3.0)


def body(x: float, y: float, z: float, yaw: float) -> Truth:
    zero = np.zeros(3)
    attitude = np.array((np.cos(yaw / 2), 0.0, 0.0, np.sin(yaw / 2)))
    return Truth(np.array((x, y, z)), attitude, zero, zero, np.zeros(12), False, False, (), 0.0)


@given(way=st.floats(0.0, 0.6), bearing=st.floats(-3.2, 3.2))
def test_within_thirty_centimetres_to_any_side(way: float, bearing: float) -> None:
    beside = body(DOCK.x + way * np.cos(bearing), DOCK.y + way * np.sin(bearing), 0.186, DOCK.yaw)
    assert charger_connected(beside, DOCK) == (way < 0.3)


@pytest.mark.parametrize(
    ("turn", "closed"), [(0.34, True), (-0.34, True), (0.36, False), (-0.36, False), (3.1, False), (6.28, True)]
)
def test_turned_by_twenty_degrees_at_most_also_across_half_a_turn(turn: float, closed: bool) -> None:
    assert charger_connected(body(DOCK.x, DOCK.y, 0.186, DOCK.yaw + turn), DOCK) == closed


@pytest.mark.parametrize(("height", "closed"), [(0.186, True), (0.249, True), (0.251, False), (0.486, False)])
def test_sitting_down_and_not_standing_over_it(height: float, closed: bool) -> None:
    assert charger_connected(body(DOCK.x, DOCK.y, height, DOCK.yaw), DOCK) == closed
