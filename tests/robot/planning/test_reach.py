"""Where the arm reaches, against all the places that its joints lead to when they are tried one by one."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from robot.geometry.planar import Pose2
from robot.model.arm import LIMITS, MOUNT, OutOfReach, forward
from robot.planning.grasp import ABOVE, PITCHES, STANDING, Spot, approach, stands
from robot.planning.reach import reach_ring, standing_place


def tried(height: float, pitch: float) -> np.ndarray:
    """Distances straight ahead to which shoulder and elbow bring the tip at this height (to 4 mm), with the wrist as the pitch asks."""
    q2, q3 = np.meshgrid(np.arange(*LIMITS[1], 0.004), np.arange(*LIMITS[2], 0.004))
    q4 = pitch - q2 - q3
    turned = (q4 - LIMITS[3][0]) % (2 * math.pi) + LIMITS[3][0]
    r = 0.3385 * np.cos(q2) + 0.410 * np.cos(q2 + q3) + 0.19 * math.cos(pitch)
    z = -0.3385 * np.sin(q2) - 0.410 * np.sin(q2 + q3) - 0.19 * math.sin(pitch)
    return np.abs(r[(np.abs(z - height) < 0.004) & (turned <= LIMITS[3][1])])


@pytest.mark.parametrize(("height", "pitch"), [(-0.3, 0.0), (0.0, 0.6), (-0.5, 1.2), (0.3, 0.2)])
def test_the_ring_is_as_wide_as_all_joint_angles_that_there_are(height: float, pitch: float) -> None:
    ring, found = reach_ring(height, pitch), tried(height, pitch)
    assert ring is not None
    assert ring[1] == pytest.approx(float(found.max()), abs=0.012)
    assert found[found >= ring[0] - 0.02].min() == pytest.approx(ring[0], abs=0.025)


def test_where_no_joint_angles_lead_there_is_no_ring() -> None:
    assert reach_ring(1.2) is None
    assert tried(1.2, 0.0).size == 0


spots = st.builds(Spot, st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.floats(0.1, 0.8))
robots = st.builds(Pose2, st.floats(-4.0, 4.0), st.floats(-4.0, 4.0), st.floats(-3.1, 3.1))


@given(spot=spots, robot=robots, share=st.floats(0.0, 1.0))
def test_the_place_lies_on_the_straight_way_facing_the_thing(spot: Spot, robot: Pose2, share: float) -> None:
    place = standing_place(spot, robot, STANDING, 0.6, share)
    ring = reach_ring(round(spot.z - STANDING - MOUNT[2], 3), 0.6)
    if ring is None:
        assert place is None
        return
    assert place is not None
    way = ring[0] + share * (ring[1] - ring[0]) + MOUNT[0]
    assert math.dist((place.x, place.y), spot[:2]) == pytest.approx(way)
    if math.dist((robot.x, robot.y), spot[:2]) > 0.01:
        along = np.array((spot.x - robot.x, spot.y - robot.y))
        assert (math.cos(place.yaw), math.sin(place.yaw)) == pytest.approx(tuple(along / np.linalg.norm(along)))


@settings(deadline=None, max_examples=25)
@given(spot=spots, robot=robots, turn=st.floats(-3.0, 3.0))
def test_a_turned_world_has_the_same_places_turned(spot: Spot, robot: Pose2, turn: float) -> None:
    about = Rotation.from_euler("z", turn)
    there, robot_there = about.apply(spot), about.apply((robot.x, robot.y, 0.0))
    here = list(stands(spot, robot))
    turned = list(stands(Spot(*there.tolist()), Pose2(float(robot_there[0]), float(robot_there[1]), robot.yaw + turn)))
    assert len(turned) == len(here) == 10
    for one, other in zip(here, turned, strict=True):
        assert (other.x, other.y) == pytest.approx(tuple(about.apply((one.x, one.y, 0.0))[:2]), abs=1e-6)
        assert math.cos(other.yaw - one.yaw - turn) == pytest.approx(1.0)


def test_the_first_place_is_on_the_straight_way_and_the_others_alternate_round_the_thing() -> None:
    places = list(stands(Spot(1.0, 0.0, 0.45), Pose2(-1.0, 0.0)))
    bearings = [math.atan2(place.y, place.x - 1.0) for place in places]
    assert [math.pi - abs(b) for b in bearings[:3]] == pytest.approx([0.0, 0.5, 0.5], abs=1e-6)
    assert bearings[1] * bearings[2] < 0.0
    assert abs(bearings[-1]) == pytest.approx(0.0, abs=1e-6)


@given(x=st.floats(0.5, 1.1), y=st.floats(-0.4, 0.4), z=st.floats(-0.3, 0.4))
def test_the_arm_comes_from_above_with_the_first_pitch_that_reaches_both_points(x: float, y: float, z: float) -> None:
    try:
        way = approach(Spot(x, y, z))
    except OutOfReach:
        return
    at, above = forward(way.at), forward(way.above)
    assert [a + m for a, m in zip(at[:3], MOUNT, strict=True)] == pytest.approx((x, y, z), abs=1e-9)
    assert [a - b for a, b in zip(above[:3], at[:3], strict=True)] == pytest.approx((0.0, 0.0, ABOVE), abs=1e-9)
    assert above.pitch == pytest.approx(at.pitch)
    assert min(abs(math.remainder(at.pitch - pitch, math.tau)) for pitch in PITCHES) < 1e-9


def test_what_no_pitch_reaches_is_refused_with_the_reason_of_the_first() -> None:
    with pytest.raises(OutOfReach, match=r"with the tool at pitch 0\.600 rad: the wrist would be .* from the shoulder"):
        approach(Spot(3.0, 0.0, 0.0))
