"""A walk that is caught: from any moment, at any speed, to rest, by a controller that has not walked it."""

from __future__ import annotations

from math import hypot

import numpy as np
import pytest

from robot.control.catch import Catch, ground_speed
from robot.control.safe_stop import SafeStop
from robot.hardware.body import ImuSample, JointSample
from robot.link.firmware import Drives
from robot.model.kinematics import inverse, leg_jacobian
from robot.model.modes import Mode
from robot.model.parameters import SIDES
from robot.model.stance import nominal_feet
from robot.testing import FAULTS, PERIOD, Trial, wrong_gyro
from tests.robot.control.kit import DT, HEIGHT, joints_at, standing

REST = ImuSample(np.zeros(3), np.array((0.0, 0.0, 9.81)))


def moving(vx: float, vy: float, contact: tuple[bool, ...] = (True,) * 4) -> JointSample:
    """The joints of a level robot whose body goes at this velocity over its feet."""
    at = nominal_feet(HEIGHT)
    angles = inverse(at).joints
    legs = [leg_jacobian(side, *angles[3 * leg : 3 * leg + 3]) for leg, side in enumerate(SIDES)]
    return joints_at(at, contact, np.concatenate([np.linalg.solve(jacobian, (-vx, -vy, 0.0)) for jacobian in legs]))


def walking(seed: int, speed: float, seconds: float) -> Trial:
    """A robot in physics that has walked for so long after it was fast enough."""
    trial = Trial(seed)
    trial.stand_up()
    trial.run(2.0 + speed + seconds, (speed, 0.0, 0.0))
    return trial


def left_alone(trial: Trial, seconds: float) -> bool:
    """Whether the robot falls although its drives act when the targets stop."""
    drives, body, begun = Drives(), trial.body, trial.body.time
    drives.obey(begun, 1)
    while body.time < begun + seconds:
        due = drives.due()
        assert due is not None
        body.advance(due)
        body.command(drives.act(body.time, body.joints(), body.imu()))
        if body.truth().fallen:
            return True
    return False


@pytest.mark.parametrize(("vx", "vy"), [(0.5, 0.0), (-0.4, 0.2), (1.6, -0.4)])
def test_the_feet_that_stand_tell_the_speed(vx: float, vy: float) -> None:
    assert ground_speed(moving(vx, vy)) == pytest.approx((vx, vy), abs=1e-6)
    lifted = moving(vx, vy, (True, False, False, True))
    lifted.velocity[3:9] += 3.0
    assert ground_speed(lifted) == pytest.approx((vx, vy), abs=1e-6)


def test_a_speed_that_can_only_be_a_slip_is_bounded() -> None:
    assert hypot(*ground_speed(moving(6.0, 8.0))) == pytest.approx(2.0)


def test_a_robot_at_rest_is_not_caught() -> None:
    assert Catch.begin(REST, standing()) is None
    assert Catch.begin(REST, moving(0.2, 0.1)) is None
    assert Catch.begin(REST, moving(0.3, 0.1)) is not None


def test_feet_that_slip_for_ever_do_not_keep_it_walking() -> None:
    sliding = moving(1.0, 0.0)
    catch = Catch.begin(REST, sliding)
    assert catch is not None
    lasted = 0.0
    while not catch.over:
        catch.step(DT, REST, sliding)
        lasted += DT
    assert lasted == pytest.approx(2.0, abs=2 * DT)


MORE = pytest.mark.slow(reason="more phases of a step")
PHASES = [0.27, *(pytest.param(phase, marks=MORE) for phase in (0.0, 0.13, 0.41))]
"""Seconds after the start of a step at which something fails."""


@pytest.mark.parametrize("phase", PHASES)
@pytest.mark.parametrize("speed", [1.0, 1.6])
def test_a_walking_robot_whose_targets_stop_comes_to_rest_and_sits_without_a_fall(speed: float, phase: float) -> None:
    trial = walking(7, speed, phase)
    assert not left_alone(trial, 3.2)
    truth = trial.body.truth()
    assert truth.position[2] < 0.2
    assert np.abs(truth.velocity).max() < 0.05


def test_without_an_imu_it_sits_down_at_once() -> None:
    stop, sample = SafeStop(), moving(1.0, 0.0)
    for _ in range(round(1.2 / DT) + 2):
        stop.step(DT, sample)
    assert stop.done


@pytest.mark.parametrize("phase", PHASES)
@pytest.mark.parametrize("fault", ["knee encoder not a number", "knee encoder frozen", "shoulder encoder frozen"])
def test_a_robot_that_loses_an_encoder_at_full_speed_sits_down_and_hardly_leans(fault: str, phase: float) -> None:
    trial = walking(7, 1.6, phase)
    trial.spoil(fault)
    walked = trial.run(3.5)
    assert not trial.fallen
    assert trial.gait.mode == "sit"
    assert np.degrees(walked.tilt.max()) < 8.0


def test_a_walk_with_a_wrong_gyro_is_given_up_at_four_metres_a_second_squared() -> None:
    trial = walking(7, 1.6, 0.13)
    trial.spoil(wrong_gyro("scaled", 1, -1.42))
    while trial.gait.mode == Mode.WALK:
        trial.step()
    fast = trial.gait.velocity_command[0]
    trial.run(0.2)
    assert trial.gait.velocity_command[0] == pytest.approx(fast - 0.8, abs=0.03)
    trial.run(3.0)
    assert not trial.fallen


def test_a_leg_that_has_lost_an_encoder_pushes_while_its_foot_stands_and_is_held_when_it_has_lifted() -> None:
    trial = walking(7, 1.3, 0.13)
    lost = FAULTS["shoulder encoder frozen"]()
    lifted, standing = [], []
    while trial.gait.mode != Mode.LOWERING:
        targets = trial.gait.step(PERIOD, *lost(trial.body.imu(), trial.body.joints()))
        trial.body.command(targets)
        trial.body.advance(trial.body.time + PERIOD)
        if trial.gait.lost == ("joints",) and trial.gait.mode == Mode.STOPPING:
            (standing if trial.gait.state.contact[3] else lifted).append(targets.kp[9:12].min())
    assert min(lifted) > 100.0
    assert 0.0 in standing


def test_two_equal_runs_that_are_left_alone_end_in_the_same_place_to_the_last_bit() -> None:
    ends = []
    for _ in range(2):
        trial = walking(9, 0.8, 0.2)
        left_alone(trial, 1.5)
        ends.append(trial.body.truth().position)
    np.testing.assert_array_equal(*ends)
