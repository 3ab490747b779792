"""Which foot contacts are believed, judged by a swing that is told and by forces that MuJoCo's transpose rule turns into torques."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot.estimation.plausibility import (
    BACK,
    FLYING,
    IN_THE_AIR,
    OVERDUE,
    PRESSING,
    ContactWatch,
    ImuWatch,
    JointWatch,
)
from robot.geometry.vectors import Floats
from robot.hardware.body import ImuSample, JointSample
from robot.model.legs import LEVEL, leg_state
from robot.model.parameters import GRAVITY
from tests.robot.estimation.stance import leg, standing

DT = 0.005


@dataclass
class Schedule:
    """A walk whose feet are where the test says."""

    progress: list[float] = field(default_factory=lambda: [-0.5] * 4)
    overdue: list[float] = field(default_factory=lambda: [0.0] * 4)

    def swing(self, leg: int) -> float:
        return self.progress[leg]

    def late(self, leg: int) -> float:
        return self.overdue[leg]


def pressed(forces: Floats, contact: tuple[bool, ...]) -> JointSample:
    """A robot whose feet are pushed by the ground with these forces (body axes, shape (4, 3)), and whose motors hold it."""
    sample = standing(contact=contact)
    legs = leg_state(sample.position.tolist(), LEVEL)
    for number in range(4):
        _, jacobian, _ = leg(number, sample.position)
        weight = np.array(legs.weight[3 * number : 3 * number + 3])
        sample.effort[3 * number : 3 * number + 3] = weight - jacobian.T @ forces[number]
    return sample


def watched(watch: ContactWatch, schedule: Schedule, sample: JointSample, samples: int = 1) -> list[bool] | None:
    legs = leg_state(sample.position.tolist(), LEVEL)
    for _ in range(samples - 1):
        watch.check(DT, sample, legs, schedule, silent=False)
    return watch.check(DT, sample, legs, schedule, silent=False)


def swung(watch: ContactWatch, contact: bool, leg: int = 2, steps: int = 20) -> None:
    """One whole swing of a foot whose contact shows the same all the while."""
    shown = tuple(contact if number == leg else True for number in range(4))
    for progress in np.linspace(0.0, 0.95, steps):
        schedule = Schedule(progress=[float(progress) if number == leg else -0.5 for number in range(4)])
        watched(watch, schedule, standing(contact=shown))


def test_a_foot_that_touches_all_through_its_flight_is_not_believed_until_it_lets_go_once() -> None:
    watch = ContactWatch()
    swung(watch, contact=True)
    assert watch.trusted == [True, True, False, True]
    swung(watch, contact=False)
    assert watch.trusted == [True] * 4


def test_of_a_foot_that_is_not_believed_the_schedule_says_whether_it_stands() -> None:
    watch = ContactWatch()
    swung(watch, contact=True)
    sample = standing()
    assert watched(watch, Schedule(progress=[-0.5, -0.5, 0.05, -0.5]), sample) == [True, True, False, True]
    assert watched(watch, Schedule(), sample) is None, "as it shows"


def test_one_open_moment_in_the_middle_of_a_swing_is_proof_of_a_working_contact() -> None:
    watch = ContactWatch()
    for number, progress in enumerate(np.linspace(0.0, 0.95, 20)):
        schedule = Schedule(progress=[-0.5, float(progress), -0.5, -0.5])
        assert IN_THE_AIR[0] < np.linspace(0.0, 0.95, 20)[5] < IN_THE_AIR[1]
        watched(watch, schedule, standing(contact=(True, number != 5, True, True)))
    assert watch.trusted == [True] * 4


def test_a_swing_too_quick_to_be_looked_at_gives_no_verdict() -> None:
    watch = ContactWatch()
    swung(watch, contact=True, steps=10)
    assert watch.trusted == [True] * 4


def flown(watch: ContactWatch, speed: float, samples: int, progress: float = 0.6) -> list[bool] | None:
    """The front left foot is in the air, moves so fast over the ground, and its contact is closed."""
    sample, schedule = standing(), Schedule(progress=[progress, -0.5, -0.5, -0.5])
    legs, believed = leg_state(sample.position.tolist(), LEVEL), None
    for _ in range(samples):
        believed = watch.check(DT, sample, legs, schedule, silent=False, speed=lambda leg: speed)
    return believed


def test_a_foot_that_flies_does_not_touch_and_after_three_samples_its_contact_is_lost() -> None:
    watch = ContactWatch()
    assert flown(watch, FLYING + 0.1, 1) == [False, True, True, True], "at once, before it ends the swing in the air"
    assert watch.trusted[0]
    flown(watch, FLYING + 0.1, 2)
    assert watch.trusted == [False, True, True, True]
    swung(watch, contact=False, leg=0)
    assert watch.trusted[0]


def test_a_foot_that_is_slow_or_has_only_just_lifted_is_believed_to_touch() -> None:
    slow, lifting = ContactWatch(), ContactWatch()
    assert flown(slow, FLYING - 0.1, 10) is None
    assert flown(lifting, FLYING + 0.1, 10, progress=IN_THE_AIR[0] - 0.01) is None
    assert slow.trusted == lifting.trusted == [True] * 4


def test_contacts_that_come_late_for_two_samples_are_still_trusted() -> None:
    watch = ContactWatch()
    flown(watch, FLYING + 0.1, 2)
    flown(watch, 0.0, 1)
    flown(watch, FLYING + 0.1, 2)
    assert watch.trusted == [True] * 4


@pytest.mark.parametrize(("force", "believed"), [(PRESSING - 1.0, True), (PRESSING + 1.0, False)])
def test_an_open_contact_of_a_leg_that_bears_weight_is_not_believed(force: float, believed: bool) -> None:
    watch, forces = ContactWatch(), np.zeros((4, 3))
    forces[3] = (12.0, -7.0, force)
    sample = pressed(forces, (True, True, True, False))
    overdue = Schedule(overdue=[0.0, 0.0, 0.0, OVERDUE + 0.01])
    watched(watch, overdue, sample, samples=5)
    assert watch.trusted[3] == believed
    assert watched(watch, overdue, sample) == (None if believed else [True] * 4)


def test_a_foot_that_is_not_overdue_or_bears_for_a_moment_only_is_believed() -> None:
    forces = np.zeros((4, 3))
    forces[0, 2] = 100.0
    sample, early = pressed(forces, (False, True, True, True)), ContactWatch()
    watched(early, Schedule(overdue=[OVERDUE - 0.01, 0.0, 0.0, 0.0]), sample, samples=20)
    assert early.trusted[0]
    brief, late = ContactWatch(), Schedule(overdue=[OVERDUE + 0.01, 0.0, 0.0, 0.0])
    for _ in range(3):
        watched(brief, late, sample, samples=4)
        watched(brief, late, pressed(forces, (True,) * 4))
    assert brief.trusted[0], "each time it closes the count starts over"


def test_a_foot_that_bore_weight_unfelt_needs_a_swing_after_it_has_been_felt() -> None:
    watch, forces = ContactWatch(), np.zeros((4, 3))
    forces[2, 2] = 100.0
    late = Schedule(overdue=[0.0, 0.0, OVERDUE + 0.01, 0.0])
    watched(watch, late, pressed(forces, (True, True, False, True)), samples=6)
    swung(watch, contact=False)
    assert not watch.trusted[2], "open in the air as it was open on the ground: that proves nothing"
    watched(watch, Schedule(), standing())
    swung(watch, contact=False)
    assert watch.trusted[2]


def test_without_a_walk_contacts_are_believed_and_silent_ones_stand() -> None:
    watch, sample = ContactWatch(), standing(contact=(True, False, False, True))
    legs = leg_state(sample.position.tolist(), LEVEL)
    assert watch.check(DT, sample, legs, None, silent=False) is None
    assert watch.check(DT, sample, legs, None, silent=True) == [True] * 4
    swinging = Schedule(progress=[-0.1, 0.3, 0.3, -0.1])
    assert watch.check(DT, standing(), legs, swinging, silent=True) == [True, False, False, True]


def test_a_body_that_steps_by_itself_is_not_judged() -> None:
    watch = ContactWatch(judging=False)
    swung(watch, contact=True)
    assert watch.trusted == [True] * 4


@given(joint=st.integers(0, 11), samples=st.integers(0, 6))
def test_an_encoder_is_lost_after_20_ms_of_nonsense_and_back_after_half_a_second(joint: int, samples: int) -> None:
    watch, good, bad = JointWatch(), standing(), standing()
    bad.position[joint] = np.nan
    for _ in range(samples):
        shown = watch.check(DT, bad, lambda: good.position)
        assert shown.position == pytest.approx(good.position)
    assert watch.lost == (samples >= 4)
    for sample in range(round(BACK / DT)):
        assert watch.lost == (samples >= 4), sample
        assert watch.check(DT, good, lambda: None) is good
    assert not watch.lost


@pytest.mark.parametrize(("gyro", "accel", "believed"), [(49.9, 0.0, True), (50.1, 0.0, False), (0.0, 399.0, True), (0.0, 401.0, False)])  # fmt: skip
def test_an_imu_beyond_its_range_is_not_believed(gyro: float, accel: float, believed: bool) -> None:
    for sign in (-1.0, 1.0):
        sample = ImuSample(np.array((0.0, sign * gyro, 0.1)), np.array((sign * accel, 0.0, GRAVITY)))
        assert (ImuWatch().check(DT, sample) is sample) == believed
