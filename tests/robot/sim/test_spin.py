"""A LiDAR that turns: when its beams look, and what bodies see with it."""

from __future__ import annotations

import numpy as np
import pytest

from robot.geometry.planar import Pose2
from robot.geometry.vectors import Floats
from robot.hardware.beams import MAX_RANGE, beam_angles
from robot.hardware.body import Sweep
from robot.hardware.sensors import LidarErrors, Sensors
from robot.scenes.scene import Scene
from robot.scenes.worlds import get_world
from robot.sim.kinematic import KinematicBody
from robot.sim.noise import LidarNoise
from robot.sim.physics import PhysicsBody
from robot.sim.spin import Spin

TURNING = Sensors(lidar=LidarErrors(sweep=0.1))


def _ahead(scene: Scene, kind: type[PhysicsBody] | type[KinematicBody]) -> Sweep:
    """The first revolution of an exact LiDAR on a robot that lies."""
    body = kind(scene, seed=1, noise=False, sensors=TURNING)
    assert body.sweep() is None
    body.advance(0.0995)
    assert body.sweep() is None
    body.advance(0.1)
    seen = body.sweep()
    assert seen is not None
    return seen


def test_groups_of_beams_look_every_five_milliseconds_and_make_whole_revolutions() -> None:
    now, looked = 0.0, list[tuple[float, int]]()

    def look(rays: Floats) -> Floats:
        looked.append((now, len(rays)))
        return np.full(len(rays), now)

    spin = Spin(0.1, look)
    assert spin.due == float("inf")
    spin.begin(1.0)
    while spin.due < 1.2:
        now = spin.due
        spin.turn()
    assert [beams for _, beams in looked] == [18] * len(looked)
    assert np.diff([time for time, _ in looked]) == pytest.approx(0.005)
    newest = spin.take()
    assert newest is not None
    assert newest.sweep == 0.1
    # beam i is taken to look at start + i sweep / n: on average over a group that is when the group looked
    told = newest.start + (np.arange(360) + 0.5) * 0.1 / 360
    assert (told - newest.ranges).reshape(20, 18).mean(axis=1) == pytest.approx(0.0, abs=1e-9)


def test_revolutions_that_nobody_takes_are_not_computed_and_the_next_one_that_is_wanted_is_whole() -> None:
    now, looked = 0.0, list[float]()

    def look(rays: Floats) -> Floats:
        looked.append(now)
        return np.full(len(rays), now)

    def turn_until(end: float) -> None:
        nonlocal now
        while spin.due < end - 1e-9:
            now = spin.due
            spin.turn()

    spin = Spin(0.1, look)
    spin.begin(0.0)
    turn_until(60.001)
    assert looked[-1] == pytest.approx(0.2)
    turn_until(60.04)
    old = spin.take()
    assert old is not None and old.start < 0.2
    turn_until(60.205)
    newest = spin.take()
    assert newest is not None
    assert newest.start == pytest.approx(60.1, abs=0.005)
    assert newest.ranges.min() >= 60.1


@pytest.mark.parametrize("kind", [PhysicsBody, KinematicBody])
def test_at_rest_a_turning_lidar_sees_what_a_still_one_sees(kind: type[PhysicsBody] | type[KinematicBody]) -> None:
    scene = get_world("warehouse")
    seen, body = _ahead(scene, kind), kind(scene, seed=1, noise=False)
    body.advance(0.1)
    level = body.lidar()
    far = seen.ranges > 0.7  # nearer the physical robot sees its own legs
    wrong = np.abs(seen.ranges - level)[far]
    assert np.median(wrong) < 0.005
    assert (wrong > 0.05).mean() < 0.05


def test_the_physical_robot_has_its_own_legs_in_sight() -> None:
    lonely = Scene("lonely", (-50.0, -50.0, 50.0, 50.0), (), Pose2(0.0, 0.0), Pose2(0.0, 0.0))
    near = _ahead(lonely, PhysicsBody).ranges < 0.6
    assert 100 < near.sum() < 250  # it lies: its thighs are level with the LiDAR
    angles = np.abs(np.degrees(beam_angles()[near]))
    assert (angles.min(), angles.max()) == pytest.approx((20.0, 160.0), abs=15.0)
    assert not (_ahead(lonely, KinematicBody).ranges < 0.6).any()


def test_a_body_without_a_turning_lidar_has_no_sweeps() -> None:
    body = KinematicBody(get_world("empty"), seed=1)
    assert body.sweep() is None
    body.advance(0.5)
    assert body.sweep() is None


def test_a_turning_lidar_does_not_change_what_the_other_sensors_measure() -> None:
    def samples(sensors: Sensors) -> list[Floats]:
        body = KinematicBody(get_world("warehouse"), seed=3, sensors=sensors)
        body.sweep()
        body.sample(200.0)
        body.advance(0.15)
        found = []
        while (sample := body.next_sample()) is not None:
            found.append(np.concatenate((sample.imu.gyro, sample.joints.position)))
        return found

    assert np.array_equal(samples(TURNING), samples(Sensors.ideal()))


def test_a_leaning_lidar_sees_the_floor_where_geometry_says() -> None:
    """The mount leans forward, by as much as its errors say: the beam ahead meets the floor."""
    lonely = Scene("lonely", (-50.0, -50.0, 50.0, 50.0), (), Pose2(0.0, 0.0), Pose2(0.0, 0.0))
    sensors = Sensors(lidar=LidarErrors(noise=0.0, sweep=0.1, misalignment_sd=0.1))
    seed = next(seed for seed in range(50) if LidarNoise(seed, sensors.lidar).mount[2, 0] < -0.05)
    body = KinematicBody(lonely, seed=seed, sensors=sensors)
    body.sweep()
    body.advance(0.1)
    seen = body.sweep()
    assert seen is not None
    down = -LidarNoise(seed, sensors.lidar).mount[2, 0]
    assert seen.ranges[180] == pytest.approx(body.truth().position[2] / down, abs=1e-9)
    assert seen.ranges[0] == MAX_RANGE
