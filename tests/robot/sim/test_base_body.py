"""What both simulated bodies share: exact ticks, one sample for all readers, noise that can be switched off, and where things are."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robot.geometry.planar import Pose2
from robot.scenes.kitchen import kitchen
from robot.scenes.scene import Box, Scene
from robot.sim.base_body import TICK, BaseBody
from robot.sim.kinematic import KinematicBody
from robot.sim.physics import PhysicsBody

SCENE = Scene("one", (-5.0, -5.0, 5.0, 5.0), (Box(2.0, 0.0, 0.5, 4.0),), Pose2(0.0, 0.0), Pose2(-2.0, 1.0, 0.5))
KINDS = [KinematicBody, PhysicsBody]


@pytest.mark.parametrize("kind", KINDS)
@settings(deadline=None, max_examples=10)
@given(ends=st.lists(st.floats(0.0, 0.05), min_size=1, max_size=5))
def test_time_is_the_last_whole_tick_that_is_not_later(kind: type[BaseBody], ends: list[float]) -> None:
    body, latest = kind(SCENE, seed=1, noise=False), 0.0
    for end in ends:
        body.advance(end)
        latest = max(latest, end)
        assert body.time <= latest + 1e-9
        assert body.time > latest - TICK - 1e-9
        assert round(body.time / TICK) * TICK == body.time


@pytest.mark.parametrize("kind", KINDS)
def test_at_one_instant_every_reader_gets_the_same_sample_and_later_another(kind: type[BaseBody]) -> None:
    body = kind(SCENE, seed=1, noise=True)
    body.advance(0.01)
    first, again = (body.imu(), body.joints()), (body.imu(), body.joints())
    assert first[0] is again[0]
    assert first[1] is again[1]
    body.advance(0.02)
    assert (body.imu().gyro != first[0].gyro).all()
    assert (body.joints().position != first[1].position).all()


@pytest.mark.parametrize("kind", KINDS)
def test_noise_comes_by_the_densities_of_the_sensors_and_can_be_left_out(kind: type[BaseBody]) -> None:
    exact, noisy = kind(SCENE, seed=4, noise=False), kind(SCENE, seed=4, noise=True)
    assert exact.lidar()[180] == pytest.approx(1.75)
    off = noisy.lidar() - exact.lidar()
    hit = exact.lidar() < 10.0
    assert off[hit].std() == pytest.approx(0.015, rel=0.3)
    assert (off[~hit] == 0.0).all(), "what meets nothing goes on meeting nothing"
    encoders = noisy.joints().position - exact.joints().position
    assert 0.0 < np.abs(encoders).max() < 5 * 5e-4
    assert exact.joints().velocity.tolist() == [0.0] * 12


@pytest.mark.parametrize("kind", KINDS)
def test_how_often_the_lidar_is_read_does_not_change_what_the_imu_shows(kind: type[BaseBody]) -> None:
    """Each sensor has a stream of its own."""
    one, other = kind(SCENE, seed=2), kind(SCENE, seed=2)
    for _ in range(3):
        other.lidar()
    np.testing.assert_array_equal(one.imu().gyro, other.imu().gyro)
    np.testing.assert_array_equal(one.joints().velocity, other.joints().velocity)


@pytest.mark.parametrize("kind", KINDS)
def test_put_elsewhere_it_is_measured_anew_at_the_same_instant(kind: type[BaseBody]) -> None:
    body = kind(SCENE, seed=3, noise=True)
    before = body.imu()
    body.place(Pose2(1.0, 1.0, 0.3))
    assert body.imu() is not before
    assert body.time == 0.0


@pytest.mark.parametrize("kind", KINDS)
def test_the_charger_is_connected_where_it_sits_on_its_dock(kind: type[BaseBody]) -> None:
    body = kind(SCENE, seed=1, noise=False)
    assert not body.charger
    body.place(SCENE.dock)
    assert body.charger
    body.place(Pose2(SCENE.dock.x, SCENE.dock.y, SCENE.dock.yaw + 1.0))
    assert not body.charger


@pytest.mark.parametrize("kind", KINDS)
def test_samples_of_a_rate_are_taken_at_its_instants_and_hold_what_was_read_then(kind: type[BaseBody]) -> None:
    body = kind(SCENE, seed=1)
    body.advance(0.003)
    body.sample(250.0)
    body.advance(0.0231)
    taken = []
    while (sample := body.next_sample()) is not None:
        taken.append(sample)
    assert [sample.time for sample in taken] == pytest.approx([0.003 + 0.004 * k for k in range(1, 6)])
    assert len({float(sample.imu.gyro[0]) for sample in taken}) == 5


@pytest.mark.parametrize("kind", KINDS)
def test_things_are_where_the_scene_has_them_with_and_without_an_arm(kind: type[BaseBody]) -> None:
    scene = dataclasses.replace(kitchen(), start=Pose2(4.0, 0.0))
    for arm in (False, True):
        body = kind(scene, seed=1, noise=False, arm=arm)
        for shown, meant in zip(body.things(), scene.things, strict=True):
            assert (shown.name, shown.shape.x, shown.shape.y) == (
                meant.name,
                pytest.approx(meant.shape.x),
                pytest.approx(meant.shape.y),
            )
            assert shown.z == pytest.approx(meant.z, abs=1e-6)
        assert body.scene is scene
