"""`robot.testing`: what a trial writes down, and how each fault spoils the samples."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest

from robot.hardware.body import ImuSample, JointSample
from robot.testing import FAULTS, PERIOD, Conditions, Record, Spoil, Trial


def record(velocity: np.ndarray, pose: np.ndarray) -> Record:
    rows = len(velocity)
    flat = np.zeros(rows)
    return Record(velocity, pose, pose, flat, flat, flat, np.zeros((rows, 2)), frozenset())


def test_speeds_are_averaged_over_a_sliding_window() -> None:
    velocity = np.random.default_rng(1).normal(size=(50, 3))
    averaged = record(velocity, velocity).averaged(10 * PERIOD)
    expected = np.column_stack([np.convolve(velocity[:, axis], np.full(10, 0.1), "valid") for axis in range(3)])
    assert averaged == pytest.approx(expected)


def test_the_distance_is_that_of_the_path_and_not_of_the_sway_on_it() -> None:
    """A quarter of a circle of 2 m in ten seconds, on it a sway of 5 mm at 2 Hz."""
    times = np.arange(2001) * PERIOD
    angle = times / 10.0 * pi / 2
    sway = 0.005 * np.sin(2 * pi * 2.0 * times)
    pose = np.column_stack([(2.0 + sway) * np.cos(angle), (2.0 + sway) * np.sin(angle), angle])
    assert record(pose, pose).distance == pytest.approx(pi, rel=1e-3)
    every_step = float(np.linalg.norm(np.diff(pose[:, :2], axis=0), axis=1).sum())
    assert every_step > 1.005 * pi


def imu(value: float) -> ImuSample:
    return ImuSample(np.full(3, value), np.full(3, 10.0 * value))


def joints(value: float) -> JointSample:
    return JointSample(np.full(12, value), np.full(12, -value), np.zeros(12), np.array([True, False, True, False]))


def spoilt(name: str) -> tuple[ImuSample | None, JointSample]:
    """The second pair of samples, after a first one."""
    spoil: Spoil = FAULTS[name]()
    spoil(imu(1.0), joints(1.0))
    return spoil(imu(2.0), joints(2.0))


def test_an_imu_that_is_silent_mad_or_frozen() -> None:
    assert spoilt("IMU silent")[0] is None
    mad, frozen = spoilt("IMU not a number")[0], spoilt("IMU frozen")[0]
    assert mad is not None
    assert np.isnan([*mad.gyro, *mad.accel]).all()
    assert frozen is not None
    assert (frozen.gyro[0], frozen.accel[0]) == (1.0, 10.0)


@pytest.mark.parametrize(("name", "joint"), [("knee encoder frozen", 5), ("shoulder encoder frozen", 10)])
def test_a_frozen_encoder_shows_what_it_showed_first(name: str, joint: int) -> None:
    _, shown = spoilt(name)
    assert (shown.position[joint], shown.velocity[joint]) == (1.0, -1.0)
    assert np.delete(shown.position, joint).tolist() == [2.0] * 11


@pytest.mark.parametrize(("name", "joint"), [("knee encoder not a number", 2), ("hip encoder not a number", 6)])
def test_a_mad_encoder_shows_no_number(name: str, joint: int) -> None:
    _, shown = spoilt(name)
    assert np.flatnonzero(np.isnan(shown.position)).tolist() == [joint]
    assert np.flatnonzero(np.isnan(shown.velocity)).tolist() == [joint]


@pytest.mark.parametrize(
    ("name", "felt", "shown"),
    [
        ("one contact stuck closed", [False, True, False, True], [True, True, False, True]),
        ("one contact stuck open", [False, True, False, True], [False, True, False, False]),
        ("all contacts stuck closed", [False, True, False, True], [True, True, True, True]),
        ("all contacts stuck open", [False, True, False, True], [False, False, False, False]),
    ],
)
def test_a_stuck_contact_says_always_the_same(name: str, felt: list[bool], shown: list[bool]) -> None:
    sample = joints(1.0)
    given = JointSample(sample.position, sample.velocity, sample.effort, np.array(felt))
    assert FAULTS[name]()(imu(1.0), given)[1].contact.tolist() == shown
    assert given.contact.tolist() == felt


def test_a_fault_that_does_not_exist_is_told_the_nearest() -> None:
    with pytest.raises(LookupError, match=r"no fault is called 'IMU silnt'; did you mean 'IMU silent'\?"):
        Trial(1).spoil("IMU silnt")


def test_the_controller_gets_spoilt_samples_until_they_are_mended() -> None:
    trial, given = Trial(1), list[bool]()

    def silence(imu: ImuSample, joints: JointSample) -> tuple[None, JointSample]:
        given.append(True)
        return None, joints

    trial.step()
    trial.spoil(silence)
    trial.step()
    trial.step()
    trial.spoil(None)
    trial.step()
    assert given == [True, True]


def test_the_same_trial_is_the_same_bit_for_bit_and_another_seed_is_another() -> None:
    rows = [Trial(seed, conditions=Conditions(friction=0.5)).run(0.2).odometry for seed in (1, 1, 2)]
    assert rows[0].tobytes() == rows[1].tobytes()
    assert rows[0].tobytes() != rows[2].tobytes()


def test_a_trial_writes_down_the_truth_of_its_body() -> None:
    trial = Trial(3, conditions=Conditions(payload=5.0))
    seen = trial.run(0.1)
    truth = trial.body.truth()
    assert seen.pose.shape == (20, 3)
    assert seen.pose[-1] == pytest.approx([*truth.position[:2], truth.yaw])
    assert seen.height[-1] == truth.position[2]
    assert seen.power[-1] == truth.power


def test_a_belly_on_the_floor_is_a_fall_although_the_body_is_level(monkeypatch: pytest.MonkeyPatch) -> None:
    trial = Trial(1)
    trial.stand_up()
    assert not trial.fallen
    assert not trial.body.truth().lying
    monkeypatch.setattr(trial.body, "command", lambda targets: None)  # no target reaches the drives any more

    sunk = trial.run(3.0)

    assert trial.fallen
    assert (trial.body.truth().fallen, trial.body.truth().lying) == (False, True)
    assert sunk.tilt.max() < 0.2
    assert sunk.height[-1] < 0.25  # it ends with the first touch of the thighs


def test_who_sits_has_not_fallen() -> None:
    trial = Trial(1)
    trial.run(1.0)
    assert not trial.fallen
