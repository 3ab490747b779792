"""Sitting, and legs that lie under the body when it is to rise."""

from __future__ import annotations

import numpy as np

from robot.control.sitting import REST_TIME, Sitting
from robot.hardware.body import JointSample
from robot.model.bodies import GO2
from robot.model.kinematics import inverse
from robot.model.stance import nominal_feet

POSE = inverse(nominal_feet(GO2.sit_height, GO2), GO2).joints


def sample(angles: np.ndarray[tuple[int], np.dtype[np.float64]]) -> JointSample:
    return JointSample(angles, np.zeros(12), np.zeros(12), np.ones(4, dtype=np.bool_))


def test_springs_of_legs_that_the_body_lies_on_grow_until_it_may_rise() -> None:
    """As a Go2's do: it has no skid that would carry it."""
    sitting, under = Sitting(GO2), sample(POSE + np.tile((0.5, 0.0, 0.0), 4))
    for _ in range(400):
        assert not sitting.may_rise(under)
        strong = sitting.step(0.005, under, [0.0] * 12).freeze()
    assert strong.kp.max() == 4.0 * Sitting(GO2).step(0.005, under, [0.0] * 12).freeze().kp.max()
    assert sitting.may_rise(sample(POSE))


def test_springs_stay_soft_for_a_robot_that_is_not_to_rise_or_can() -> None:
    soft = Sitting(GO2).step(0.005, sample(POSE), [0.0] * 12).freeze().kp.max()
    for rises in (False, True):
        sitting = Sitting(GO2)
        for _ in range(int(REST_TIME / 0.005) + 20):
            if rises:
                sitting.may_rise(sample(POSE))
            assert sitting.step(0.005, sample(POSE), [0.0] * 12).freeze().kp.max() == soft
