"""Samples that have waited for their reader."""

from __future__ import annotations

import numpy as np
import pytest

from robot.hardware.body import ImuSample, JointSample, Sample
from robot.hardware.overdue import merged, taken_together


def sample(number: int) -> Sample:
    random = np.random.default_rng(number)
    joints = JointSample(
        random.normal(size=12), random.normal(size=12), random.normal(size=12), np.ones(4, dtype=np.bool_)
    )
    return Sample(0.005 * number, ImuSample(random.normal(size=3), random.normal(size=3)), joints)


@pytest.mark.parametrize(
    ("hz", "waited", "many"),
    [(200.0, 0.0, 1), (200.0, 0.009, 1), (200.0, 0.011, 4), (500.0, 0.011, 10), (100.0, 0.2, 2), (50.0, 0.2, 1)],
)
def test_a_reader_who_is_late_takes_as_many_as_one_step_may_stand_for(hz: float, waited: float, many: int) -> None:
    assert taken_together(hz, waited) == many


def test_one_sample_stays_as_it_is() -> None:
    one = sample(1)
    assert merged([one]) is one


def test_several_are_the_newest_and_no_turn_is_lost() -> None:
    samples = [sample(number) for number in range(4)]
    one = merged(samples)
    assert one.time == samples[-1].time
    assert one.joints is samples[-1].joints
    assert 4 * 0.005 * one.imu.gyro == pytest.approx(sum(0.005 * each.imu.gyro for each in samples))
    assert 4 * one.imu.accel == pytest.approx(sum(each.imu.accel for each in samples))
