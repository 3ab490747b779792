"""The physics body: time, motor delay, torque limits, lost commands, sensors, contacts with the scene, and its own refusals."""

from __future__ import annotations

import math
import sys
from typing import Any

import numpy as np
import pytest

from robot.geometry.planar import Pose2
from robot.hardware.body import MotorTargets
from robot.model.kinematics import inverse
from robot.model.parameters import SIT_HEIGHT
from robot.model.stance import nominal_feet
from robot.scenes.scene import Box, Cylinder
from robot.sim.ground import Ground, Ice
from robot.sim.physics import BackendMissing, PhysicsBody
from robot.sim.simulation import Simulation
from tests.robot.stage import floor

EMPTY = floor()
ZERO = np.zeros(12)
SIT = inverse(nominal_feet(SIT_HEIGHT)).joints


def holding(joints: np.ndarray[Any, np.dtype[np.float64]], kp: float = 250.0, effort: float = 0.0) -> MotorTargets:
    return MotorTargets(joints, ZERO, ZERO + effort, ZERO + kp, ZERO + 4.0)


def hold(body: PhysicsBody, until: float, height: float) -> None:
    """Hold the nominal stance at `height`, told anew every 5 ms as a controller would."""
    while body.time < until - 1e-9:
        body.command(holding(inverse(nominal_feet(height)).joints))
        body.advance(body.time + 0.005)


def test_it_is_a_body() -> None:
    body: Simulation = PhysicsBody(EMPTY, seed=1)
    assert body.backend == "physics"
    assert body.scene is EMPTY
    assert body.time == 0.0
    assert repr(body) == "PhysicsBody(scene='floor', time=0.0000, delay=0.0040)"


def test_time_goes_to_the_last_tick_and_never_back() -> None:
    body = PhysicsBody(EMPTY, seed=1)
    body.advance(0.0127)
    assert body.time == pytest.approx(0.0125)
    body.advance(0.005)
    assert body.time == pytest.approx(0.0125)


def test_same_seed_same_run_whoever_reads_when() -> None:
    first, second = PhysicsBody(EMPTY, seed=4), PhysicsBody(EMPTY, seed=4)
    for step in range(40):
        for body in (first, second):
            body.command(holding(SIT))
            body.advance((step + 1) * 0.005)
        second.imu()  # a second reader of the same instant gets the same sample and disturbs nobody
        np.testing.assert_array_equal(first.imu().gyro, second.imu().gyro)
        np.testing.assert_array_equal(first.joints().position, second.joints().position)
    np.testing.assert_array_equal(first.truth().position, second.truth().position)


def test_another_seed_is_other_noise_on_the_same_robot() -> None:
    first, second = PhysicsBody(EMPTY, seed=1), PhysicsBody(EMPTY, seed=2)
    np.testing.assert_array_equal(first.truth().joints, second.truth().joints)
    assert np.abs(first.joints().position - second.joints().position).max() > 0.0


@pytest.mark.parametrize("delay", [0.0, 0.004, 0.0065, 0.008])
def test_targets_take_effect_exactly_one_delay_later(delay: float) -> None:
    body = PhysicsBody(EMPTY, seed=1, delay=delay)
    body.advance(1.0)  # on its skid nothing moves, so no damping torque hides the targets
    body.command(MotorTargets(ZERO, ZERO, ZERO + 7.0, ZERO, ZERO))
    body.advance(1.0 + delay)
    before = body.joints().effort
    body.advance(1.0 + delay + 0.0005)
    after = body.joints().effort
    assert np.abs(before).max() < 0.5
    np.testing.assert_allclose(after, 7.0)


def test_drives_saturate_at_the_motor_limits() -> None:
    body = PhysicsBody(EMPTY, seed=1, delay=0.0, noise=False)
    body.command(holding(ZERO, kp=0.0, effort=500.0))
    body.advance(0.0005)
    effort = body.joints().effort.reshape(4, 3)
    np.testing.assert_allclose(effort[:, :2], 45.0)
    assert -2.793 < SIT[2] < -2.156, "between the first two points of the measured curve of the knee's linkage"
    lever = 37.2 + (87.4 - 37.2) * (float(SIT[2]) + 2.793) / (2.793 - 2.156)
    np.testing.assert_allclose(effort[:, 2], lever, rtol=1e-6)


def test_without_commands_the_drives_damp_and_the_skid_carries() -> None:
    body = PhysicsBody(EMPTY, seed=1)
    hold(body, 1.0, 0.40)
    assert body.truth().position[2] > 0.35
    body.advance(1.05)
    assert np.abs(body.joints().effort).max() > 5.0
    body.advance(4.0)
    truth = body.truth()
    assert truth.position[2] == pytest.approx(0.17, abs=0.005)
    assert not truth.fallen
    assert truth.power < 1.0


def test_at_rest_the_sensors_show_gravity_and_their_noise() -> None:
    body = PhysicsBody(EMPTY, seed=3)
    gyro, accel, joints = [], [], []
    for step in range(400):
        body.command(holding(SIT))
        body.advance(1.0 + step * 0.005)
        gyro.append(body.imu().gyro)
        accel.append(body.imu().accel)
        joints.append(body.joints().position)
    assert np.std(np.diff(gyro, axis=0)[100:], axis=0) / math.sqrt(2) == pytest.approx(
        [1.7e-4 * math.sqrt(200)] * 3, rel=0.2
    )
    assert np.linalg.norm(np.mean(accel, axis=0)) == pytest.approx(9.81, abs=0.1)
    assert np.std(np.diff(joints, axis=0)[100:], axis=0).mean() == pytest.approx(5e-4 * math.sqrt(2), rel=0.2)


def test_standing_feet_report_contact_and_power_is_drawn() -> None:
    body = PhysicsBody(EMPTY, seed=1)
    hold(body, 1.5, 0.40)
    assert body.joints().contact.all()
    assert 20.0 < body.truth().power < 250.0


def test_lidar_sees_obstacles_in_the_yaw_frame_and_nothing_else() -> None:
    scene = floor(Box(2.0, 0.0, 0.5, 0.5), Cylinder(0.0, 2.0, 0.3))
    ahead = PhysicsBody(scene, seed=1, noise=False).lidar(360, 10.0)
    assert ahead[180] == pytest.approx(1.75, abs=1e-3)
    assert ahead[270] == pytest.approx(1.70, abs=1e-3)
    assert ahead[0] == 10.0
    body = PhysicsBody(scene, seed=1, noise=False)
    body.place(Pose2(0.0, 0.0, math.pi / 2))
    turned = body.lidar(360, 10.0)
    assert turned[180] == pytest.approx(1.70, abs=1e-3)
    assert turned[90] == pytest.approx(1.75, abs=1e-3)
    assert body.lidar(360, 1.5)[180] == 1.5


def test_touching_names_the_obstacle_in_scene_order() -> None:
    scene = floor(Box(3.0, 3.0, 0.5, 0.5), Cylinder(0.6, 0.0, 0.2))
    body = PhysicsBody(scene, seed=1)
    body.place(Pose2(-0.2, 0.0))
    body.advance(0.1)
    assert body.truth().touching == ()
    body.place(Pose2(0.0, 0.0))
    body.advance(0.102)
    assert body.truth().touching == ("cylinder_1",)


def test_a_push_is_an_impulse() -> None:
    body = PhysicsBody(EMPTY, seed=1, ground=Ground(friction=0.01))
    body.advance(0.5)
    before = body.truth().velocity[0]
    body.push((16.25, 0.0, 0.0), duration=0.05)
    body.advance(0.55)
    assert body.truth().velocity[0] - before == pytest.approx(0.5, rel=0.15)
    body.advance(0.56)
    assert body.truth().velocity[0] <= 0.6


def test_on_ice_a_foot_has_its_friction_and_beside_it_that_of_the_floor() -> None:
    """How far a standing robot slides that is pushed."""

    def slid(ice: Ice | None) -> float:
        body = PhysicsBody(EMPTY, seed=1, ground=Ground(friction=0.8, ice=ice))
        hold(body, 1.0, 0.40)
        before = float(body.truth().position[0])
        body.push((30.0, 0.0, 0.0), duration=0.05)
        hold(body, 1.6, 0.40)
        return float(body.truth().position[0]) - before

    assert slid(Ice(0.05, -2.0, 2.0)) > slid(None) + 0.2
    assert slid(Ice(0.05, 2.0, 4.0)) == slid(None)


@pytest.mark.parametrize("wrong", [(0.0, 1.0, 2.0), (0.1, 2.0, 2.0), (float("nan"), 0.0, 1.0)])
def test_ice_that_cannot_be_is_refused(wrong: tuple[float, float, float]) -> None:
    with pytest.raises(ValueError, match="give a friction above 0 and an end beyond the start"):
        Ice(*wrong)


def test_fallen_means_lying_on_the_side() -> None:
    body = PhysicsBody(EMPTY, seed=1)
    hold(body, 1.0, 0.40)
    assert not body.truth().fallen
    body.push((0.0, 200.0, 0.0))
    hold(body, 3.0, 0.40)
    assert body.truth().fallen
    body.place(Pose2(0.0, 0.0))
    body.advance(body.time + 0.1)
    assert not body.truth().fallen


def test_placed_on_a_slope_it_lies_along_it() -> None:
    body = PhysicsBody(EMPTY, seed=1, ground=Ground(friction=1.0, slope=(math.tan(math.radians(15.0)), 0.0)))
    w, x, y, z = body.truth().quaternion.tolist()
    assert math.degrees(math.asin(2 * (x * z - w * y))) == pytest.approx(15.0, abs=0.01)
    body.advance(1.0)
    assert np.linalg.norm(body.truth().position) < 0.25


def test_payload_is_carried() -> None:
    light, heavy = PhysicsBody(EMPTY, seed=1), PhysicsBody(EMPTY, seed=1, ground=Ground(payload=14.0))
    for body in (light, heavy):
        hold(body, 1.5, 0.40)
    assert np.abs(heavy.joints().effort).sum() > 1.2 * np.abs(light.joints().effort).sum()


@pytest.mark.parametrize(("delay", "timestep"), [(-0.001, 0.0025), (0.004, 0.0), (0.004, 0.01)])
def test_impossible_timing_is_refused(delay: float, timestep: float) -> None:
    with pytest.raises(ValueError, match="motor delay"):
        PhysicsBody(EMPTY, seed=1, delay=delay, timestep=timestep)


def test_without_mujoco_the_error_gives_the_remedy(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(BackendMissing, match="mujoco-core>=4"):
        PhysicsBody(EMPTY, seed=1)
