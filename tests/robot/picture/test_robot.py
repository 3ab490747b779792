"""The picture of the robot: its links where kinematics puts them, the stage inside its obstacles, and the same bytes every time."""

from __future__ import annotations

import numpy as np
import pytest

from robot.geometry.planar import Pose2
from robot.model.arm import MOUNT, STOWED, TOOL, forward
from robot.model.kinematics import feet
from robot.model.parameters import CALF, FOOT_RADIUS, THIGH
from robot.picture.camera import Camera
from robot.picture.figure import arm_joints, legs, robot_solids
from robot.picture.floor import Layer, floor_layers, paint
from robot.picture.palette import BLACK, CONCRETE, PATH, WHITE
from robot.picture.render import Stage, render
from robot.picture.robot_view import draw_robot
from robot.picture.solids import Solid, ball
from robot.picture.stage import stage_solids, thing_solids
from robot.picture.tracer import nearest
from robot.picture.viewpoint import viewpoint
from robot.png import encode
from robot.scenes.scene import Box, Obstacle
from robot.scenes.worlds import WORLDS, get_world
from tests.robot.picture.kit import rays_through, recorded, standing

YELLOW = np.array((245, 179, 10))


def test_the_legs_follow_the_joint_angles() -> None:
    joints = np.random.default_rng(3).uniform(-0.4, 0.4, 12) + np.tile((0.0, 0.9, -1.6), 4)
    drawn = legs(joints)
    assert np.allclose([leg.foot for leg in drawn], feet(joints), atol=1e-12)
    for leg in drawn:
        assert np.linalg.norm(leg.knee - leg.shoulder) == pytest.approx(THIGH)
        assert np.linalg.norm(leg.foot - leg.knee) == pytest.approx(CALF)


def test_a_standing_robot_touches_the_floor_with_its_feet_and_nothing_sinks_in() -> None:
    lowest = [
        float(solid.centre[2] - np.abs(solid.axes[2]) @ (solid.half - solid.rounding) - solid.rounding)
        for solid in robot_solids(standing(Pose2(1.0, 2.0, 0.7)))
    ]
    assert sum(abs(z) < 1e-6 for z in lowest) == 4
    assert sum(z < FOOT_RADIUS / 4 for z in lowest) == 4


def corners(solid: Solid) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    signs = np.array(np.meshgrid((-1, 1), (-1, 1), (-1, 1))).reshape(3, -1)
    return solid.centre[:, None] + solid.axes @ (signs * solid.half[:, None])


def sticks_out(solid: Solid, obstacle: Obstacle) -> float:
    """How far the drawn solid reaches out of the obstacle it stands for, m."""
    x, y, z = corners(solid)
    over = float(max((z - obstacle.height).max(), (-z).max()))
    if not isinstance(obstacle, Box):
        across = np.hypot(solid.centre[0] - obstacle.x, solid.centre[1] - obstacle.y) + solid.half[0] - obstacle.radius
        return max(over, float(across))
    c, s = np.cos(obstacle.yaw), np.sin(obstacle.yaw)
    along, across = c * (x - obstacle.x) + s * (y - obstacle.y), c * (y - obstacle.y) - s * (x - obstacle.x)
    return max(over, float(np.abs(along).max() - obstacle.length / 2), float(np.abs(across).max() - obstacle.width / 2))


@pytest.mark.parametrize("world", WORLDS)
def test_what_is_drawn_stays_inside_the_obstacle_it_stands_for(world: str) -> None:
    scene = get_world(world)
    for solid in stage_solids(scene):
        assert min(sticks_out(solid, obstacle) for obstacle in scene.obstacles) < 1e-6


@pytest.mark.parametrize("world", WORLDS)
def test_the_eye_sees_the_robot_wherever_the_patrol_takes_it(world: str) -> None:
    scene = get_world(world)
    stage = stage_solids(scene)
    for pose in (scene.start, *scene.patrol):
        camera = viewpoint(scene, pose, 1200, 675)
        body = np.array((pose.x, pose.y, 0.5))
        away = float(np.linalg.norm(body - camera.eye))
        hits = nearest(stage, camera.eye[:, None].astype(np.float32), rays_through(body[None, :], camera.eye))
        assert hits.along[0] > away
        x, y, _ = camera.project(body)
        assert 0.25 * 1200 < x < 0.75 * 1200
        assert 0.2 * 675 < y < 0.8 * 675


def test_the_arm_is_drawn_where_its_kinematics_puts_it() -> None:
    for angles in (STOWED, (0.4, -1.0, 1.2, 0.3), (-1.0, -2.0, 0.5, -0.4)):
        *_, wrist, tip = arm_joints(angles)
        x, y, z, _ = forward(angles)
        assert np.allclose(tip - MOUNT, (x, y, z), atol=1e-12)
        assert np.linalg.norm(tip - wrist) == pytest.approx(TOOL)
    bare, armed = robot_solids(standing(Pose2(0.0, 0.0))), robot_solids(standing(Pose2(0.0, 0.0)), STOWED)
    assert len(armed) > len(bare)


def test_things_are_drawn_in_their_own_colours_where_they_are() -> None:
    cup, crate = thing_solids(get_world("kitchen").things)
    assert cup.cylinder
    assert cup.colour[0] > 5.0 * max(cup.colour[1:])
    assert cup.centre == pytest.approx((2.0, 1.0, 0.5))
    assert not crate.cylinder
    assert crate.colour[2] > 5.0 * max(crate.colour[:2])


@pytest.mark.parametrize("pose", [Pose2(0.9, 0.0, 0.0), Pose2(1.2, 0.9, 0.2), Pose2(2.5, -0.3, -0.8)])
def test_beside_a_table_the_eye_sees_the_robot_and_the_cup(pose: Pose2) -> None:
    scene = get_world("kitchen")
    camera = viewpoint(scene, pose, 1200, 675, scene.things)
    robot, cup = camera.project(np.array((pose.x, pose.y, 0.5))), camera.project(np.array((2.0, 1.0, 0.5)))
    for x, y, depth in (robot, cup):
        assert 30 < x < 1170 and 30 < y < 645 and depth > 0.5
    assert abs(robot[0] - cup[0]) > 100


def test_the_same_recording_gives_the_same_bytes_and_shows_a_yellow_robot() -> None:
    recording = recorded(get_world("pillars"), Pose2(1.0, 0.3, 0.5))
    first = draw_robot(recording, 160, 90)
    again = draw_robot(recorded(get_world("pillars"), Pose2(1.0, 0.3, 0.5)), 160, 90)
    assert encode(first) == encode(again)
    red, green, blue = (first[:, :, k].astype(int) for k in range(3))
    yellow = (red > 150) & (green > 110) & (blue < 80)
    rows, columns = np.nonzero(yellow)
    assert yellow.sum() > 150
    assert 40 < columns.mean() < 120
    assert 20 < rows.mean() < 70


def test_sizes_that_are_no_multiple_of_a_tile_are_cut_not_stretched() -> None:
    stage = Stage([ball(np.array((0.0, 0.0, 0.3)), 0.3, WHITE)], [])
    whole = render(stage, Camera(np.array((0.0, -3.0, 0.3)), np.array((0.0, 0.0, 0.3)), 70, 50))
    assert whole.shape == (50, 70, 3)
    bright = whole[25].sum(axis=1).astype(int)
    assert np.abs(bright - bright[::-1]).max() < 250  # the ball lies in the middle; only the lamp is on one side


def test_edges_are_smooth() -> None:
    stage = Stage([ball(np.array((0.0, 0.0, 1.0)), 0.4, BLACK)], [])
    image = render(stage, Camera(np.array((0.0, -3.0, 1.0)), np.array((0.0, 0.0, 1.2)), 128, 128)).astype(int)
    row = image[:, :, 0][76]
    assert len({int(value) for value in row}) > 4, "between ball and background there are mixed pixels"


def painted(layers: list[Layer], x: float, y: float, blur: float) -> np.ndarray[tuple[int, ...], np.dtype[np.float32]]:
    def many(value: float) -> np.ndarray[tuple[int, ...], np.dtype[np.float32]]:
        return np.full(256, value, dtype=np.float32)

    return paint(layers, many(x), many(y), many(blur))[:, 0]


def test_paint_covers_a_pixel_by_the_share_it_covers() -> None:
    bar = [Layer((1.0, 0.0, 0.0), np.array([(0.5, 0.5, 0.0, 1.0, 0.1)]))]
    bare, full = painted([], 0.5, 0.5, 0.01), painted(bar, 0.5, 0.5, 0.01)
    assert full == pytest.approx((1.0, 0.0, 0.0))
    assert painted(bar, 0.5, 0.55, 0.05) == pytest.approx((full + painted([], 0.5, 0.55, 0.05)) / 2, abs=1e-3)
    assert painted(bar, 0.5, 0.5, 0.4)[1] == pytest.approx(0.75 * painted([], 0.5, 0.5, 0.4)[1], rel=1e-3)
    assert painted(bar, 0.5, 0.7, 0.01) == pytest.approx(painted([], 0.5, 0.7, 0.01))
    assert bare == pytest.approx(CONCRETE, rel=0.2)


def test_the_plan_is_on_the_floor() -> None:
    recording = recorded(get_world("empty"))
    layers = floor_layers(recording)
    on, off = painted(layers, 1.55, 0.06, 0.005), painted(layers, 1.55, 0.4, 0.005)
    assert np.abs(on - PATH).max() < 0.15
    assert off == pytest.approx(CONCRETE, rel=0.2)
