"""Arm motions: never beyond a limit at 1 kHz, at the target in the end, smooth when cancelled, progress that never falls."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robot.geometry.vectors import Vector
from robot.model.arm import LIMITS, Angles
from robot.planning.trajectory import ARM_LIMITS, Motion, Quintic, Stop

angles_within = st.tuples(*(st.floats(low, high) for low, high in LIMITS))
READY: Angles = (0.0, -1.5, 1.8, 0.2)


def check_limits(motion: Motion, seconds: float) -> None:
    """Speed, acceleration and jerk at 1 kHz; and that speed and acceleration are the derivatives they claim to be."""
    points = [motion.at(i / 1000) for i in range(int(seconds * 1000) + 3)]
    position, velocity, acceleration = (np.array(part) for part in zip(*points, strict=True))
    assert (np.abs(velocity) <= ARM_LIMITS.speed + 1e-6).all()
    assert (np.abs(acceleration) <= ARM_LIMITS.acceleration + 1e-6).all()
    assert (np.abs(np.diff(acceleration, axis=0)) * 1000 <= ARM_LIMITS.jerk + 1e-3).all()
    # the mean of an interval's ends is the mean over it to within jerk dt^2 / 12
    means = (velocity[1:] + velocity[:-1]) / 2
    assert np.abs(np.diff(position, axis=0) * 1000 - means).max() < 120 * 1e-6


def column(points: Iterable[Vector], joint: int) -> Vector:
    return np.array([point[joint] for point in points])


@settings(deadline=None, max_examples=20)
@given(angles_within, angles_within)
def test_rest_to_rest_keeps_every_limit_and_ends_at_the_target(start: Angles, target: Angles) -> None:
    motion = Quintic.between(np.array(start), np.array(target))
    check_limits(motion, motion.duration)
    assert motion.at(0.0).position == pytest.approx(start, abs=1e-12)
    assert np.array_equal(motion.at(motion.duration).position, np.array(target))
    assert motion.at(motion.duration - 1e-9).position == pytest.approx(target, abs=1e-3)


@pytest.mark.parametrize("travel", [0.01, 0.1, 0.5, 1.0, 3.0])
def test_some_limit_is_used_in_full(travel: float) -> None:
    motion = Quintic.between(np.zeros(4), np.array([travel, 0.0, 0.0, 0.0]))
    points = [motion.at(t) for t in np.linspace(0, motion.duration, 4001)]
    speed = np.abs(column((p.velocity for p in points), 0)).max() / 2.0
    acceleration = np.abs(column((p.acceleration for p in points), 0)).max() / 8.0
    jerk = np.abs(np.diff(column((p.acceleration for p in points), 0))).max() / (motion.duration / 4000) / 80.0
    assert max(speed, acceleration, jerk) == pytest.approx(1.0, abs=2e-3)


@settings(deadline=None, max_examples=30)
@given(angles_within, angles_within, st.floats(0.0, 1.0))
def test_braking_keeps_every_limit_and_stops_before_the_target(start: Angles, target: Angles, when: float) -> None:
    motion = Quintic.between(np.array(start), np.array(target))
    at = when * motion.duration
    stop = Stop(motion.at(at))
    check_limits(stop, stop.duration)
    end = stop.at(stop.duration)
    assert not end.velocity.any()
    assert not end.acceleration.any()
    assert stop.at(stop.duration + 1.0).position == pytest.approx(end.position, abs=1e-12)
    # the motion itself keeps the same limits and stops at the target, so the quickest stop is no later and no further
    assert stop.duration <= motion.duration - at + 1e-6
    covered = (end.position - np.array(start)) * np.sign(np.array(target) - np.array(start))
    assert (covered <= np.abs(np.array(target) - np.array(start)) + 1e-6).all()
    assert (covered >= -1e-6).all()


def test_braking_from_full_speed_takes_the_textbook_time() -> None:
    motion = Quintic.between(np.zeros(4), np.array([3.0, 0.0, 0.0, 0.0]))
    middle = motion.at(motion.duration / 2)
    assert middle.velocity[0] == pytest.approx(2.0)
    # v / a + a / j for a trapezoid of acceleration
    assert Stop(middle).duration == pytest.approx(2.0 / 8.0 + 8.0 / 80.0)


def test_nowhere_to_go_takes_no_time() -> None:
    motion = Quintic.between(np.ones(4), np.ones(4))
    assert motion.duration == 0.0
    assert motion.progress(0.0) == 1.0
    assert motion.at(0.0).position == pytest.approx(np.ones(4))
