"""Standing, standing up and sitting down over feet that stay: equilibrium, springs, the half-cosine, and the ground's slope."""

from __future__ import annotations

from itertools import pairwise
from math import atan, cos, pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from robot.control.drive import Targets
from robot.control.stand import StandController
from robot.estimation.predict import PredictedState
from robot.geometry.vectors import Floats
from robot.model.kinematics import feet, inverse
from robot.model.mass import standing_mass
from robot.model.parameters import FOOT_RADIUS, GRAVITY, MASS, SIT_HEIGHT, STAND_HEIGHT
from robot.model.stance import nominal_feet
from tests.robot.control.kit import DT, HEIGHT, MIRRORED, predicted, pushes

BEHIND = standing_mass(STAND_HEIGHT).behind


def wrench(state: PredictedState, targets: Targets) -> Floats:
    """The sum of what the feet push with, and its moment about the centre of mass, odom axes."""
    forces = pushes(state.legs, targets.effort) @ np.array(state.rotation).T
    arms = np.array(state.feet) - np.array(state.rotation) @ state.legs.centre - (0.0, 0.0, FOOT_RADIUS)
    return np.concatenate([forces.sum(axis=0), np.cross(arms, forces).sum(axis=0)])


def settled(state: PredictedState, seconds: float = 1.0) -> Targets:
    """What a stance on these feet comes to once it is centred."""
    stance, targets = StandController(state), Targets()
    for _ in range(round(seconds / DT)):
        targets = stance.step(DT, state)
    return targets


# -- forces -------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("yaw", [0.0, 1.0, -2.5])
def test_standing_still_the_feet_carry_the_weight_without_a_moment(yaw: float) -> None:
    state = predicted(rpy=(0.0, 0.0, yaw))
    targets = StandController(state).step(DT, state)
    assert wrench(state, targets) == pytest.approx((0.0, 0.0, MASS * GRAVITY, 0.0, 0.0, 0.0), abs=0.1)


@given(
    rpy=st.tuples(st.floats(-0.03, 0.03), st.floats(-0.03, 0.03), st.floats(-3.0, 3.0)),
    velocity=st.tuples(st.floats(-0.1, 0.1), st.floats(-0.1, 0.1), st.floats(-0.1, 0.1)),
    turn=st.tuples(st.floats(-0.1, 0.1), st.floats(-0.1, 0.1), st.floats(-0.1, 0.1)),
)
@settings(max_examples=40)
def test_the_wrench_is_that_of_the_equation(
    rpy: tuple[float, float, float], velocity: tuple[float, float, float], turn: tuple[float, float, float]
) -> None:
    """Captured level, then disturbed: springs of 60 and dampers of 8 per inertia, a damper of 6 per mass, none for height and yaw."""
    stance = StandController(predicted(rpy=(0.0, 0.0, rpy[2])))
    state = predicted(rpy=rpy, velocity=velocity, turn=turn)
    about = np.array(standing_mass(STAND_HEIGHT).inertia[:2]) * (60.0 * -np.array(rpy[:2]) - 8.0 * np.array(turn[:2]))
    moment = Rotation.from_euler("z", rpy[2]).apply((*about, 0.0))
    wanted = (*(-6.0 * MASS * np.array(velocity[:2])), MASS * GRAVITY, *moment)
    assert wrench(state, stance.step(DT, state)) == pytest.approx(wanted, abs=0.4)


@pytest.mark.parametrize(("weight", "after"), [(0.0, 0.0), (0.0, 0.1), (0.0, 0.2), (0.5, 0.1), (1.0, 0.1), (0.0, 0.6)])
def test_the_legs_take_up_the_weight_within_four_tenths_of_a_second(weight: float, after: float) -> None:
    state = predicted()
    stance, targets = StandController(state, weight), Targets()
    for _ in range(round(after / DT) + 1):
        targets = stance.step(DT, state)
    share = min(1.0, weight + (after + DT) / 0.4)
    assert wrench(state, targets)[2] == pytest.approx(share * MASS * GRAVITY, rel=1e-3)


def test_every_joint_has_the_spring_and_the_damper_of_standing() -> None:
    targets = settled(predicted(), 0.01)
    assert targets.kp == [120.0] * 12
    assert targets.kd == [4.0] * 12
    assert targets.velocity == [0.0] * 12


# -- the pose -----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("yaw", [0.0, 2.0])
def test_at_first_the_pose_is_the_one_that_it_has(yaw: float) -> None:
    crooked = nominal_feet(HEIGHT) + np.array(
        ((0.05, 0.02, 0.0), (-0.03, 0.01, 0.0), (0.0, -0.02, 0.0), (0.02, 0.0, 0.0))
    )
    state = predicted(rpy=(0.0, 0.0, yaw), feet=crooked)
    targets = StandController(state).step(1e-9, state)
    assert feet(targets.position) == pytest.approx(crooked, abs=1e-9)


def test_within_a_while_the_centre_of_mass_is_over_the_middle_of_the_feet() -> None:
    apart = nominal_feet(HEIGHT) + np.array((0.06, -0.04, 0.0))
    placed = feet(settled(predicted(feet=apart)).position)
    assert placed.mean(axis=0) == pytest.approx((-BEHIND, 0.0, -HEIGHT), abs=1e-9)
    assert placed - placed.mean(axis=0) == pytest.approx(apart - apart.mean(axis=0), abs=1e-9)


def test_it_moves_there_along_a_half_cosine_of_six_tenths_of_a_second() -> None:
    state = predicted(feet=nominal_feet(HEIGHT) + np.array((0.06, 0.0, 0.0)))
    stance, start = StandController(state), 0.06
    for step in range(1, 160):
        place = float(feet(stance.step(DT, state).position).mean(axis=0)[0])
        share = 0.5 * (1.0 - cos(pi * min(1.0, step * DT / 0.6)))
        assert place == pytest.approx(start + (-BEHIND - start) * share, abs=1e-9)


@given(slope_x=st.floats(-0.25, 0.25), slope_y=st.floats(-0.25, 0.25))
@settings(max_examples=20)
def test_on_a_slope_the_body_is_held_parallel_to_the_ground(slope_x: float, slope_y: float) -> None:
    """Seen from a body that is parallel to the ground, four feet that stand upright below it lie in one plane of its own."""
    ground = nominal_feet(HEIGHT)
    ground[:, 2] += slope_x * ground[:, 0] + slope_y * ground[:, 1]
    placed = feet(settled(predicted(feet=ground), 0.7).position)
    lengths = [np.linalg.norm(placed[a] - placed[b]) for a, b in ((0, 1), (2, 3), (0, 2), (1, 3))]
    assert lengths == pytest.approx(
        [np.linalg.norm(ground[a] - ground[b]) for a, b in ((0, 1), (2, 3), (0, 2), (1, 3))]
    )
    along, across = placed[0] - placed[2], placed[0] - placed[1]
    normal = np.cross(along, across)
    assert abs(normal[0] / normal[2]) < 0.5 * abs(slope_x * slope_y) + 1e-9
    assert abs(normal[1] / normal[2]) < 0.5 * abs(slope_x * slope_y) + 1e-9


def test_on_a_slope_to_the_left_the_body_is_turned_back_to_the_roll_of_the_ground() -> None:
    ground = nominal_feet(HEIGHT)
    ground[:, 2] += 0.1 * ground[:, 1]
    level = predicted(feet=ground)
    moment = wrench(level, StandController(level).step(DT, level))[3]
    assert moment == pytest.approx(60.0 * standing_mass(STAND_HEIGHT).inertia[0] * atan(0.1), abs=0.3)


# -- up and down --------------------------------------------------------------------------------------------------------------


def test_the_height_follows_a_half_cosine_and_arrives_in_time() -> None:
    state = predicted(feet=nominal_feet(SIT_HEIGHT))
    stance = StandController(state)
    stance.go(STAND_HEIGHT, 2.0)
    for step in range(1, 500):
        targets = stance.step(DT, state)
        share = 0.5 * (1.0 - cos(pi * min(1.0, step * DT / 2.0)))
        assert stance.height == pytest.approx(SIT_HEIGHT + (STAND_HEIGHT - SIT_HEIGHT) * share, abs=1e-6)
        assert stance.arrived is (step * DT > 2.0 - 1e-9) or step == 400, "to within a step"
        assert feet(targets.position)[:, 2] == pytest.approx([-stance.height] * 4, abs=1e-9)


def test_turning_round_half_way_goes_on_from_there_without_a_jump() -> None:
    state = predicted()
    stance = StandController(state)
    stance.go(0.3, 1.0)
    heights = []
    for step in range(400):
        if step == 90:
            stance.go(0.52, 1.0)
        stance.step(DT, state)
        heights.append(stance.height)
    fastest = 0.5 * pi * 0.25 / 1.0
    assert max(abs(b - a) for a, b in pairwise(heights)) <= fastest * DT
    assert heights[-1] == 0.52


def test_a_stance_that_was_sent_nowhere_has_arrived() -> None:
    assert StandController(predicted()).arrived


def test_standing_straight_the_angles_are_those_of_the_nominal_stance_moved_over_the_centre_of_mass() -> None:
    wanted = inverse(nominal_feet(HEIGHT) - (BEHIND, 0.0, 0.0)).joints
    assert settled(predicted()).position == pytest.approx(wanted, abs=1e-9)


def test_a_mirrored_stance_is_told_the_mirrored_targets() -> None:
    crooked = nominal_feet(HEIGHT) + np.array(
        ((0.05, 0.02, 0.01), (-0.03, 0.01, 0.0), (0.0, -0.02, 0.02), (0.02, 0.0, 0.0))
    )
    image = crooked[list(MIRRORED)] * (1.0, -1.0, 1.0)
    one = settled(predicted(rpy=(0.02, 0.01, 0.3), velocity=(0.1, 0.05, 0.0), feet=crooked), 0.3)
    other = settled(predicted(rpy=(-0.02, 0.01, -0.3), velocity=(0.1, -0.05, 0.0), feet=image), 0.3)
    for leg, twin in enumerate(MIRRORED):
        for mine, theirs in ((one.position, other.position), (one.effort, other.effort)):
            hip, shoulder, knee = mine[3 * leg : 3 * leg + 3]
            assert theirs[3 * twin : 3 * twin + 3] == pytest.approx((-hip, shoulder, knee), abs=1e-8)
