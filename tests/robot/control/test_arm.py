"""The arm: one motion at a time, progress that never falls, braking when cancelled."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robot.control.arm import Arm
from robot.hardware.arm import ArmBusy
from robot.model.arm import LIMITS, STOWED, Angles

angles_within = st.tuples(*(st.floats(low, high) for low, high in LIMITS))
READY: Angles = (0.0, -1.5, 1.8, 0.2)


def test_the_arm_moves_to_its_target_and_progress_never_falls() -> None:
    arm = Arm()
    assert not arm.at(0.0).moving
    duration = arm.move(READY, now=10.0)
    progress = [arm.at(10.0 + t).progress for t in np.linspace(0, duration, 300)]
    assert progress[0] == 0.0
    assert progress[-1] == 1.0
    assert all(a <= b for a, b in pairwise(progress))
    assert arm.at(10.0 + duration / 2).moving
    after = arm.at(10.0 + duration)
    assert not after.moving
    assert after.position == pytest.approx(READY, abs=1e-3)
    assert not after.velocity.any()


def test_a_cancelled_arm_stops_on_the_way_keeps_its_progress_and_takes_the_next_target() -> None:
    arm = Arm()
    duration = arm.move(READY, now=0.0)
    half = arm.at(duration / 2)
    brakes = arm.cancel(now=duration / 2)
    assert 0.0 < brakes < 0.6
    assert arm.cancel(now=duration / 2 + 0.01) == pytest.approx(brakes - 0.01)  # a second cancel changes nothing
    rest = arm.at(duration / 2 + brakes)
    assert not rest.moving
    assert not rest.velocity.any()
    assert rest.progress == pytest.approx(half.progress)
    assert not np.allclose(rest.position, READY, atol=0.1)
    again = arm.move(STOWED, now=100.0)
    assert arm.at(100.0).position == pytest.approx(rest.position)
    assert arm.at(100.0 + again).position == pytest.approx(STOWED)


def test_a_busy_arm_refuses_a_second_target_also_while_braking() -> None:
    arm = Arm()
    duration = arm.move(READY, now=0.0)
    with pytest.raises(ArmBusy, match=r"still moving, for \d\.\d\d s"):
        arm.move(STOWED, now=duration / 2)
    arm.cancel(now=duration / 2)
    with pytest.raises(ArmBusy):
        arm.move(STOWED, now=duration / 2 + 0.001)


def test_cancelling_at_rest_changes_nothing() -> None:
    arm = Arm(READY)
    assert arm.cancel(now=1.0) == 0.0
    assert arm.at(1.0).position == pytest.approx(READY)
    assert arm.at(1.0).progress == 1.0


def test_a_54_targets_are_checked_before_anything_moves() -> None:
    arm = Arm()
    for bad in ((0.0,) * 3, (0.0,) * 5, (float("nan"),) * 4, (0.0, 1.0, 0.0, 0.0)):
        with pytest.raises(ValueError):
            arm.move(bad, now=0.0)
    assert not arm.at(0.0).moving


@settings(max_examples=15)
@given(angles_within, angles_within, st.floats(0.05, 0.95))
def test_cancelled_anywhere_it_brakes_on_the_way_without_a_jump(start: Angles, target: Angles, share: float) -> None:
    arm = Arm(start)
    when = share * arm.move(target, now=0.0)
    before = arm.at(when)
    arm.cancel(when)
    after = arm.at(when)
    assert after.position == pytest.approx(before.position, abs=1e-9)
    assert after.velocity == pytest.approx(before.velocity, abs=1e-9)
    rest = arm.at(when + 10.0).position
    low, high = np.minimum(start, target) - 1e-6, np.maximum(start, target) + 1e-6
    assert ((low <= rest) & (rest <= high)).all()


def test_times_are_those_of_any_clock_and_the_answer_is_what_is_left() -> None:
    here, there = Arm(), Arm()
    first, second = here.move(READY, now=0.0), there.move(READY, now=1e6)
    assert first == second
    for share in (0.25, 0.5, 1.0):
        a, b = here.at(share * first), there.at(1e6 + share * first)
        assert a.position == pytest.approx(b.position, abs=1e-6)
        assert a.moving is b.moving is (share < 1.0)
