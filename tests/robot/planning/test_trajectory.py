"""Joint motions against the polynomial of their boundary conditions, against integrated jerk, and against what no braking can beat."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from robot.planning.trajectory import ARM_LIMITS, MotionLimits, Point, Quintic, Stop

ONE = MotionLimits(np.array([2.0]), np.array([8.0]), np.array([80.0]))


def moving(speed: float, acceleration: float) -> Point:
    return Point(np.array([0.3]), np.array([speed]), np.array([acceleration]))


@given(a=st.floats(-2.0, 2.0), b=st.floats(-2.0, 2.0), share=st.floats(0.0, 1.0))
def test_a_quintic_is_the_polynomial_with_rest_at_both_ends(a: float, b: float, share: float) -> None:
    """Six conditions, solved as linear equations: place, speed and acceleration at the beginning and at the end."""
    motion = Quintic(np.array([a]), np.array([b]), 1.7)
    powers = np.arange(6)

    def row(time: float, order: int) -> np.ndarray:
        factors = np.prod([powers - k for k in range(order)], axis=0) if order else np.ones(6)
        return np.where(powers >= order, factors * time ** np.maximum(powers - order, 0), 0.0)

    conditions = np.array([row(time, order) for time in (0.0, 1.7) for order in range(3)])
    coefficients = np.linalg.solve(conditions, (a, 0.0, 0.0, b, 0.0, 0.0))
    time = 1.7 * share
    point = motion.at(time)
    for order, part in enumerate(point):
        assert part[0] == pytest.approx(float(row(time, order) @ coefficients), abs=1e-8)
    if a != b:
        assert motion.progress(time) == pytest.approx((point.position[0] - a) / (b - a), abs=1e-6)


@pytest.mark.parametrize(("travel", "which"), [(1e-3, 2), (0.5, 2), (3.0, 0)])
def test_the_duration_is_that_at_which_the_tightest_limit_is_just_kept(travel: float, which: int) -> None:
    limits = MotionLimits(np.array([2.0, 9.0]), np.array([8.0, 99.0]), np.array([80.0, 999.0]))
    motion = Quintic.between(np.zeros(2), np.array([travel, 0.1 * travel]), limits)
    times = np.linspace(0.0, motion.duration, 20_001)
    share = times / motion.duration
    jerk = travel * np.abs(60.0 - 360.0 * share + 360.0 * share**2) / motion.duration**3
    speeds, accelerations = (np.array([abs(motion.at(t)[k][0]) for t in times[::20]]) for k in (1, 2))
    used = speeds.max() / 2.0, accelerations.max() / 8.0, jerk.max() / 80.0
    assert max(used) == pytest.approx(1.0, abs=1e-4)
    assert int(np.argmax(used)) == which


def test_with_nowhere_to_go_it_is_there_at_once_and_before_the_beginning_it_waits() -> None:
    still = Quintic.between(np.ones(4), np.ones(4))
    assert still.duration == 0.0
    assert still.progress(0.0) == 1.0
    assert still.at(0.0).position.tolist() == [1.0] * 4
    motion = Quintic.between(np.zeros(4), np.ones(4))
    assert motion.at(-1.0).position.tolist() == [0.0] * 4
    assert motion.progress(-1.0) == 0.0
    assert motion.at(motion.duration + 1.0).velocity.tolist() == [0.0] * 4


@settings(deadline=None, max_examples=30)
@given(speed=st.floats(-2.0, 2.0), acceleration=st.floats(-8.0, 8.0))
def test_braking_is_its_own_integral_and_ends_at_rest(speed: float, acceleration: float) -> None:
    """Place is the integral of the speed, and the speed that of the acceleration: trapezoids of about a millisecond."""
    stop = Stop(moving(speed, acceleration), ONE)
    times = np.linspace(0.0, stop.duration, 401)
    points = [stop.at(float(time)) for time in times]
    q, v, a = (np.array([getattr(p, name)[0] for p in points]) for name in ("position", "velocity", "acceleration"))
    assert (q[0], v[0], a[0]) == pytest.approx((0.3, speed, acceleration), abs=1e-9)
    assert np.abs(a).max() <= 8.0 + 1e-6
    step = stop.duration / 400
    if stop.duration > 1e-3:
        assert np.abs(np.diff(a)).max() / step <= 80.0 + 1e-3
    assert v[-1] == pytest.approx(speed + np.trapezoid(a, dx=step), abs=1e-3)
    assert q[-1] == pytest.approx(0.3 + np.trapezoid(v, dx=step), abs=1e-4)
    assert stop.at(stop.duration + 1e-9).velocity[0] == 0.0
    assert stop.at(stop.duration - 1e-4).velocity[0] == pytest.approx(0.0, abs=1e-3)


def can_stop(speed: float, acceleration: float, seconds: float, steps: int = 150) -> bool:
    """Whether any jerk within the limits brings speed and acceleration to zero in this time: a linear programme of constant pieces."""
    dt = seconds / steps
    ahead = seconds - dt * (np.arange(steps) + 0.5)
    equal = np.vstack((np.full(steps, dt), dt * ahead))
    right = (-acceleration, -speed - acceleration * seconds)
    below = np.tril(np.full((steps, steps), dt))
    bounds = np.concatenate((np.full(steps, 8.0 - acceleration), np.full(steps, 8.0 + acceleration)))
    found = linprog(np.zeros(steps), np.vstack((below, -below)), bounds, equal, right, (-80.0, 80.0))
    return bool(found.status == 0)


@pytest.mark.parametrize(("speed", "acceleration"), [(2.0, 0.0), (2.0, 6.0), (1.0, -7.0), (-0.3, 4.0), (0.05, 0.0)])
def test_no_braking_within_the_limits_is_shorter(speed: float, acceleration: float) -> None:
    duration = Stop(moving(speed, acceleration), ONE).duration
    assert can_stop(speed, acceleration, 1.02 * duration)
    assert not can_stop(speed, acceleration, 0.98 * duration)


def test_from_full_speed_it_takes_speed_over_acceleration_and_acceleration_over_jerk() -> None:
    assert Stop(moving(2.0, 0.0), ONE).duration == pytest.approx(2.0 / 8.0 + 8.0 / 80.0)
    assert Stop(moving(0.1, 0.0), ONE).duration == pytest.approx(2.0 * math.sqrt(0.1 / 80.0)), (
        "too slow to reach the limit"
    )
    assert Stop(moving(0.0, 0.0), ONE).duration == 0.0


@given(st.floats(-2.0, 2.0), st.floats(-8.0, 8.0), st.floats(0.0, 1.0))
def test_the_mirrored_motion_brakes_mirrored(speed: float, acceleration: float, time: float) -> None:
    here, there = Stop(moving(speed, acceleration), ONE).at(time), Stop(moving(-speed, -acceleration), ONE).at(time)
    assert there.velocity == pytest.approx(-here.velocity)
    assert there.acceleration == pytest.approx(-here.acceleration)
    assert there.position - 0.3 == pytest.approx(-(here.position - 0.3))


def test_every_joint_brakes_by_itself_and_the_slowest_says_when_all_rest() -> None:
    start = Point(np.zeros(4), np.array([2.0, 0.0, -1.0, 0.5]), np.zeros(4))
    together = Stop(start)
    alone = []
    for joint in range(4):
        limits = MotionLimits(*(part[joint : joint + 1] for part in ARM_LIMITS))
        alone.append(Stop(Point(*(part[joint : joint + 1] for part in start)), limits))
    assert together.duration == pytest.approx(max(stop.duration for stop in alone))
    for time in (0.05, 0.2, 0.5):
        assert together.at(time).position == pytest.approx([stop.at(time).position[0] for stop in alone])
