"""The body without forces: it follows commands exactly, its feet stay put, and it says what no leg could do."""

from __future__ import annotations

import logging
from collections.abc import Callable
from itertools import pairwise
from math import cos, hypot, pi, sin

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot.control.gaits import GAITS, GaitClock
from robot.control.swing import swing_path
from robot.geometry.planar import Pose2
from robot.geometry.vectors import Vector
from robot.hardware.body import MotorTargets
from robot.model.bodies import B2, GO2
from robot.model.kinematics import feet, inverse
from robot.model.legs import foot_velocities, leg_state
from robot.model.modes import Mode
from robot.model.parameters import FOOT_RADIUS, GRAVITY, MASS, SIT_HEIGHT, STAND_HEIGHT
from robot.model.robot import RobotModel
from robot.model.stance import NOMINAL, nominal_feet
from robot.scenes.scene import Box, Cylinder, Scene
from robot.sim.kinematic import KinematicBody
from robot.sim.simulation import Simulation
from tests.robot.control.test_other_bodies import X_LEGS
from tests.robot.stage import floor

EMPTY = floor(start=Pose2(1.0, -2.0, 0.5))
PERIOD = 0.005


def walk(
    body: KinematicBody,
    seconds: float,
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0),
    *,
    mode: Mode = "walk",
    height: float = STAND_HEIGHT,
    look: Callable[[], None] = lambda: None,
) -> None:
    start = body.time
    for i in range(1, round(seconds / PERIOD) + 1):
        body.drive(*velocity, height, mode)
        body.advance(start + i * PERIOD)
        look()


def standing(*, noise: bool = False, seed: int = 1, scene: Scene = EMPTY) -> KinematicBody:
    body = KinematicBody(scene, seed=seed, noise=noise)
    walk(body, 3.0, mode="stand")
    return body


def world_feet(body: KinematicBody) -> Vector:
    truth = body.truth()
    yaw = 2 * np.arctan2(truth.quaternion[3], truth.quaternion[0])
    turn = np.array([[cos(yaw), -sin(yaw), 0], [sin(yaw), cos(yaw), 0], [0, 0, 1]])
    return np.asarray(truth.position + feet(truth.joints) @ turn.T)


def test_it_is_a_body_and_names_its_back_end() -> None:
    body: Simulation = KinematicBody(EMPTY, seed=1)
    assert body.backend == "kinematic"
    assert body.scene is EMPTY
    body.close()


def test_it_starts_lying_at_the_start_of_the_scene_and_draws_nothing() -> None:
    truth = KinematicBody(EMPTY, seed=1).truth()
    assert truth.position == pytest.approx([1.0, -2.0, SIT_HEIGHT + FOOT_RADIUS])
    assert truth.joints == pytest.approx(inverse(nominal_feet(SIT_HEIGHT)).joints)
    assert truth.power == 0.0
    assert not truth.fallen


@pytest.mark.parametrize(
    "velocity", [(0.3, 0, 0), (1.0, 0, 0), (-0.5, 0, 0), (0, 0.4, 0), (0, 0, 1.0), (0.8, 0.1, 0.4)]
)
def test_it_reaches_the_commanded_velocity(velocity: tuple[float, float, float]) -> None:
    body = standing()
    walk(body, 4.0, velocity)
    truth = body.truth()
    yaw = 2 * np.arctan2(truth.quaternion[3], truth.quaternion[0])
    vx, vy, _ = truth.velocity
    assert cos(yaw) * vx + sin(yaw) * vy == pytest.approx(velocity[0], abs=1e-3)
    assert cos(yaw) * vy - sin(yaw) * vx == pytest.approx(velocity[1], abs=1e-3)
    assert truth.angular_velocity[2] == pytest.approx(velocity[2], abs=1e-3)
    assert body.not_achievable is None


def test_the_command_is_slewed_and_followed_with_a_lag_of_0_15_s() -> None:
    body = standing()
    walk(body, 0.4, (0.6, 0, 0))
    # a ramp of 1.5 m/s2 for 0.4 s through a first-order lag ends at a (t - lag (1 - exp(-t / lag)))
    assert hypot(*body.truth().velocity[:2]) == pytest.approx(1.5 * (0.4 - 0.15 * (1 - np.exp(-0.4 / 0.15))), abs=0.01)


def test_standing_feet_roll_on_the_spot_while_the_body_walks_over_them() -> None:
    """The ball of a standing foot may roll under its leg, radius times the calf's turn, but never slides or lifts."""
    body = standing()
    seen: list[tuple[Vector, Vector, Vector]] = []

    def look() -> None:
        sample = body.joints()
        seen.append((world_feet(body), sample.position, sample.contact))

    walk(body, 3.0, (0.8, 0.1, 0.3), look=look)
    swung = 0
    for (before, angles, stood), (after, turned, stands) in pairwise(seen):
        swung += int((~stands).sum())
        assert after[stands][:, 2] == pytest.approx(FOOT_RADIUS, abs=1e-9)
        for leg in np.flatnonzero(stood & stands):
            hip, shoulder, knee = (turned - angles)[3 * leg : 3 * leg + 3]
            rolled = FOOT_RADIUS * hypot(hip, (shoulder + knee) * cos(angles[3 * leg]))
            assert hypot(*(after - before)[leg, :2]) == pytest.approx(rolled, abs=5e-5)
    assert swung > 100


def test_legs_tell_the_speed_of_the_body() -> None:
    """What an estimator reads off a standing foot, rolling included, is the true velocity."""
    body = standing()
    walk(body, 3.0, (0.8, 0.1, 0.3))
    for _ in range(100):
        walk(body, PERIOD, (0.8, 0.1, 0.3))
        sample, turn, up = body.joints(), (0.0, 0.0, float(body.imu().gyro[2])), (0.0, 0.0, 1.0)
        angles = sample.position.tolist()
        moving, rolling = foot_velocities(leg_state(angles, up), angles, sample.velocity.tolist(), turn, up)
        for leg in np.flatnonzero(sample.contact):
            told = np.array(rolling[leg]) - np.array(moving[leg])
            assert told == pytest.approx([0.8, 0.1, 0.0], abs=2e-3)


def test_feet_swing_in_diagonal_pairs_and_at_least_two_always_stand() -> None:
    body, contacts = standing(), []
    walk(body, 3.0, (0.6, 0, 0), look=lambda: contacts.append(body.joints().contact.copy()))
    seen = np.array(contacts)
    assert np.array_equal(seen[:, 0], seen[:, 3])
    assert np.array_equal(seen[:, 1], seen[:, 2])
    assert (seen.sum(axis=1) >= 2).all()
    assert seen.mean() == pytest.approx(GAITS["trot"].duty, abs=0.02)


def test_joint_speeds_are_the_derivative_of_joint_angles() -> None:
    body = standing()
    angles, speeds = [], []

    def look() -> None:
        sample = body.joints()
        angles.append(sample.position)
        speeds.append(sample.velocity)

    walk(body, 3.0, (0.6, 0.1, 0.3), look=look)
    differences = (np.array(angles)[2:] - np.array(angles)[:-2]) / (2 * PERIOD)
    errors = np.abs(differences - np.array(speeds)[1:-1])[200:]
    assert np.quantile(errors, 0.95) < 0.1
    assert np.abs(np.array(speeds)).max() > 3.0


def test_the_imu_integrates_to_the_motion() -> None:
    body = standing()
    velocity, yaw = np.zeros(2), EMPTY.start.yaw

    def look() -> None:
        nonlocal velocity, yaw
        sample = body.imu()
        ax, ay, az = sample.accel
        yaw += sample.gyro[2] * PERIOD
        velocity = velocity + PERIOD * np.array([cos(yaw) * ax - sin(yaw) * ay, sin(yaw) * ax + cos(yaw) * ay])
        assert az == pytest.approx(GRAVITY, abs=1e-3)

    walk(body, 3.0, (0.8, 0, 0.5), look=look)
    truth = body.truth()
    assert velocity == pytest.approx(truth.velocity[:2], abs=0.02)
    assert yaw == pytest.approx(2 * np.arctan2(truth.quaternion[3], truth.quaternion[0]), abs=0.01)


def test_standing_up_and_sitting_down_are_bounded_in_rate_and_arrive() -> None:
    body, heights = KinematicBody(EMPTY, seed=1, noise=False), [SIT_HEIGHT + FOOT_RADIUS]
    walk(body, 3.0, mode="stand", look=lambda: heights.append(body.truth().position[2]))
    assert heights[-1] == pytest.approx(STAND_HEIGHT + FOOT_RADIUS, abs=1e-3)
    walk(body, 3.0, mode="sit", height=SIT_HEIGHT, look=lambda: heights.append(body.truth().position[2]))
    assert heights[-1] == pytest.approx(SIT_HEIGHT + FOOT_RADIUS, abs=1e-3)
    assert np.diff(heights).max() <= 0.25 * PERIOD + 1e-9
    assert np.diff(heights).min() >= -0.40 * PERIOD - 1e-9
    assert body.not_achievable is None


def test_a_lying_body_stands_up_before_it_walks() -> None:
    body = KinematicBody(EMPTY, seed=1, noise=False)

    def look() -> None:
        truth = body.truth()
        assert truth.position[2] >= 0.30 + FOOT_RADIUS - 1e-6 or not truth.velocity[:2].any()

    walk(body, 3.0, (0.5, 0, 0), look=look)
    assert hypot(*body.truth().velocity[:2]) == pytest.approx(0.5, abs=1e-3)


def test_it_walks_to_a_halt_and_plants_its_feet() -> None:
    body = standing()
    walk(body, 3.0, (1.0, 0, 0.5))
    walk(body, 2.0, mode="stand")
    before, joints = body.truth(), body.joints()
    assert joints.contact.all()
    walk(body, 1.0, mode="stand")
    after = body.truth()
    assert after.position == pytest.approx(before.position, abs=1e-3)
    assert np.abs(after.velocity).max() < 1e-3
    # the feet stand near where they belong, so that sitting down is possible from here
    assert np.abs(feet(after.joints)[:, :2] - np.array(NOMINAL)).max() < 0.1
    walk(body, 3.0, mode="sit", height=SIT_HEIGHT)
    assert body.truth().position[2] == pytest.approx(SIT_HEIGHT + FOOT_RADIUS, abs=1e-3)
    assert body.not_achievable is None


def test_without_commands_it_stops_lies_down_and_draws_nothing() -> None:
    body = standing()
    walk(body, 2.0, (0.8, 0, 0))
    body.advance(body.time + 0.099)
    assert hypot(*body.truth().velocity[:2]) == pytest.approx(0.8, abs=1e-3)
    body.advance(body.time + 5.0)
    truth = body.truth()
    assert np.abs(truth.velocity).max() < 1e-3
    assert truth.position[2] == pytest.approx(SIT_HEIGHT + FOOT_RADIUS, abs=1e-2)
    assert truth.power == 0.0


def test_velocities_beyond_the_limits_are_clipped_and_not_numbers_are_refused() -> None:
    body = standing()
    walk(body, 4.0, (-9.0, 0, 0))
    assert hypot(*body.truth().velocity[:2]) == pytest.approx(0.5, abs=1e-3)
    body.drive(float("nan"), 0.0, 0.0, STAND_HEIGHT, "walk")
    body.advance(body.time + PERIOD)
    assert np.isfinite(body.truth().position).all()
    with pytest.raises(ValueError, match="'sit', 'stand' or 'walk'"):
        body.drive(0.0, 0.0, 0.0, float("nan"), "walk")
    with pytest.raises(ValueError, match="'fly'"):
        body.drive(0.0, 0.0, 0.0, 0.45, "fly")  # type: ignore[arg-type]


def test_a_step_no_leg_could_make_is_counted_and_logged_once(caplog: pytest.LogCaptureFixture) -> None:
    body = standing()
    with caplog.at_level(logging.WARNING):
        walk(body, 4.0, (1.6, 0.4, 1.5), height=0.31)
    assert body.not_achievable is not None
    assert "rad/s" in body.not_achievable.reason
    assert body.not_achievable.count > 10
    assert len(caplog.records) == 1
    assert "not achievable" in caplog.text


def test_a_height_out_of_reach_is_reported_and_the_feet_slip_rather_than_stretch() -> None:
    body = standing()
    walk(body, 3.0, mode="stand", height=0.70)
    assert body.not_achievable is not None
    assert "out of its leg's reach" in body.not_achievable.reason
    assert np.isfinite(body.joints().position).all()


def test_a_push_moves_it_and_it_comes_back_to_its_command() -> None:
    body = standing()
    before = body.truth().position
    body.push((0.0, 20.0, 0.0))
    walk(body, 0.1, mode="stand")
    assert 0.2 < body.truth().velocity[1] < 20.0 / MASS
    walk(body, 3.0, mode="stand")
    truth = body.truth()
    assert np.abs(truth.velocity).max() < 1e-3
    # what is left of the impulse after the lag: impulse / mass * lag
    assert truth.position[1] - before[1] == pytest.approx(20.0 / MASS * 0.15, abs=0.01)
    assert truth.position[0] == pytest.approx(before[0], abs=1e-6)


def test_same_seed_and_calls_give_the_same_run_and_another_seed_only_other_noise() -> None:
    first, again, other = (standing(noise=True, seed=seed) for seed in (4, 4, 5))
    for body in (first, again, other):
        walk(body, 1.0, (0.5, 0.1, 0.2))
    for a, b in ((first.joints(), again.joints()),):
        assert np.array_equal(a.position, b.position)
        assert np.array_equal(a.velocity, b.velocity)
    assert np.array_equal(first.imu().accel, again.imu().accel)
    assert not np.array_equal(first.imu().accel, other.imu().accel)
    assert np.array_equal(first.truth().position, other.truth().position)


def test_every_reader_of_an_instant_gets_the_same_sample() -> None:
    body = standing(noise=True)
    assert body.imu() is body.imu()
    assert body.joints() is body.joints()


def test_who_advances_it_and_how_often_hardly_matters() -> None:
    fine, coarse = standing(), standing()
    for i in range(1, 2001):
        fine.drive(0.6, 0.0, 0.3, STAND_HEIGHT, "walk")
        fine.advance(3.0 + i * 0.001)
    walk(coarse, 2.0, (0.6, 0.0, 0.3))
    assert fine.truth().position == pytest.approx(coarse.truth().position, abs=2e-3)


def test_time_stays_on_ticks_and_never_goes_back() -> None:
    body = KinematicBody(EMPTY, seed=1)
    body.advance(0.01234)
    assert body.time == pytest.approx(0.012)
    body.advance(0.0)
    assert body.time == pytest.approx(0.012)


def test_place_puts_it_down_lying_and_at_rest() -> None:
    body = standing()
    walk(body, 2.0, (0.8, 0, 0))
    body.place(Pose2(4.0, 5.0, pi / 2))
    truth = body.truth()
    assert truth.position == pytest.approx([4.0, 5.0, SIT_HEIGHT + FOOT_RADIUS])
    assert not truth.velocity.any()
    assert world_feet(body)[:, 2] == pytest.approx(FOOT_RADIUS)
    assert body.time > 0.0


def test_efforts_carry_the_weight() -> None:
    body = standing()
    sample = body.joints()
    assert sample.contact.all()
    # all four knees push: the weight is on bent legs
    assert (sample.effort[2::3] < -5.0).all() or (sample.effort[2::3] > 5.0).all()
    walk(body, 1.0, (0.3, 0, 0))
    while body.joints().contact.sum() != 2:
        walk(body, PERIOD, (0.3, 0, 0))
    stands = body.joints().contact
    knees = np.abs(body.joints().effort[2::3])
    assert knees[stands].min() > 3 * knees[~stands].max()


def test_power_follows_the_table_of_section_7() -> None:
    body = standing()
    assert body.truth().power == pytest.approx(82.0, rel=0.01)
    walk(body, 4.0, (1.0, 0, 0))
    assert body.truth().power == pytest.approx(304.0, rel=0.01)


def test_the_lidar_sees_the_scene_from_the_body_at_its_height() -> None:
    scene = floor(Box(3, 0, 1, 20), Box(-2, 0, 1, 20, height=0.3))
    body = standing(scene=scene)
    ranges = body.lidar()
    assert ranges.shape == (360,)
    assert ranges[180] == pytest.approx(2.5, abs=1e-6)
    assert ranges[0] == 10.0  # the low wall behind is below the beams
    noisy = standing(scene=scene, noise=True).lidar()
    assert 0.0 < abs(noisy[180] - 2.5) < 0.1


# --- motor targets instead of velocities ---------------------------------------------------------------------------


def targets(position: Vector, velocity: Vector | None = None, kp: float = 250.0) -> MotorTargets:
    zeros = np.zeros(12)
    return MotorTargets(position, zeros if velocity is None else velocity, zeros, np.full(12, kp), np.full(12, 4.0))


def test_motor_targets_raise_the_body_as_the_legs_stretch() -> None:
    body = KinematicBody(EMPTY, seed=1, noise=False)
    for i in range(1, 401):
        height = SIT_HEIGHT + (STAND_HEIGHT - SIT_HEIGHT) * i / 400
        body.command(targets(inverse(nominal_feet(height)).joints))
        body.advance(i * PERIOD)
    truth = body.truth()
    assert truth.position[2] == pytest.approx(STAND_HEIGHT + FOOT_RADIUS, abs=0.005)
    # the feet roll a little under the turning calves
    assert hypot(truth.position[0] - 1.0, truth.position[1] + 2.0) < 0.02


@pytest.mark.parametrize(("vx", "wz"), [(0.4, 0.0), (0.0, 0.5), (0.3, 0.3)])
def test_motor_targets_of_a_trot_push_the_body_along(vx: float, wz: float) -> None:
    """Joint positions of a trot whose standing feet go back at vx and turn by -wz: the body must move by vx and wz.

    Rolling on the feet adds their radius over the leg's height: 8 %.
    """
    body, clock = KinematicBody(EMPTY, seed=1, noise=False), GaitClock(GAITS["trot"])
    gait = clock.gait
    for i in range(1, 1001):
        clock.advance(PERIOD)
        points = nominal_feet(STAND_HEIGHT)
        for leg, (px, py, _) in enumerate(points.tolist()):
            reach = np.array([vx - wz * py, wz * px]) * clock.stance_time / 2
            progress = clock.swing(leg)
            if progress < 0.0:
                points[leg, :2] += reach * (1 - 2 * clock.leg_phase(leg) / gait.duty)
            else:
                start = (px - reach[0], py - reach[1], -STAND_HEIGHT)
                end = (px + reach[0], py + reach[1], -STAND_HEIGHT)
                points[leg] = swing_path(start, end, progress, clock.swing_time, 0.06)[0]
        body.command(targets(inverse(points).joints))
        body.advance(i * PERIOD)
        if i == 500:
            half = body.truth()
    end_truth = body.truth()
    yaws = [2 * np.arctan2(t.quaternion[3], t.quaternion[0]) for t in (half, end_truth)]
    assert (yaws[1] - yaws[0]) / 2.5 == pytest.approx(wz, abs=0.12 * abs(wz) + 0.01)
    if wz == 0.0:
        assert np.linalg.norm(end_truth.position - half.position) / 2.5 == pytest.approx(1.08 * vx, rel=0.1)


def test_targets_without_position_gain_leave_it_standing_still() -> None:
    body = standing()
    before = body.truth().position
    for i in range(1, 201):
        body.command(targets(np.zeros(12), np.full(12, 3.0), kp=0.0))
        body.advance(3.0 + i * PERIOD)
    assert body.truth().position == pytest.approx(before, abs=2e-3)
    assert not body.joints().velocity.any()


def test_a_target_far_away_is_approached_at_12_rad_per_s_and_reported() -> None:
    body = standing()
    far = inverse(nominal_feet(SIT_HEIGHT)).joints
    before = body.joints().position
    body.command(targets(far))
    body.advance(body.time + PERIOD)
    assert np.abs(body.joints().position - before).max() == pytest.approx(12.0 * PERIOD)
    assert body.not_achievable is not None


def test_it_can_change_from_motor_targets_back_to_driving() -> None:
    body = standing()
    stand = inverse(nominal_feet(STAND_HEIGHT)).joints
    body.command(targets(stand))
    body.advance(body.time + 0.05)
    walk(body, 3.0, (0.5, 0, 0))
    assert hypot(*body.truth().velocity[:2]) == pytest.approx(0.5, abs=1e-3)
    assert body.not_achievable is None


# --- touching ------------------------------------------------------------------------------------------------------


poses = st.tuples(st.floats(-2, 2), st.floats(-2, 2), st.floats(-pi, pi))
boxes = st.builds(Box, st.floats(-2, 2), st.floats(-2, 2), st.floats(0.1, 2), st.floats(0.1, 2), st.floats(-pi, pi))
cylinders = st.builds(Cylinder, st.floats(-2, 2), st.floats(-2, 2), st.floats(0.05, 1.0))


def depth(point: np.ndarray, obstacle: Box | Cylinder) -> float:
    """How deep a point lies inside an obstacle, m; negative outside."""
    dx, dy = point[0] - obstacle.x, point[1] - obstacle.y
    if isinstance(obstacle, Cylinder):
        return float(obstacle.radius - hypot(dx, dy))
    c, s = cos(obstacle.yaw), sin(obstacle.yaw)
    return float(min(obstacle.length / 2 - abs(c * dx + s * dy), obstacle.width / 2 - abs(c * dy - s * dx)))


@given(poses, st.one_of(boxes, cylinders))
def test_touching_agrees_with_points_sampled_in_the_outline(
    pose: tuple[float, float, float], obstacle: Box | Cylinder
) -> None:
    x, y, yaw = pose
    scene = floor(obstacle, start=Pose2(x, y, yaw))
    touched = bool(KinematicBody(scene, seed=0).truth().touching)
    along, across = np.meshgrid(np.linspace(-0.55, 0.55, 45), np.linspace(-0.25, 0.25, 21))
    points = np.stack((along.ravel(), across.ravel()), axis=1) @ np.array([[cos(yaw), sin(yaw)], [-sin(yaw), cos(yaw)]])
    deepest = max(depth(point, obstacle) for point in points + np.array([x, y]))
    # the grid is 2.5 cm wide, so within that of the border sampling cannot tell
    if deepest > 0.0:
        assert touched
    elif deepest < -0.04:
        assert not touched


def test_touching_names_obstacles_in_scene_order() -> None:
    obstacles = (Cylinder(0.6, 0.0, 0.2), Box(5, 5, 1, 1), Box(-0.6, 0.0, 0.4, 0.4), Cylinder(0.0, 0.3, 0.1))
    scene = floor(*obstacles)
    assert KinematicBody(scene, seed=0).truth().touching == ("cylinder_0", "box_2", "cylinder_3")


def test_obstacles_that_are_set_are_seen_and_touched_from_that_instant_and_nothing_else_changes() -> None:
    scene = floor(Box(4.0, 0.0, 1.0, 1.0))
    body = KinematicBody(scene, seed=1, noise=False)
    body.advance(1.0)
    ahead = 180
    assert body.lidar()[ahead] == pytest.approx(3.5)

    body.set_obstacles([Box(2.0, 0.0, 1.0, 1.0), Cylinder(0.5, 0.0, 0.1, height=0.1)])

    assert body.lidar()[ahead] == pytest.approx(1.5)
    assert body.truth().touching == ("cylinder_1",)
    assert (body.time, body.truth().yaw) == (1.0, 0.0)
    assert (body.scene.start, body.scene.dock, body.scene.bounds) == (scene.start, scene.dock, scene.bounds)
    assert scene.obstacles == (Box(4.0, 0.0, 1.0, 1.0),)
    body.set_obstacles(())
    assert body.lidar()[ahead] == 10.0
    assert body.truth().touching == ()


@pytest.mark.parametrize("model", [GO2, B2, X_LEGS], ids=lambda model: model.name)
def test_another_robot_stands_at_its_height_and_walks_within_its_joint_limits(model: RobotModel) -> None:
    body = KinematicBody(EMPTY, seed=1, noise=False, model=model)
    assert body.truth().position[2] == pytest.approx(model.sit_height + model.foot_radius)
    walk(body, 3.0, mode="stand", height=model.stand_height)
    assert body.truth().position[2] == pytest.approx(model.stand_height + model.foot_radius, abs=1e-3)
    speed = model.froude(0.1)
    walk(body, 4.0, (speed, 0.0, 0.0), height=model.stand_height)
    truth = body.truth()
    assert hypot(truth.position[0] - EMPTY.start.x, truth.position[1] - EMPTY.start.y) == pytest.approx(
        4.0 * speed, rel=0.1
    )
    assert body.not_achievable is None
    assert feet(truth.joints, model)[:, 2].min() == pytest.approx(-model.stand_height, abs=1e-3)
