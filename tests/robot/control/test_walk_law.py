"""The equations of walking one by one: what the body shall feel, and where the feet shall land."""

from __future__ import annotations

from dataclasses import replace
from math import inf

import numpy as np
import pytest

from robot.control.walk_config import WalkConfig
from robot.control.walk_law import AT_REST, Step, WalkState, body_wrench, foothold, has_lost_balance, track
from robot.estimation.leg_odometry import Estimator
from robot.estimation.predict import PredictedState
from robot.estimation.terrain import TerrainPlane
from robot.hardware.body import ImuSample, JointSample
from robot.model.kinematics import inverse
from robot.model.mass import standing_mass
from robot.model.parameters import GRAVITY, MASS
from robot.model.stance import NOMINAL, nominal_feet

CONFIG = WalkConfig()
FEET = (0, 1, 2, 3)
STILL = (0.0, 0.0, 0.0)


def step(velocity: tuple[float, float] = (0.0, 0.0), *, wanted: tuple[float, float] = (0.0, 0.0), turn: float = 0.0, height: float = 0.5) -> Step:  # fmt: skip
    """A level robot whose feet stand 0.5 m below its hips, looking along x, that moves at `velocity` (odom axes)."""
    feet = JointSample(inverse(nominal_feet(0.5)).joints, np.zeros(12), np.zeros(12), np.ones(4, dtype=np.bool_))
    estimate, terrain = Estimator(), TerrainPlane()
    estimate.update(0.005, ImuSample(np.zeros(3), np.array((0.0, 0.0, GRAVITY))), feet)
    terrain.update(inf, estimate.contacts)
    ahead = PredictedState(estimate, feet, 0.0, STILL)
    ahead.velocity = (*velocity, 0.0)
    return Step(0.005, ahead, terrain, wanted, turn, (STILL, STILL), height, standing_mass(height))


def wrench(now: Step, state: WalkState | None = None) -> tuple[float, ...]:
    after, tracking = track(CONFIG, state or WalkState(0.0), now)
    return body_wrench(CONFIG, after, tracking, now, FEET)


def test_a_body_that_is_as_it_should_be_feels_its_weight_carried_and_nothing_else() -> None:
    assert wrench(step()) == pytest.approx((0.0, 0.0, MASS * GRAVITY, 0.0, 0.0, 0.0), abs=1e-3)


def test_a_body_that_is_too_slow_is_pushed_on_and_never_harder_than_the_bound() -> None:
    push, _, *_ = wrench(step((0.4, 0.0), wanted=(0.5, 0.0)))
    assert push == pytest.approx(MASS * 0.1 * (CONFIG.speed_gain + 0.005 * CONFIG.speed_integral))
    assert wrench(step(wanted=(9.0, 0.0)))[0] == pytest.approx(MASS * CONFIG.most_push)


def test_a_body_that_is_too_low_is_lifted_and_one_that_is_much_too_high_is_still_carried_a_little() -> None:
    assert wrench(step(height=0.51))[2] == pytest.approx(MASS * (GRAVITY + 0.01 * CONFIG.height_spring), rel=1e-3)
    assert wrench(step(height=0.1))[2] == pytest.approx(MASS * CONFIG.least_lift * GRAVITY)


def test_a_body_that_leans_is_turned_back() -> None:
    now = step()
    now.ahead.roll = 0.05
    assert wrench(now)[3] == pytest.approx(-0.05 * CONFIG.turn_spring[0] * now.mass.inertia[0], rel=1e-2)


def test_a_lasting_error_is_learned_up_to_the_bound_and_the_feet_are_set_back_for_it() -> None:
    state, tracking = WalkState(0.0), AT_REST
    for _ in range(2000):
        state, tracking = track(CONFIG, state, step(wanted=(0.5, 0.0)))
    assert state.integral == pytest.approx((CONFIG.most_integral, 0.0), abs=1e-6)
    assert tracking.back == pytest.approx((0.5 / GRAVITY * CONFIG.most_integral, 0.0), abs=1e-6)
    there, here = (foothold(CONFIG, each, step(), 0, 0.0, 0.25)[0] for each in (tracking, AT_REST))
    assert there - here == pytest.approx(-tracking.back[0])


def test_the_heading_that_is_held_turns_with_the_command_and_never_runs_away_from_the_body() -> None:
    state, tracking = WalkState(0.0), AT_REST
    for _ in range(20):
        state, tracking = track(CONFIG, state, step(turn=1.0))
    assert state.heading == pytest.approx(0.1)
    assert tracking.lean[2] == pytest.approx(0.1)
    for _ in range(400):
        state, tracking = track(CONFIG, state, step(turn=1.0))
    assert state.heading == pytest.approx(CONFIG.heading_error)


@pytest.mark.parametrize("leg", range(4))
def test_a_robot_that_steps_in_place_lands_below_its_hips_less_what_its_mass_lies_behind(leg: int) -> None:
    now = step()
    x, y, _ = foothold(CONFIG, AT_REST, now, leg, 0.1, 0.25)
    hip_x, hip_y = NOMINAL[leg]
    assert (x, y) == pytest.approx((hip_x - now.mass.behind, hip_y), abs=1e-6)


def test_at_the_right_speed_a_foot_lands_half_a_stance_ahead_and_when_pushed_farther_still() -> None:
    at_rest = foothold(CONFIG, AT_REST, step(), 0, 0.0, 0.25)[0]
    walking = foothold(CONFIG, AT_REST, step((1.0, 0.0), wanted=(1.0, 0.0)), 0, 0.0, 0.25)[0]
    pushed = foothold(CONFIG, AT_REST, step((1.0, 0.0)), 0, 0.0, 0.25)[0]
    hurled = foothold(CONFIG, AT_REST, step((9.0, 0.0)), 0, 0.0, 0.0)[0]
    assert walking - at_rest == pytest.approx(0.125)
    assert pushed - walking == pytest.approx(CONFIG.capture)
    assert hurled - at_rest == pytest.approx(CONFIG.most_capture)


def test_balance_is_lost_by_leaning_or_by_being_far_from_the_speed() -> None:
    fine = AT_REST._replace(error=(0.2, 0.2), lean=(0.09, -0.09, 1.0))
    assert not has_lost_balance(CONFIG, fine)
    assert has_lost_balance(CONFIG, fine._replace(lean=(0.0, -0.11, 0.0)))
    assert has_lost_balance(CONFIG, fine._replace(error=(0.25, 0.25)))
    assert not has_lost_balance(replace(CONFIG, most_error=0.5), fine._replace(error=(0.25, 0.25)))
