"""Without an IMU: what the standing feet show of the body's attitude and its turning."""

from __future__ import annotations

from math import cos, radians, sin

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot.estimation.virtual_imu import CATCH_UP, virtual_imu
from robot.geometry.vectors import Rows, Vector
from robot.hardware.body import JointSample
from robot.model.kinematics import inverse
from robot.model.legs import LegState, foot_velocities, leg_state
from robot.model.parameters import GRAVITY, STAND_HEIGHT
from robot.model.stance import nominal_feet
from robot.testing import Conditions, Trial

MORE = pytest.mark.slow(reason="more phases of a step")

LEVEL = (0.0, 0.0, 1.0)
UPRIGHT: Rows = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
ALL = (True, True, True, True)
FLAT = (0.0, 0.0)

lean = st.floats(-0.15, 0.15)
rate = st.floats(-1.0, 1.0)


def attitude(roll: float, pitch: float) -> Vector:
    """Body to odom, heading along x."""
    about_x = np.array(((1.0, 0.0, 0.0), (0.0, cos(roll), -sin(roll)), (0.0, sin(roll), cos(roll))))
    about_y = np.array(((cos(pitch), 0.0, sin(pitch)), (0.0, 1.0, 0.0), (-sin(pitch), 0.0, cos(pitch))))
    return np.asarray(about_y @ about_x)


def standing(rotation: Vector, slope: tuple[float, float] = FLAT) -> Vector:
    """Feet on the ground under a body of that attitude, body axes, shape (4, 3)."""
    feet = nominal_feet(STAND_HEIGHT).copy()
    feet[:, 2] += slope[0] * feet[:, 0] + slope[1] * feet[:, 1]
    return np.asarray(feet @ rotation)


def sample(feet: Vector, turn: Vector, contact: tuple[bool, ...] = ALL) -> tuple[LegState, JointSample]:
    """Legs and joint samples of a body that turns over feet that roll on the ground."""
    angles = inverse(feet).joints
    legs = leg_state(angles.tolist(), LEVEL)

    def seen(speeds: Vector) -> Vector:
        moving, rolling = foot_velocities(legs, angles.tolist(), speeds.tolist(), (0.0, 0.0, 0.0), LEVEL)
        return np.asarray(np.array(moving) - np.array(rolling))

    columns = np.array([seen(unit).ravel() for unit in np.eye(12)]).T
    speeds: Vector = np.linalg.solve(columns, -np.cross(turn, feet).ravel())
    return legs, JointSample(angles, speeds, np.zeros(12), np.array(contact))


def rows(rotation: Vector) -> Rows:
    first, second, third = (tuple(row) for row in rotation.tolist())
    return (first, second, third)


@given(roll=lean, pitch=lean, slope_x=lean, slope_y=lean)
def test_four_standing_feet_show_the_vertical_on_any_ground_that_is_known(
    roll: float, pitch: float, slope_x: float, slope_y: float
) -> None:
    rotation, slope = attitude(roll, pitch), (slope_x, slope_y)
    legs, joints = sample(standing(rotation, slope), np.zeros(3))
    shown = virtual_imu(legs, joints, rows(rotation), slope)
    assert shown.accel / GRAVITY == pytest.approx(rotation[2], abs=1e-6)
    assert shown.gyro == pytest.approx(np.zeros(3), abs=1e-4)


@given(roll=lean)
def test_a_belief_that_is_wrong_is_turned_towards_what_the_feet_show(roll: float) -> None:
    legs, joints = sample(standing(attitude(roll, 0.0)), np.zeros(3))
    shown = virtual_imu(legs, joints, UPRIGHT, FLAT)
    assert shown.gyro[0] * CATCH_UP == pytest.approx(min(max(sin(roll), -0.1), 0.1), abs=1e-4)


@given(turn=st.tuples(rate, rate, rate))
def test_the_turning_over_four_feet_is_seen_whole(turn: tuple[float, float, float]) -> None:
    legs, joints = sample(standing(attitude(0.0, 0.0)), np.array(turn))
    shown = virtual_imu(legs, joints, UPRIGHT, FLAT)
    assert shown.gyro == pytest.approx(np.array(turn), abs=0.02)


@given(turn=st.tuples(rate, rate, rate))
def test_over_two_feet_all_is_seen_but_the_turn_about_the_line_through_them(turn: tuple[float, float, float]) -> None:
    feet = standing(attitude(0.0, 0.0))
    legs, joints = sample(feet, np.array(turn), (True, False, False, True))
    line = (feet[3] - feet[0]) / np.linalg.norm(feet[3] - feet[0])
    shown = virtual_imu(legs, joints, UPRIGHT, FLAT)
    assert shown.gyro == pytest.approx(np.array(turn) - (line @ np.array(turn)) * line, abs=0.01)
    assert shown.accel.tolist() == [0.0, 0.0, GRAVITY]


@pytest.mark.parametrize("contact", [(False, False, False, False), (True, False, False, False)])
def test_without_two_standing_feet_the_attitude_is_kept(contact: tuple[bool, ...]) -> None:
    legs, joints = sample(standing(attitude(0.1, 0.0)), np.array((0.5, 0.0, 0.0)), contact)
    shown = virtual_imu(legs, joints, UPRIGHT, FLAT)
    assert (shown.gyro.tolist(), shown.accel.tolist()) == ([0.0, 0.0, 0.0], [0.0, 0.0, GRAVITY])


@pytest.mark.parametrize(("fault", "seed", "turn"), [("IMU not a number", 1, 0.22), ("IMU frozen", 3, -0.29)])
def test_an_imu_that_fails_in_a_walk_leaves_the_robot_standing_upright(fault: str, seed: int, turn: float) -> None:
    trial = Trial(seed, conditions=Conditions(delay=0.008))
    trial.stand_up()
    trial.run(2.2, (0.5, 0.0, turn))
    trial.spoil(fault)
    record = trial.run(3.0)
    assert not trial.fallen
    assert record.tilt.max() < radians(4.0)
    assert record.tilt[-1] < radians(1.0)


@pytest.mark.parametrize("phase", [0.0, 0.17, *(pytest.param(phase, marks=MORE) for phase in (0.09, 0.26))])
def test_a_robot_that_loses_its_imu_at_full_speed_knows_its_speed_while_it_slows_down_and_stands(phase: float) -> None:
    trial = Trial(7, conditions=Conditions(delay=0.008))
    trial.stand_up()
    trial.run(3.6 + phase, (1.6, 0.0, 0.0))
    trial.spoil("IMU silent")
    worst = 0.0
    for _ in range(600):
        speed = float(np.hypot(*trial.step().velocity[:2]))
        worst = max(worst, abs(speed - float(np.hypot(*trial.gait.state.velocity[:2]))))
    assert not trial.fallen
    assert worst < 0.3
    assert speed < 0.05
    assert trial.gait.mode == "stand"


def test_half_of_the_samples_of_an_imu_will_do() -> None:
    trial = Trial(1, conditions=Conditions(delay=0.008))
    trial.stand_up()
    trial.run(1.0, (0.6, 0.0, 0.3))
    turns = iter(range(10_000))
    trial.spoil(lambda imu, joints: (imu if next(turns) % 2 else None, joints))
    record = trial.run(4.0, (0.6, 0.0, 0.3))
    assert record.tilt.max() < radians(3.0)
    assert record.velocity[-200:].mean(axis=0) == pytest.approx((0.6, 0.0, 0.3), abs=0.05)


@given(seed=st.integers(0, 1000), contact=st.sampled_from([ALL, (True, True, False, True), (False, True, True, False)]))
def test_the_turn_is_the_least_squares_of_all_standing_feet_with_tikhonovs_term(
    seed: int, contact: tuple[bool, ...]
) -> None:
    """Feet that move at random, as no rigid body would have it: each row says way = arm x turn, and a last one turn = 0."""
    random = np.random.default_rng(seed)
    angles = inverse(standing(attitude(0.0, 0.0)) + random.normal(0.0, 0.02, (4, 3))).joints
    joints = JointSample(angles, random.normal(0.0, 0.3, 12), np.zeros(12), np.array(contact))
    legs = leg_state(angles.tolist(), LEVEL)
    moving, rolling = foot_velocities(legs, angles.tolist(), joints.velocity.tolist(), (0.0, 0.0, 0.0), LEVEL)
    stands = np.array(contact)
    arms, ways = np.array(legs.feet)[stands], (np.array(moving) - np.array(rolling))[stands]
    arms, ways = arms - arms.mean(axis=0), ways - ways.mean(axis=0)
    rows_ = [np.cross(arm, np.eye(3)).T for arm in arms]
    matrix = np.vstack((*rows_, 1e-3**0.5 * np.eye(3)))
    turn = np.linalg.lstsq(matrix, np.concatenate((ways.ravel(), np.zeros(3))), rcond=None)[0]
    across = np.cross((0.0, 0.0, 1.0), arms)
    off = np.linalg.lstsq(across, -arms[:, 2], rcond=None)[0]
    vertical = np.cross(off, (0.0, 0.0, 1.0)) + np.array((0.0, 0.0, 1.0))
    righting = np.cross(vertical / np.linalg.norm(vertical), (0.0, 0.0, 1.0)) / CATCH_UP
    assert righting[2] == pytest.approx(0.0, abs=1e-9), "the correction of the horizon never turns the heading"
    shown = virtual_imu(legs, joints, UPRIGHT, FLAT).gyro
    assert shown == pytest.approx(np.clip(turn + righting, -2.0, 2.0), abs=1e-4)


@given(roll=lean, pitch=lean)
def test_two_feet_show_the_attitude_but_about_the_line_through_them(roll: float, pitch: float) -> None:
    feet = standing(attitude(roll, pitch))
    legs, joints = sample(feet, np.zeros(3), (True, False, False, True))
    up = virtual_imu(legs, joints, UPRIGHT, FLAT).accel / GRAVITY
    line = (feet[3] - feet[0]) / np.linalg.norm(feet[3] - feet[0])
    assert up @ line == pytest.approx(0.0, abs=0.02 * np.hypot(roll, pitch) + 1e-12)
    assert np.linalg.norm(up) == pytest.approx(1.0)


def test_feet_that_bounce_show_no_more_than_two_rad_per_s() -> None:
    legs, joints = sample(standing(attitude(0.0, 0.0)), np.array((0.0, 0.0, -7.0)))
    assert virtual_imu(legs, joints, UPRIGHT, FLAT).gyro[2] == -2.0
