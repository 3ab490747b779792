"""The arm's closed-form kinematics, its limits, and where the body must stand for it to reach."""

from __future__ import annotations

from math import hypot, isclose, nan, sin

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from actors.tf2 import Transform
from robot.geometry.planar import Pose2
from robot.model.arm import LIMITS, MOUNT, STOWED, Angles, OutOfReach, Tip, check_angles, forward, inverse
from robot.planning.reach import GRASP_DISTANCE, reach_ring, standing_place

angles_within = st.tuples(*(st.floats(low, high) for low, high in LIMITS))


def faces_its_tip(q: Angles) -> bool:
    """Whether the tip is on the side the arm looks to: otherwise a second, facing answer may exist and is preferred."""
    tip = forward(q)
    return tip.x * np.cos(q[0]) + tip.y * np.sin(q[0]) > 1e-3


def test_known_poses() -> None:
    assert forward((0.0, 0.0, 0.0, 0.0)) == pytest.approx((0.3385 + 0.410 + 0.19, 0.0, 0.0, 0.0))
    assert forward((np.pi / 2, 0.0, np.pi / 2, 0.0)) == pytest.approx((0.0, 0.3385, -0.6, np.pi / 2))
    tip = forward(STOWED)
    assert hypot(tip.x, tip.z) < 0.3


def test_inverse_brings_the_tip_back_to_1e_9_over_many_poses() -> None:
    generator = np.random.default_rng(0)
    worst = 0.0
    for _ in range(5000):
        tip = forward(tuple(generator.uniform(low, high) for low, high in LIMITS))
        again = forward(inverse(tip))
        worst = max(worst, *(abs(a - b) for a, b in zip(tip[:3], again[:3], strict=True)))
        worst = max(worst, 2 * abs(sin((tip.pitch - again.pitch) / 2)))
    assert worst <= 1e-9


@given(angles_within)
def test_inverse_undoes_forward(q: Angles) -> None:
    if not faces_its_tip(q) or not 1e-3 < q[2] < np.pi - 1e-3:
        return  # at full stretch and full fold the elbow's angle is ill-conditioned
    assert inverse(forward(q)) == pytest.approx(q, abs=1e-9)


@given(angles_within)
def test_every_answer_is_within_the_limits(q: Angles) -> None:
    assert check_angles(inverse(forward(q))) is not None


@given(st.floats(-1.5, 1.5), st.floats(-1.5, 1.5), st.floats(-1.5, 1.5), st.floats(-3.2, 3.2))
def test_any_point_is_either_reached_or_refused(x: float, y: float, z: float, pitch: float) -> None:
    tip = Tip(x, y, z, pitch)
    try:
        q = inverse(tip)
    except OutOfReach:
        return
    again = forward(q)
    assert again[:3] == pytest.approx(tip[:3], abs=1e-9)


def test_out_of_reach_says_by_how_much_and_what_to_do() -> None:
    with pytest.raises(OutOfReach, match=r"wrist would be 1\.810 m from the shoulder.*Move the body"):
        inverse(Tip(2.0, 0.0, 0.0, 0.0))
    with pytest.raises(OutOfReach, match="finite"):
        inverse(Tip(nan, 0.0, 0.0, 0.0))


@pytest.mark.parametrize(
    ("angles", "words"),
    [
        ((0.0, 0.0, 0.0), "4 joints .* but 3 angles"),
        ((0.0,) * 5, "but 5 angles"),
        ((0.0, nan, 0.0, 0.0), "arm_shoulder would be at nan"),
        ((0.0, 0.6, 0.0, 0.0), "arm_shoulder would be at 0.600 rad, outside -3.142 to 0.524"),
    ],
)
def test_a_54_angles_are_checked_by_number_value_and_limit(angles: tuple[float, ...], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        check_angles(angles)


def test_the_reach_ring_is_reached_inside_and_not_outside() -> None:
    ring = reach_ring(-0.3)
    assert ring is not None
    near, far = ring
    for distance in np.linspace(near, far, 20):
        inverse(Tip(float(distance), 0.0, -0.3, 0.0))
    for distance in (near - 0.01, far + 0.01):
        with pytest.raises(OutOfReach):
            inverse(Tip(distance, 0.0, -0.3, 0.0))
    assert reach_ring(2.0) is None


@given(st.floats(-5, 5), st.floats(-5, 5), st.floats(-3, 3), st.floats(0.2, 1.0))
def test_from_the_standing_place_the_tip_gets_to_the_thing(x: float, y: float, yaw: float, height: float) -> None:
    robot, thing, body_height = Pose2(x, y, yaw), (0.7, -0.4, height), 0.486
    place = standing_place(thing, robot, body_height)
    assert place is not None
    seen = Transform.planar(place.x, place.y, place.yaw).inverse().point((thing[0], thing[1], height - body_height))
    goal = Tip(*(a - b for a, b in zip(seen, MOUNT, strict=True)), pitch=0.0)
    tip = forward(inverse(goal))
    missed = hypot(*(a - b for a, b in zip(tip[:3], goal[:3], strict=True)))
    assert missed < GRASP_DISTANCE
    assert isclose(goal.y, 0.0, abs_tol=1e-9)
    # it keeps its distance: at least from mount to thing
    assert hypot(place.x - thing[0], place.y - thing[1]) > MOUNT[0]


def test_standing_on_the_thing_keeps_the_heading_and_too_high_has_no_place() -> None:
    place = standing_place((1.0, 1.0, 0.6), Pose2(1.0, 1.0, 0.7), 0.486)
    assert place is not None
    assert place.yaw == 0.7
    assert standing_place((1.0, 1.0, 3.0), Pose2(0, 0), 0.486) is None
