"""The attitude filter against scipy's rotations, and its answer to an error against the linear system that it is."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from robot.estimation.attitude import BUMP, GRAVITY_GAIN, LEVEL_TIME, AttitudeFilter
from robot.estimation.gyro_bias import GRAVITY_GAIN as BIAS_GAIN
from robot.geometry.vectors import Floats, Triple
from robot.model.parameters import GRAVITY

NO_ACCELERATION = (0.0, 0.0, 0.0)
NO_TURN = (0.0, 0.0, 0.0)
tilt = st.floats(-1.2, 1.2)
rates = st.tuples(*(st.floats(-3.0, 3.0) for _ in range(3)))


def triple(values: Floats) -> Triple:
    x, y, z = values.tolist()
    return (x, y, z)


def force(attitude: Rotation, acceleration: Triple = NO_ACCELERATION) -> Triple:
    """What an accelerometer shows in a body of that attitude."""
    return triple(attitude.inv().apply(np.add(acceleration, (0.0, 0.0, GRAVITY))))


def rotation_of(filtered: AttitudeFilter) -> Rotation:
    return Rotation.from_matrix(np.array(filtered.rotation))


def levelled(attitude: Rotation) -> AttitudeFilter:
    """A filter that has begun at this attitude (without yaw), and is over its first moments."""
    filtered = AttitudeFilter()
    filtered.level(force(attitude))
    return filtered


@given(roll=tilt, pitch=tilt)
def test_one_sample_at_rest_gives_roll_and_pitch_and_a_yaw_of_zero(roll: float, pitch: float) -> None:
    attitude = Rotation.from_euler("ZYX", (0.0, pitch, roll))
    filtered = levelled(attitude)
    assert (filtered.yaw, filtered.pitch, filtered.roll) == pytest.approx((0.0, pitch, roll), abs=1e-9)
    assert np.array(filtered.rotation) == pytest.approx(attitude.as_matrix(), abs=1e-9)
    assert filtered.up == filtered.rotation[2]
    w, x, y, z = filtered.quaternion
    assert Rotation.from_quat((x, y, z, w)).as_matrix() == pytest.approx(np.array(filtered.rotation), abs=1e-12)


@given(steps=st.lists(rates, min_size=1, max_size=20))
def test_turning_is_the_product_of_the_rotations(steps: list[Triple]) -> None:
    """Gravity is shown as it is, so that nothing is corrected but what the integration itself leaves."""
    truth, filtered = Rotation.identity(), AttitudeFilter()
    for turn in steps:
        filtered.update(0.005, turn, force(truth), NO_ACCELERATION, still=False)
        truth = truth * Rotation.from_rotvec(np.array(turn) * 0.005)
        assert filtered.turn == pytest.approx(turn, abs=1e-5)
    assert (rotation_of(filtered).inv() * truth).magnitude() < 1e-5
    yaw, pitch, roll = truth.as_euler("ZYX")
    assert (filtered.yaw, filtered.pitch, filtered.roll) == pytest.approx((yaw, pitch, roll), abs=1e-5)


@pytest.mark.parametrize("hz", [100, 200, 500])
@pytest.mark.parametrize("axis", ["x", "y"])
def test_a_wrong_horizon_is_corrected_as_the_linear_system_of_its_two_gains(axis: str, hz: int) -> None:
    """e' = -k e - b, b' = k_b e for a small error e of the horizon; at every rate the same."""
    filtered = levelled(Rotation.from_euler(axis, 0.02))
    for _ in range(3 * hz):
        filtered.update(1.0 / hz, NO_TURN, force(Rotation.identity()), NO_ACCELERATION, still=False)
    left, bias = expm(3.0 * np.array(((-GRAVITY_GAIN, -1.0), (BIAS_GAIN, 0.0)))) @ (0.02, 0.0)
    shown = filtered.roll if axis == "x" else filtered.pitch
    assert shown == pytest.approx(left, rel=0.01)
    assert filtered.bias.value[0 if axis == "x" else 1] == pytest.approx(bias, rel=0.01)


@given(roll=st.floats(-0.3, 0.3), pitch=st.floats(-0.3, 0.3))
def test_gravity_never_turns_the_heading(roll: float, pitch: float) -> None:
    """What it corrects with is a turn about a level axis."""
    filtered = AttitudeFilter()
    before, shown = rotation_of(filtered), force(Rotation.from_euler("ZYX", (0.0, pitch, roll)))
    filtered.update(0.005, NO_TURN, shown, NO_ACCELERATION, still=False)
    turned = (rotation_of(filtered) * before.inv()).as_rotvec()
    assert turned[2] == pytest.approx(0.0, abs=1e-12)
    assert filtered.bias.value[2] == 0.0


@given(roll=tilt, pitch=tilt, acceleration=st.tuples(st.floats(-4, 4), st.floats(-4, 4), st.floats(-4, 4)))
def test_the_robots_own_acceleration_does_not_tilt_the_horizon(roll: float, pitch: float, acceleration: Triple) -> None:
    attitude = Rotation.from_euler("ZYX", (0.0, pitch, roll))
    filtered = levelled(attitude)
    own = triple(attitude.inv().apply(acceleration))
    for _ in range(20):
        filtered.update(0.005, NO_TURN, force(attitude, acceleration), own, still=False)
    assert (rotation_of(filtered).inv() * attitude).magnitude() < 1e-9
    assert filtered.bias.value == pytest.approx((0.0, 0.0, 0.0), abs=1e-12)


@given(yaw=st.floats(-3.0, 3.0), roll=st.floats(-0.5, 0.5), turn=rates)
def test_the_heading_from_which_it_begins_makes_no_difference(yaw: float, roll: float, turn: Triple) -> None:
    one, other = levelled(Rotation.from_euler("x", roll)), levelled(Rotation.from_euler("x", roll))
    for _ in range(round(abs(yaw) / 0.01)):
        up = np.array(other.up) * np.copysign(0.01, yaw) / 0.005
        other.update(0.005, triple(up), force(rotation_of(other)), NO_ACCELERATION, still=False)
    begun = other.yaw
    for filtered in (one, other):
        filtered.update(0.005, turn, (1.0, -2.0, 9.0), NO_ACCELERATION, still=False)
    about = Rotation.from_euler("z", begun)
    assert (rotation_of(other).inv() * about * rotation_of(one)).magnitude() < 1e-4


def test_in_the_first_moments_of_rest_the_horizon_is_that_of_the_mean_force_and_a_bump_does_not_count() -> None:
    filtered, random = AttitudeFilter(), np.random.default_rng(1)
    attitude = Rotation.from_euler("ZYX", (0.0, -0.05, 0.1))
    shown = [np.array(force(attitude)) + random.normal(0.0, 0.3, 3) for _ in range(40)]
    for step, sample in enumerate(shown):
        filtered.update(0.005, (1e-3, 0.0, 0.0), triple(sample), NO_ACCELERATION, still=True)
        if step % 5 == 0:
            bump = (0.0, GRAVITY * (1.01 + BUMP), 0.0)
            filtered.update(0.005, NO_TURN, bump, NO_ACCELERATION, still=True)
    mean = np.mean(shown, axis=0)
    assert filtered.up == pytest.approx(tuple(mean / np.linalg.norm(mean)), abs=1e-12)
    assert filtered.yaw == pytest.approx(0.0, abs=1e-9)
    assert filtered.bias.value == (0.0, 0.0, 0.0), "the gyro is not judged yet"


def test_after_the_first_moments_rest_shows_the_gyros_bias_and_a_walk_takes_it_off() -> None:
    filtered, shown = AttitudeFilter(), (1e-3, -2e-3, 1.5e-3)
    for _ in range(round((LEVEL_TIME + 3.0) / 0.005)):
        filtered.update(0.005, shown, force(Rotation.identity()), NO_ACCELERATION, still=True)
    assert filtered.bias.value == pytest.approx(shown, rel=0.02)
    filtered.update(0.005, shown, force(Rotation.identity()), NO_ACCELERATION, still=False)
    assert filtered.turn == pytest.approx((0.0, 0.0, 0.0), abs=5e-5)
    assert filtered.age == pytest.approx(LEVEL_TIME + 3.005)


def test_of_a_walk_from_the_start_nothing_is_levelled() -> None:
    filtered = AttitudeFilter()
    filtered.update(0.005, NO_TURN, force(Rotation.from_euler("x", 0.5)), NO_ACCELERATION, still=False)
    assert abs(filtered.roll) < 0.005
