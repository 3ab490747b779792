"""Sensors that cannot be believed: how that is noticed, and that no robot falls over it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from robot.control.gait_controller import GaitController
from robot.estimation.plausibility import ImuWatch, JointWatch
from robot.hardware.body import JOINT_NAMES, ImuSample, JointSample
from robot.hardware.sensors import Sensors
from robot.model.actuators import ActuatorDesign
from robot.model.kinematics import inverse
from robot.model.parameters import GRAVITY, SIT_HEIGHT
from robot.model.stance import nominal_feet
from robot.scenes.scene import Box, Scene
from robot.testing import FAULTS, FLAT, PERIOD, Conditions, Spoil, Trial

MORE = pytest.mark.slow(reason="faults that are found in the same way as those that run by default")

POSE = inverse(nominal_feet(SIT_HEIGHT)).joints
STANDING_ON = np.ones(4, dtype=np.bool_)


def imu(noise: float = 0.0) -> ImuSample:
    return ImuSample(np.array((0.1 + noise, 0.2, 0.3)), np.array((0.0, noise, GRAVITY)))


def joints(noise: float = 0.0) -> JointSample:
    return JointSample(POSE + noise, np.full(12, 0.05 + noise), np.zeros(12), STANDING_ON)


def with_joint(joint: int, value: float) -> JointSample:
    position = POSE.copy()
    position[joint] = value
    return JointSample(position, np.zeros(12), np.zeros(12), STANDING_ON)


# -- noticing -------------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "bad",
    [
        None,
        ImuSample(np.array((math.nan, 0.0, 0.0)), np.array((0.0, 0.0, GRAVITY))),
        ImuSample(np.zeros(3), np.array((0.0, 0.0, math.inf))),
        ImuSample(np.array((900.0, 0.0, 0.0)), np.array((0.0, 0.0, GRAVITY))),
    ],
)
def test_an_imu_that_cannot_be_believed_is_replaced_at_once_and_lost_after_a_tenth_of_a_second(
    bad: ImuSample | None,
) -> None:
    watch = ImuWatch()
    assert watch.check(PERIOD, imu()) is not None
    for step in range(20):
        assert not watch.lost, step
        assert watch.check(PERIOD, bad and ImuSample(bad.gyro, bad.accel)) is None
    assert watch.lost


def test_an_imu_slower_than_the_encoders_will_do_and_one_that_stops_will_not() -> None:
    watch = ImuWatch()
    sample = imu()
    for step in range(60):
        if step % 4 == 0:
            sample = imu(1e-4 * step)
        assert watch.check(PERIOD, sample) is sample
    assert not watch.lost
    for _ in range(40):
        put = watch.check(PERIOD, sample)
    assert watch.lost
    assert put is None


def test_an_imu_that_repeats_itself_is_frozen_and_one_at_perfect_rest_is_not() -> None:
    frozen, resting = ImuWatch(), ImuWatch()
    for _ in range(60):
        rest = ImuSample(np.zeros(3), np.array((0.0, 0.0, GRAVITY)))
        frozen.check(PERIOD, imu())
        resting.check(PERIOD, rest)
    assert frozen.lost
    assert not resting.lost


def test_a_lost_imu_is_back_after_half_a_second_of_good_samples() -> None:
    watch = ImuWatch()
    for _ in range(30):
        watch.check(PERIOD, None)
    for step in range(100):
        assert watch.lost, step
        watch.check(PERIOD, imu(1e-4 * step))
    assert not watch.lost


@pytest.mark.parametrize("bad", [math.nan, math.inf, 12.0])
def test_a_joint_that_cannot_be_believed_is_where_it_was_told_to_be(bad: float) -> None:
    watch = JointWatch()
    watch.check(PERIOD, joints(), lambda: None)
    told = POSE + 0.1
    kept = watch.check(PERIOD, with_joint(7, bad), lambda: told)
    assert watch.bad == [7]
    assert kept.position[7] == told[7]
    assert kept.position[6] == POSE[6]
    assert not watch.lost
    for _ in range(4):
        kept = watch.check(PERIOD, with_joint(7, bad), lambda: None)
    assert watch.lost
    assert kept.position[7] == told[7]


def test_a_moving_joint_that_shows_the_same_to_the_last_bit_is_frozen() -> None:
    watch = JointWatch()
    for step in range(12):
        moving = joints(1e-4 * step)
        moving.position[3], moving.velocity[3] = 0.2, 0.4
        watch.check(PERIOD, moving, lambda: None)
    assert watch.bad == [3]
    assert watch.lost


# -- what the robot does --------------------------------------------------------------------------------------------------------

QUICK = ("IMU frozen", "knee encoder not a number", "one contact stuck closed", "all contacts stuck open")


@pytest.mark.parametrize("fault", [pytest.param(name, marks=() if name in QUICK else MORE) for name in FAULTS])
def test_no_fault_of_a_sensor_fells_a_walking_robot(fault: str) -> None:
    trial = Trial(1)
    trial.stand_up()
    trial.run(1.8, (0.5, 0.0, 0.2))
    trial.spoil(fault)
    trial.run(2.4)
    assert not trial.fallen
    if "IMU" in fault:
        assert (trial.gait.mode, trial.gait.goal, trial.gait.aim) == ("stand", "walk", "stand")
        assert trial.gait.lost == ("imu",)
        assert abs(trial.gait.state.velocity[0]) < 0.05
    elif "encoder" in fault:
        assert (trial.gait.mode, trial.gait.goal) == ("sit", "sit")
        assert trial.gait.lost == ("joints",)
        assert trial.body.truth().position[2] < 0.22
    else:
        assert trial.gait.mode == "walk"
        assert set(trial.gait.lost) <= {"contact fl", "contact fr", "contact rl", "contact rr"}
        assert trial.gait.lost
        assert trial.gait.state.velocity[0] > 0.3


def test_it_walks_on_when_the_imu_is_back() -> None:
    trial = Trial(2)
    trial.stand_up()
    trial.run(1.5, (0.5, 0.0, 0.0))
    trial.spoil("IMU silent")
    trial.run(1.5)
    modes = [trial.gait.mode]
    trial.spoil(None)
    trial.run(1.5)
    modes.append(trial.gait.mode)
    assert modes == ["stand", "walk"]
    assert not trial.gait.lost
    assert not trial.fallen


def test_a_contact_that_works_again_is_believed_again() -> None:
    trial = Trial(3)
    trial.stand_up()
    trial.run(1.2, (0.3, 0.0, 0.0))
    trial.spoil("one contact stuck closed")
    trial.run(1.0)
    lost = [trial.gait.lost]
    trial.spoil(None)
    trial.run(1.2)
    lost.append(trial.gait.lost)
    assert lost == [("contact fl",), ()]
    assert not trial.fallen


def test_after_silence_of_the_encoders_it_sits_down() -> None:
    trial = Trial(1)
    trial.stand_up()
    trial.run(1.5, (0.4, 0.0, 0.0))
    trial.gait.interrupt()
    assert trial.gait.mode == "lowering"
    trial.run(3.4)  # steps that bring the walk to rest come first
    assert (trial.gait.mode, trial.gait.goal) == ("sit", "sit")
    assert not trial.fallen


def test_lost_joints_before_the_first_step_keep_it_sitting() -> None:
    gait = GaitController()
    gait.request("stand")
    for _ in range(100):
        targets = gait.step(PERIOD, imu(), with_joint(0, math.nan))
        assert np.isfinite(targets.position).all()
        assert np.isfinite(targets.effort).all()
    assert gait.mode == "sit"


# -- an encoder that sticks -------------------------------------------------------------------------------------------------------


def stuck(joint: int) -> Spoil:
    """It shows one place, with the noise of a good one, and a speed of nothing but noise."""
    held: list[float] = []
    rng = np.random.default_rng(joint)

    def spoil(imu: ImuSample, joints: JointSample) -> tuple[ImuSample | None, JointSample]:
        held[:] = held or [float(joints.position[joint])]
        position, velocity = joints.position.copy(), joints.velocity.copy()
        position[joint], velocity[joint] = held[0] + 5e-4 * rng.standard_normal(), 0.05 * rng.standard_normal()
        return imu, JointSample(position, velocity, joints.effort, joints.contact)

    return spoil


@pytest.mark.parametrize(("joint", "speed", "within"), [(1, 1.6, 0.6), (5, 1.0, 0.6), (10, 0.5, 0.6), (6, 1.0, 2.6)])
def test_an_encoder_that_sticks_is_found_named_and_not_taken_for_ice(joint: int, speed: float, within: float) -> None:
    trial = Trial(940000 + joint, conditions=Conditions(actuators=ActuatorDesign(), sensors=Sensors.real()))
    trial.stand_up()
    trial.run(1.3 + 0.037 * joint, (speed, 0.0, 0.0))
    assert "joints" not in trial.gait.lost
    trial.spoil(stuck(joint))
    for _ in range(round(within / PERIOD)):
        trial.step()
        if "joints" in trial.gait.lost:
            break
    assert trial.gait.doubtful_joints == (JOINT_NAMES[joint],)
    trial.run(2.5)
    assert not trial.fallen
    assert trial.gait.mode == "sit"
    assert trial.gait.slips == 0


def test_a_leg_that_is_held_fast_is_no_encoder_that_sticks() -> None:
    """A wall across its way: feet and knees press against it, and go nowhere."""
    wall = Scene("wall", FLAT.bounds, (Box(1.6, 0.0, 0.3, 6.0, height=0.3),), FLAT.start, FLAT.dock)
    trial = Trial(950001, wall, Conditions(actuators=ActuatorDesign(), sensors=Sensors.real()))
    trial.stand_up()
    record = trial.run(5.0, (0.6, 0.0, 0.0))
    assert record.touched
    assert "joints" not in trial.gait.lost
