"""Feet of a body without forces: where they stand, when they lift, and where they land."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robot.geometry.planar import ZERO_TWIST, Pose2, Twist2, compose
from robot.model.parameters import FOOT_RADIUS
from robot.model.robot import SPOT
from robot.model.stance import NOMINAL
from robot.sim.stepping import Footwork

DT = 0.005
ORIGIN = Pose2(0.0, 0.0)
twists = st.builds(Twist2, st.floats(-0.4, 0.6), st.floats(-0.3, 0.3), st.floats(-0.8, 0.8))


def planted(pose: Pose2 = ORIGIN) -> Footwork:
    feet = Footwork(SPOT)
    feet.plant([(lambda p: (p.x, p.y))(compose(pose, Pose2(x, y))) for x, y in NOMINAL])
    return feet


def walk(feet: Footwork, twist: Twist2, seconds: float, pose: Pose2 = ORIGIN, stepping: bool = True) -> list:
    """Poses of the body, and of each step the feet and their contacts."""
    seen = []
    for _ in range(round(seconds / DT)):
        pose = compose(pose, twist.over(DT))
        feet.advance(DT, pose, twist, stepping=stepping)
        seen.append((pose, list(feet.feet), list(feet.contact), list(feet.velocity)))
    return seen


def test_feet_stay_where_they_are_planted_until_it_steps() -> None:
    feet = planted()
    before = list(feet.feet)
    walk(feet, Twist2(0.5, 0.0, 0.0), 1.0, stepping=False)
    assert feet.feet == before
    assert feet.standing
    assert all(z == FOOT_RADIUS for _, _, z in before)


@settings(deadline=None, max_examples=15)
@given(twists)
def test_over_a_stance_a_foot_is_on_average_below_its_shoulder(twist: Twist2) -> None:
    """The foothold rule: it lands half a stance ahead, and stands until the body is half a stance past it."""
    seen = walk(planted(), twist, 3.0)[200:]
    for leg, (x, y) in enumerate(NOMINAL):
        off = []
        for pose, feet, contact, _ in seen:
            if contact[leg]:
                fx, fy = feet[leg][0] - pose.x, feet[leg][1] - pose.y
                c, s = math.cos(pose.yaw), math.sin(pose.yaw)
                off.append((c * fx + s * fy - x, c * fy - s * fx - y))
        assert np.mean(off, axis=0) == pytest.approx((0.0, 0.0), abs=0.012)


def test_a_standing_foot_does_not_move_and_a_swinging_one_clears_the_floor_and_lands_where_it_comes_to_rest() -> None:
    seen = walk(planted(), Twist2(0.5, 0.0, 0.3), 2.0)
    for (_, before, stood, _), (_, after, stands, _) in itertools.pairwise(seen):
        for leg in range(4):
            if stood[leg] and stands[leg]:
                assert after[leg] == before[leg]
            if not stands[leg]:
                assert after[leg][2] >= FOOT_RADIUS - 1e-9
            if stands[leg]:
                assert after[leg][2] == FOOT_RADIUS
            if stands[leg] and not stood[leg]:
                assert math.dist(after[leg][:2], before[leg][:2]) < 0.02
    assert max(feet[0][2] for _, feet, _, _ in seen) > FOOT_RADIUS + 0.04


def test_a_trot_lifts_diagonal_feet_together_and_never_all_four() -> None:
    seen = walk(planted(), Twist2(0.4, 0.0, 0.0), 2.0)
    contacts = np.array([contact for _, _, contact, _ in seen])
    assert (contacts[:, 0] == contacts[:, 3]).all() and (contacts[:, 1] == contacts[:, 2]).all()
    assert contacts.any(axis=1).all()
    assert contacts.mean(axis=0) == pytest.approx([0.52] * 4, abs=0.08), "the trot's duty"


@settings(deadline=None, max_examples=15)
@given(twists)
def test_a_swinging_foots_velocity_is_the_derivative_of_its_place(twist: Twist2) -> None:
    """As far as its foothold stays: in the middle of a swing it hardly moves."""
    seen = walk(planted(), twist, 1.0)
    for before, now, after in zip(seen, seen[1:], seen[2:], strict=False):
        if not (before[2][0] or now[2][0] or after[2][0]):
            difference = (np.array(after[1][0]) - np.array(before[1][0])) / (2 * DT)
            assert now[3][0] == pytest.approx(difference, abs=0.15)


@settings(deadline=None, max_examples=15)
@given(twists, st.floats(-3.0, 3.0), st.floats(-5.0, 5.0))
def test_where_it_walks_and_which_way_makes_no_difference(twist: Twist2, yaw: float, x: float) -> None:
    there = Pose2(x, -x / 2, yaw)
    here_seen, there_seen = walk(planted(), twist, 0.6), walk(planted(there), twist, 0.6, there)
    for (_, feet, contact, _), (_, moved, landed, _) in zip(here_seen, there_seen, strict=True):
        assert contact == landed
        for (fx, fy, fz), (mx, my, mz) in zip(feet, moved, strict=True):
            expected = compose(there, Pose2(fx, fy))
            assert (mx, my, mz) == pytest.approx((expected.x, expected.y, fz), abs=1e-9)


def test_told_to_stop_it_sets_its_feet_down_and_then_keeps_them() -> None:
    feet = planted()
    walk(feet, Twist2(0.4, 0.0, 0.0), 0.72)
    assert not feet.standing
    walk(feet, ZERO_TWIST, 0.5, stepping=False)
    assert feet.standing
    before = list(feet.feet)
    walk(feet, ZERO_TWIST, 0.5, stepping=False)
    assert feet.feet == before


def test_a_foot_rolls_as_its_leg_turns_and_slips_where_it_is_dragged() -> None:
    feet = planted()
    feet.roll(1, math.pi / 2, 0.1, 0.02)
    x, y, _ = feet.feet[1]
    feet.advance(0.5, Pose2(0.0, 0.0), ZERO_TWIST, stepping=False)
    assert feet.feet[1] == pytest.approx((x - 0.02 * 0.5, y + 0.1 * 0.5, FOOT_RADIUS))
    feet.slip(1, 1.0, 2.0)
    assert feet.feet[1] == (1.0, 2.0, FOOT_RADIUS)
    assert feet.velocity[1] == (0.0, 0.0, 0.0)
