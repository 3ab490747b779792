"""The sensors' noise: seeded, of the size that its densities say, and honest at the edges."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robot.hardware.body import JointSample
from robot.hardware.sensors import ContactErrors, EncoderErrors, ImuErrors, LidarErrors, Sensors
from robot.sim.noise import BiasedNoise, BiasSteps, ContactNoise, EncoderNoise, ImuNoise, LidarNoise, sensor_generator

ZERO = np.zeros(3)


def test_the_same_seed_gives_the_same_imu_stream_and_another_seed_another() -> None:
    first, again, other = ImuNoise(7, 200.0), ImuNoise(7, 200.0), ImuNoise(8, 200.0)
    for _ in range(50):
        a, b, c = (noise.apply(ZERO, ZERO) for noise in (first, again, other))
        assert np.array_equal(a.gyro, b.gyro)
        assert np.array_equal(a.accel, b.accel)
        assert not np.array_equal(a.gyro, c.gyro)


def test_sensors_of_one_robot_have_independent_streams() -> None:
    draws = [sensor_generator(3, name).standard_normal(4) for name in ("gyro", "accelerometer", "encoders", "lidar")]
    assert len({tuple(draw) for draw in draws}) == 4


@pytest.mark.parametrize("rate", [100.0, 200.0, 500.0])
def test_white_noise_and_bias_walk_have_the_densities_of_section_6(rate: float) -> None:
    noise = ImuNoise(1, rate)
    count = 4_000
    gyro, accel, gyro_bias, accel_bias = (np.empty((count, 3)) for _ in range(4))
    for i in range(count):
        sample = noise.apply(ZERO, ZERO)
        gyro[i], accel[i] = sample.gyro, sample.accel
        gyro_bias[i], accel_bias[i] = noise.gyro.bias, noise.accel.bias
    # the relative standard error of a standard deviation from 12 000 draws is 0.65 %
    assert (gyro - gyro_bias).std() == pytest.approx(1.7e-4 * rate**0.5, rel=0.03)
    assert (accel - accel_bias).std() == pytest.approx(2.0e-3 * rate**0.5, rel=0.03)
    assert np.diff(gyro_bias, axis=0).std() == pytest.approx(1.9e-5 / rate**0.5, rel=0.03)
    assert np.diff(accel_bias, axis=0).std() == pytest.approx(3.0e-3 / rate**0.5, rel=0.03)


def test_initial_biases_are_spread_as_section_6_says() -> None:
    robots = [ImuNoise(seed) for seed in range(1000)]
    assert np.std([robot.gyro.bias for robot in robots]) == pytest.approx(1e-3, rel=0.06)
    assert np.std([robot.accel.bias for robot in robots]) == pytest.approx(0.02, rel=0.06)


def test_biases_stay_about_where_they_started_however_long_the_robot_runs() -> None:
    """A Gauss-Markov process of 1000 s: its spread grows like that of a walk at first, and ends at w sqrt(500 s)."""
    walks = [BiasedNoise(sensor_generator(seed, "walk"), 1.0, white=0.0, walk=3e-3, bias=5.0) for seed in range(40)]
    steps = [BiasSteps(sensor_generator(seed, "steps"), 1.0, sd=0.05, every=60.0) for seed in range(40)]
    starts = np.array([walk.bias for walk in walks])
    walked, stepped = np.empty((2, 8000, 40, 3))
    for second in range(8000):
        walked[second] = [walk.apply(ZERO) for walk in walks] - starts
        stepped[second] = [step.advance() for step in steps]
    assert walked[49].std() == pytest.approx(3e-3 * 50**0.5, rel=0.25)
    assert walked[4000:].std() == pytest.approx(3e-3 * 500**0.5, rel=0.1)
    assert stepped[4000:].std() == pytest.approx(0.05 * (500 / 60) ** 0.5, rel=0.1)
    assert starts.std() == pytest.approx(5.0, rel=0.2)


def test_noise_is_added_to_the_truth() -> None:
    still, turning = ImuNoise(5), ImuNoise(5)
    rates, force = np.array([0.1, -0.2, 0.3]), np.array([0.0, 0.0, 9.81])
    quiet, loud = still.apply(ZERO, ZERO), turning.apply(rates, force)
    assert loud.gyro - quiet.gyro == pytest.approx(rates, abs=1e-12)
    assert loud.accel - quiet.accel == pytest.approx(force, abs=1e-12)


def test_a_two_second_stand_averages_the_gyro_bias_to_3e_4_in_98_of_100_runs() -> None:
    errors: list[float] = []
    for seed in range(100):
        noise = ImuNoise(seed)
        samples = np.array([noise.apply(ZERO, ZERO).gyro for _ in range(400)])
        errors.extend(np.abs(samples.mean(axis=0) - noise.gyro.bias))
    # white noise alone leaves 1.2e-4 (one sigma) after 2 s, so 3e-4 is 2.5 sigma: 98.8 of 100
    assert np.quantile(errors, 0.98) <= 3e-4


def test_encoders_scatter_by_their_two_standard_deviations() -> None:
    noise, position, velocity = EncoderNoise(2), np.linspace(-1, 1, 12), np.linspace(2, -2, 12)
    true = JointSample(position, velocity, np.zeros(12), np.ones(4, dtype=np.bool_))
    samples = [noise.apply(true) for _ in range(5000)]
    assert np.std([sample.position - position for sample in samples]) == pytest.approx(5e-4, rel=0.02)
    assert np.std([sample.velocity - velocity for sample in samples]) == pytest.approx(0.05, rel=0.02)


@settings(deadline=None)
@given(st.lists(st.floats(0.0, 12.0), min_size=1, max_size=40), st.integers(0, 10))
def test_lidar_keeps_missing_returns_and_stays_in_range(ranges: list[float], seed: int) -> None:
    true = np.array(ranges)
    seen = LidarNoise(seed).apply(true, 10.0)
    assert np.all(seen[true >= 10.0] == 10.0)
    assert np.all((seen >= 0.0) & (seen <= 10.0))


def test_lidar_noise_lies_between_one_and_two_centimetres() -> None:
    seen = LidarNoise(4).apply(np.full(20_000, 3.0), 10.0)
    assert 0.01 <= seen.std() <= 0.02
    assert seen.mean() == pytest.approx(3.0, abs=1e-3)


def test_lidar_noise_of_a_beam_does_not_depend_on_what_other_beams_hit() -> None:
    open_world, with_box = np.array([2.0, 10.0, 4.0]), np.array([2.0, 1.0, 4.0])
    first, second = LidarNoise(1).apply(open_world, 10.0), LidarNoise(1).apply(with_box, 10.0)
    assert first[[0, 2]] == pytest.approx(second[[0, 2]], abs=0.0)


def test_contacts_arrive_late_by_the_delay() -> None:
    noise = ContactNoise(0, 200.0, ContactErrors(delay=0.010))
    down, up = np.ones(4, dtype=np.bool_), np.zeros(4, dtype=np.bool_)
    assert [bool(noise.apply(c)[0]) for c in (down, up, up, up)] == [True, True, True, False]


def test_contacts_drop_out_as_often_as_asked_and_are_never_invented() -> None:
    noise = ContactNoise(0, errors=ContactErrors(dropout=0.01))
    seen = np.array([noise.apply(np.ones(4, dtype=np.bool_)) for _ in range(10_000)])
    assert 1.0 - seen.mean() == pytest.approx(0.01, rel=0.2)
    assert not ContactNoise(0, errors=ContactErrors(dropout=0.5)).apply(np.zeros(4, dtype=np.bool_)).any()


def test_refusals_say_what_to_give() -> None:
    with pytest.raises(ValueError, match="positive number of hertz"):
        ImuNoise(0, 0.0)
    with pytest.raises(ValueError, match="dropout from 0 to 1"):
        ContactErrors(dropout=1.5)
    with pytest.raises(ValueError, match="mean time above 0"):
        ImuErrors(step_every=0.0)
    with pytest.raises(ValueError, match="dropout from 0 to below 1"):
        LidarErrors(dropout=1.0)


def test_an_ideal_robot_has_nothing_but_white_noise_and_walking_biases() -> None:
    assert Sensors.ideal() == Sensors() == Sensors.of("ideal")
    assert Sensors.of("real") == Sensors.real() != Sensors.ideal()
    real = Sensors.real()
    assert (real.lidar.sweep, real.lidar.bias, real.lidar.dropout) == (0.1, 0.03, 0.15)
    assert (real.contacts.delay, real.contacts.dropout) == (0.01, 0.01)


def test_axes_of_an_imu_have_scales_of_their_own_and_lean_towards_each_other() -> None:
    errors = ImuErrors(scale_sd=0.01, misalignment_sd=0.02)
    columns = []
    for seed in range(300):
        exact, wrong = ImuNoise(seed), ImuNoise(seed, errors=errors)
        axis = np.array([0.0, 0.0, 1.0])
        columns.append(wrong.apply(axis, ZERO).gyro - exact.apply(axis, ZERO).gyro)
    leans, scales = np.array(columns)[:, :2], np.array(columns)[:, 2]
    assert leans.std() == pytest.approx(0.02, rel=0.1)
    assert scales.std() == pytest.approx(0.01, rel=0.1)
    again = ImuNoise(7, errors=errors).apply(ZERO, np.ones(3)).accel - ImuNoise(7).apply(ZERO, np.ones(3)).accel
    later = ImuNoise(7, errors=errors)
    later.apply(ZERO, ZERO)
    plain = ImuNoise(7)
    plain.apply(ZERO, ZERO)
    assert later.apply(ZERO, np.ones(3)).accel - plain.apply(ZERO, np.ones(3)).accel == pytest.approx(again, abs=1e-12)


def test_biases_of_an_imu_jump_now_and_then_by_as_much_as_they_should() -> None:
    errors = ImuErrors(gyro_step=0.01, step_every=0.5)
    wrong, exact = ImuNoise(3, 200.0, errors), ImuNoise(3, 200.0)
    offsets = np.array([wrong.apply(ZERO, ZERO).gyro - exact.apply(ZERO, ZERO).gyro for _ in range(40_000)])
    jumps = np.abs(np.diff(offsets, axis=0)).max(axis=1) > 1e-4  # what goes back is less
    assert jumps.sum() == pytest.approx(400, rel=0.2)  # 200 s, one in half a second
    assert np.diff(offsets, axis=0)[jumps].std() == pytest.approx(0.01, rel=0.1)


def test_the_zeros_of_encoders_stay_as_they_were_and_torques_scatter() -> None:
    errors = EncoderErrors(position=0.0, velocity=0.0, zero_sd=0.01, effort=0.5)
    true = JointSample(np.zeros(12), np.zeros(12), np.zeros(12), np.ones(4, dtype=np.bool_))
    robots = [EncoderNoise(seed, errors) for seed in range(200)]
    zeros = np.array([robot.apply(true).position for robot in robots])
    assert zeros.std() == pytest.approx(0.01, rel=0.06)
    assert np.array_equal(robots[3].apply(true).position, zeros[3])
    assert np.std([robots[0].apply(true).effort for _ in range(500)]) == pytest.approx(0.5, rel=0.05)


def test_a_lidar_measures_too_far_or_too_near_by_one_length_of_its_own() -> None:
    true = np.full(4_000, 3.0)
    means = [LidarNoise(seed, LidarErrors(bias=0.03)).apply(true, 10.0).mean() - 3.0 for seed in range(60)]
    assert max(np.abs(means)) <= 0.031
    assert max(means) > 0.02
    assert min(means) < -0.02


def test_beams_drop_out_without_changing_the_noise_of_the_others() -> None:
    true = np.full(20_000, 3.0)
    whole, holed = LidarNoise(5).apply(true, 10.0), LidarNoise(5, LidarErrors(dropout=0.15)).apply(true, 10.0)
    lost = holed == 10.0
    assert lost.mean() == pytest.approx(0.15, rel=0.05)
    assert np.array_equal(whole[~lost], holed[~lost])


def test_the_mount_of_a_lidar_leans_a_little_and_is_a_rotation() -> None:
    assert np.array_equal(LidarNoise(5).mount, np.eye(3))
    mounts = [LidarNoise(seed, LidarErrors(misalignment_sd=0.01)).mount for seed in range(200)]
    assert mounts[0] @ mounts[0].T == pytest.approx(np.eye(3), abs=1e-12)
    assert np.std([mount[1, 0] for mount in mounts]) == pytest.approx(0.01, rel=0.15)
    assert np.std([mount[0, 2] for mount in mounts]) == pytest.approx(0.01, rel=0.15)
