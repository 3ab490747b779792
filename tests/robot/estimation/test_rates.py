"""What is learned from the sensors does not depend on how often they are read: 100 to 500 Hz."""

from __future__ import annotations

import numpy as np
import pytest

from robot.estimation.gyro_bias import FootLine, GyroBias
from robot.estimation.leg_odometry import Estimator
from robot.estimation.plausibility import ContactWatch
from robot.hardware.body import ImuSample, JointSample
from robot.model.kinematics import inverse
from robot.model.legs import LEVEL, leg_state
from robot.model.parameters import GRAVITY, STAND_HEIGHT
from robot.model.stance import nominal_feet

RATES = (100.0, 200.0, 500.0)
STANDING = inverse(nominal_feet(STAND_HEIGHT)).joints
AT_REST = ImuSample(np.zeros(3), np.array((0.0, 0.0, GRAVITY)))


def after(seconds: float, hz: float, standing: bool) -> Estimator:
    """An estimator that has seen so much of a robot at rest, on its feet or in the air."""
    estimate = Estimator()
    joints = JointSample(STANDING, np.zeros(12), np.zeros(12), np.full(4, standing))
    for _ in range(round(seconds * hz)):
        estimate.update(1.0 / hz, AT_REST, joints)
    return estimate


def test_in_the_air_the_estimate_grows_uncertain_by_the_second_and_not_by_the_sample() -> None:
    slow, design, fast = (after(0.5, hz, standing=False).deviation for hz in RATES)
    assert slow == pytest.approx(design, rel=0.03)
    assert fast == pytest.approx(design, rel=0.03)


def test_on_its_feet_the_place_grows_uncertain_by_the_second_and_not_by_the_sample() -> None:
    slow, design, fast = (after(20.0, hz, standing=True).deviation[0] for hz in RATES)
    assert slow == pytest.approx(design, rel=0.1)
    assert fast == pytest.approx(design, rel=0.1)


def test_a_second_at_rest_says_as_much_about_the_gyros_bias_at_every_rate() -> None:
    deviations: list[float] = []
    for hz in RATES:
        bias = GyroBias()
        for _ in range(round(hz)):
            bias.wander(1.0 / hz)
            bias.rest(1.0 / hz, (0.001, 0.0, 0.0))
        deviations.append(bias.deviation[0])
    assert deviations == pytest.approx([deviations[1]] * 3, rel=0.02)


@pytest.mark.parametrize("hz", RATES)
def test_a_common_stance_of_a_tenth_of_a_second_tells_about_turning_and_half_of_it_does_not(hz: float) -> None:
    for seconds, tells in ((0.12, True), (0.05, False)):
        line = FootLine()
        for step in range(round(seconds * hz)):
            angle = 0.01 * step / hz
            assert line.update(1.0 / hz, (0, 3), (np.cos(angle), np.sin(angle), 0.0), (0.0, 0.0, 0.0)) is None
        told = line.update(1.0 / hz, (-1, -1), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
        assert (told is not None) == tells
        if told is not None:
            assert told[0] == pytest.approx(0.01, rel=0.01)


class _Swinging:
    """A walk whose first foot is always in the same part of its step."""

    def __init__(self, progress: float, late: float = 0.0) -> None:
        self.progress = progress
        self.lateness = late

    def swing(self, leg: int) -> float:
        return self.progress if leg == 0 else -1.0

    def late(self, leg: int) -> float:
        return self.lateness if leg == 0 else 0.0


@pytest.mark.parametrize("hz", RATES)
def test_a_contact_that_is_closed_through_a_quick_swing_is_not_believed(hz: float) -> None:
    watch = ContactWatch()
    legs = leg_state(STANDING.tolist(), LEVEL)
    closed = JointSample(STANDING, np.zeros(12), np.zeros(12), np.ones(4, dtype=np.bool_))
    for _ in range(round(0.03 * hz)):
        watch.check(1.0 / hz, closed, legs, _Swinging(0.2), silent=False)
    watch.check(1.0 / hz, closed, legs, _Swinging(0.6), silent=False)
    assert watch.trusted == [False, True, True, True]


@pytest.mark.parametrize("hz", RATES)
def test_a_contact_that_is_open_is_not_believed_once_the_leg_has_borne_weight_for_a_while(hz: float) -> None:
    watch = ContactWatch()
    legs = leg_state(STANDING.tolist(), LEVEL)
    bearing = np.array(legs.weight)
    bearing[:3] -= np.array(legs.jacobians[0]).T @ np.array((0.0, 0.0, 80.0))
    contact = np.array((False, True, True, True))
    sample = JointSample(STANDING, np.zeros(12), bearing, contact)
    times = 0
    while watch.trusted[0]:
        watch.check(1.0 / hz, sample, legs, _Swinging(-1.0, late=0.05), silent=False)
        times += 1
        assert times < 100
    assert times / hz == pytest.approx(0.025, abs=0.006)
