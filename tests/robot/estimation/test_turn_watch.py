"""A gyro that is wrong and yet plausible: the standing feet tell, and a walk ends without a fall."""

from __future__ import annotations

from math import exp

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot.estimation.leg_odometry import Estimator
from robot.estimation.turn_watch import LASTING, LIMITS, MEMORY, QUIET, QUIET_TIME, UNSEEN, TurnWatch
from robot.geometry.vectors import Floats, Triple, to_body
from robot.hardware.body import ImuSample
from robot.hardware.sensors import Sensors
from robot.model.actuators import ActuatorDesign
from robot.model.modes import Mode
from robot.testing import Conditions, GyroFault, Trial, wrong_gyro
from tests.robot.estimation.stance import ALL, Swaying, joints

MORE = pytest.mark.slow(reason="more seeds")

DT = 0.005
DIAGONALS = (((0.3, 0.17, -0.5), (-0.3, -0.17, -0.5)), ((0.3, -0.17, -0.5), (-0.3, 0.17, -0.5)))
rate = st.floats(-1.0, 1.0)


def told(feet: tuple[Triple, ...], error: Floats, velocity: Triple = (0.5, 0.1, 0.0)) -> list[tuple[Triple, Triple]]:
    """What feet at rest tell of the body's velocity, by a gyro that shows `error` too much."""
    found = []
    for foot in feet:
        x, y, z = (np.array(velocity) - np.cross(error, foot)).tolist()
        found.append((foot, (x, y, z)))
    return found


def trot(watch: TurnWatch, error: Floats, seconds: float) -> float:
    """One diagonal stands after the other; returns how long it took to find the gyro wrong."""
    for step in range(round(seconds / DT)):
        if watch.wrong:
            return step * DT
        watch.check(DT, told(DIAGONALS[step // 4 % 2], error))
    return seconds


# -- what the feet tell -------------------------------------------------------------------------------------------------------


@given(rate, rate, rate)
def test_the_error_is_what_weighted_least_squares_tell_of_both_diagonals(x: float, y: float, z: float) -> None:
    watch, error, steps = TurnWatch(), 1e-2 * np.array((x, y, z)), 40
    trot(watch, error, steps * DT)
    rows, right = [UNSEEN**0.5 * np.eye(3)], [np.zeros(3)]
    for step in range(steps):
        weight = (DT * exp(-(steps - 1 - step) * DT / MEMORY)) ** 0.5
        for arm in DIAGONALS[step // 4 % 2] - np.mean(DIAGONALS[step // 4 % 2], axis=0):
            across = -np.cross(np.eye(3), arm).T
            rows.append(weight * across)
            right.append(weight * across @ error)
    least: Floats = np.linalg.lstsq(np.concatenate(rows), np.concatenate(right))[0]
    assert watch.error == pytest.approx(tuple(least), abs=1e-9)
    assert np.linalg.norm(least - error) < 0.5 * np.linalg.norm(error) + 1e-12


def test_a_pair_of_feet_shows_nothing_of_a_turn_about_the_line_between_them() -> None:
    watch, line = TurnWatch(), np.subtract(*DIAGONALS[0])
    for _ in range(100):
        watch.check(DT, told(DIAGONALS[0], line))
    assert watch.error == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)
    assert not watch.wrong


def test_the_feet_of_a_body_that_sways_tell_its_turn_and_by_how_much_the_gyro_is_off() -> None:
    for off in (np.zeros(3), np.array((0.02, -0.015, 0.01))):
        body, estimate, watch = Swaying(), Estimator(), TurnWatch()
        for step in range(1, 61):
            sway = 1.0 - np.cos(10.0 * step * DT * np.array((1.0, 1.1, 1.2)))
            velocity, turn = 0.05 * sway, 0.2 * sway[::-1]
            acceleration = (velocity - body.velocity) / DT
            body.move(DT, velocity, turn)
            shown = body.imu(acceleration)
            sample = ImuSample(shown.gyro + off, shown.accel)
            estimate.update(DT, sample, joints(body.angles, body.speeds, ALL))
            watch.check(DT, list(estimate.firm.values()))
        assert len(estimate.firm) == 4
        left = np.array(to_body(estimate.rotation, watch.error)) - off
        assert np.linalg.norm(left) < 0.15 * np.linalg.norm(off) + 3e-4


# -- the verdict --------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_an_error_beyond_the_limit_is_found_soon_and_one_below_it_never(axis: int) -> None:
    limit = LIMITS[axis] * np.eye(3)[axis]
    assert LASTING < trot(TurnWatch(), 4.0 * limit, 1.0) < 0.1
    assert trot(TurnWatch(), 0.9 * limit, 3.0) == 3.0


def test_an_error_that_changes_its_sign_with_every_step_is_found() -> None:
    watch = TurnWatch()
    for step in range(100):
        sign = 1.0 if step // 20 % 2 else -1.0
        watch.check(DT, told(DIAGONALS[step // 20 % 2], np.array((0.0, sign * 4.0 * LIMITS[1], 0.0))))
    assert watch.wrong


def test_a_wrong_turn_about_the_vertical_leaves_the_tilt_believed_and_the_reverse() -> None:
    yaw, tilt = TurnWatch(), TurnWatch()
    trot(yaw, np.array((0.0, 0.0, 0.5)), 1.0)
    trot(tilt, np.array((0.0, -0.5, 0.0)), 1.0)
    assert yaw.doubtful == (False, False, True)
    assert tilt.doubtful == (True, True, False)
    for step in range(40):
        tilt.check(DT, told(DIAGONALS[step // 4 % 2], np.array((0.0, 0.0, 0.5))))
    assert tilt.doubtful == (True, True, True)


def test_once_wrong_it_stays_so() -> None:
    watch = TurnWatch()
    trot(watch, np.array((0.5, 0.0, 0.0)), 1.0)
    for _ in range(400):
        watch.check(DT, told(DIAGONALS[0], np.zeros(3)))
    assert watch.wrong


def test_at_rest_it_gets_a_new_chance_when_it_shows_rest() -> None:
    watch = TurnWatch()
    trot(watch, np.array((0.5, 0.0, 0.0)), 1.0)
    for _ in range(400):
        watch.sits(DT, (0.0, QUIET * 1.01, 0.0))
    assert watch.wrong
    for step in range(round(QUIET_TIME / DT)):
        assert watch.wrong, step
        watch.sits(DT, (0.0, -QUIET * 0.99, 0.0))
    watch.sits(DT, (0.0, 0.0, 0.0))
    assert not watch.wrong
    assert trot(watch, np.array((0.5, 0.0, 0.0)), 1.0) < 0.1


def test_a_leg_in_doubt_makes_nobody_doubt_the_gyro() -> None:
    watch = TurnWatch()
    for step in range(400):
        watch.check(DT, told(DIAGONALS[0], np.array((1.0, 1.0, 1.0))), believable=step % 5 == 0)
    assert not watch.wrong


def test_feet_that_move_apart_make_nobody_doubt_the_gyro() -> None:
    watch = TurnWatch()
    (first, speed), other = told(DIAGONALS[0], np.zeros(3))
    for step in range(400):
        slipping = (
            (speed[0] + 0.4, speed[1], speed[2] - 0.4) if step % 10 == 0 else (speed[0], speed[1], speed[2] - 0.4)
        )
        watch.check(DT, [(first, slipping), other])
    assert not watch.wrong


def test_one_foot_tells_nothing() -> None:
    watch = TurnWatch()
    for _ in range(400):
        watch.check(DT, told(DIAGONALS[0], np.array((1.0, 1.0, 1.0)))[:1])
    assert watch.error == (0.0, 0.0, 0.0)
    assert not watch.wrong


# -- in physics ---------------------------------------------------------------------------------------------------------------


def real(**given: float) -> Conditions:
    """Sensors and drives as they are."""
    return Conditions(
        friction=given.get("friction", 0.8), sensors=Sensors.real(), actuators=ActuatorDesign(), delay=0.008
    )


@pytest.mark.parametrize(
    ("kind", "axis", "amount"),
    [("offset", 0, 0.4), ("scaled", 1, -1.0), ("swapped", 0, 0.0), ("offset", 2, -0.6), ("scaled", 2, 0.0)],
)
def test_a_walk_with_a_wrong_gyro_ends_standing(kind: GyroFault, axis: int, amount: float) -> None:
    trial = Trial(11, conditions=real())
    trial.stand_up()
    trial.run(1.8, (0.8, 0.0, 0.3))
    assert not trial.gait.lost
    trial.spoil(wrong_gyro(kind, axis, amount))
    trial.run(0.5)
    assert trial.gait.lost == ("gyro",)
    trial.run(2.5)
    assert not trial.fallen
    assert (trial.gait.mode, trial.gait.goal, trial.gait.aim) == (Mode.STAND, Mode.WALK, Mode.STAND)


@pytest.mark.parametrize(("kind", "chance"), [("offset", ("gyro",)), ("swapped", ())])
def test_in_a_robot_that_sits_a_wrong_gyro_that_shows_rest_gets_a_new_chance(
    kind: GyroFault, chance: tuple[str, ...]
) -> None:
    trial = Trial(12, conditions=real())
    trial.stand_up()
    trial.run(1.0, (0.6, 0.0, 0.4))
    trial.spoil(wrong_gyro(kind, 0, 0.4))
    trial.run(1.0)
    assert trial.gait.lost == ("gyro",)
    trial.gait.request(Mode.SIT)
    trial.run(4.5)
    assert (trial.gait.mode, trial.gait.lost) == (Mode.SIT, chance)
    trial.gait.request(Mode.STAND)
    trial.run(2.5)
    assert trial.gait.mode == Mode.STAND
    trial.run(1.0, (0.6, 0.0, 0.4))
    assert trial.gait.lost == ("gyro",)
    assert not trial.fallen


@pytest.mark.parametrize(
    ("seed", "amount", "turn"),
    [(5, 0.4, 0.4), *(pytest.param(*trial, marks=MORE) for trial in ((1, 0.4, 0.0), (10, -0.4, 0.0)))],
)
def test_a_walk_whose_gyro_is_wrong_about_the_tilt_waits_for_its_feet_and_sits(
    seed: int, amount: float, turn: float
) -> None:
    trial = Trial(seed, conditions=real())
    trial.stand_up()
    trial.run(1.0 + 0.03 * seed, (0.6, 0.0, turn))
    trial.spoil(wrong_gyro("offset", 0, amount))
    trial.run(1.0)
    assert trial.gait.lost == ("gyro",)
    trial.gait.request(Mode.SIT)
    trial.run(5.0)
    assert (trial.fallen, trial.gait.mode) == (False, Mode.SIT)


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=MORE) for seed in (3, 6))])
def test_feet_that_seem_to_slide_under_a_wrong_gyro_are_not_taken_for_ice(seed: int) -> None:
    trial = Trial(seed, conditions=real())
    trial.stand_up()
    trial.run(1.0 + 0.03 * seed, (0.6, 0.0, 0.4))
    trial.spoil(wrong_gyro("offset", 0, 0.8))
    trial.run(1.0)
    assert (trial.gait.lost, trial.gait.slips) == (("gyro",), 0)


@pytest.mark.parametrize(("friction", "push"), [(0.8, 40.0), (0.8, -40.0), (0.2, 0.0)])
def test_neither_a_push_nor_a_slippery_floor_is_taken_for_a_wrong_gyro(friction: float, push: float) -> None:
    trial = Trial(13, conditions=real(friction=friction))
    trial.stand_up()
    trial.run(1.6, (0.6, 0.0, 0.0))
    for _ in range(2):
        trial.body.push((0.0, push, 0.0))
        trial.run(1.3, (0.6, 0.0, 0.4))
    assert not trial.gait.lost
    assert not trial.fallen
