"""Narrow places: the heading is planned too, and where the body does not fit, another way is taken."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from robot.geometry.planar import Pose2
from robot.navigation.gaps import plan_through_gap
from robot.navigation.limits import Limits
from robot.navigation.local_costmap import LocalCostmap
from robot.navigation.motion import State
from robot.navigation.navigator import Navigator
from robot.planning.grid import Grid
from robot.planning.planner import Planner
from robot.scenes.scene import Box, Cylinder, Obstacle, Scene
from tests.robot.navigation.navigation_sim import VelocityPlant, body_clearance, walk


def bend(width: float) -> Scene:
    """A corridor along x that turns left into one along y, both `width` wide; outside of them everything is solid."""
    half = width / 2
    obstacles = (
        Box(2.0, -half - 0.5, 10.0, 1.0),
        Box(0.5 - half, half + 1.5, 5.0, 3.0),
        Box(3.0 + half + 0.5, 1.5, 1.0, 7.0),
    )
    return Scene("bend", (-2.0, -1.5, 5.0, 4.0), obstacles, Pose2(0.0, 0.0), Pose2(3.0, 3.0, math.pi / 2))


def test_a_right_angle_between_corridors_of_a_meter_is_threaded_pose_by_pose() -> None:
    scene = bend(1.0)
    grid = Grid.from_scene(scene)
    path = Planner(grid).plan(scene.start, scene.dock)
    around = LocalCostmap(grid)
    pose = Pose2(2.0, 0.0, 0.1)
    poses = plan_through_gap(
        pose, path, path.project(pose.x, pose.y)[0], scene.dock, around.local_field(pose), Limits()
    )
    assert poses is not None
    assert poses[0].tolist() == [2.0, 0.0, 0.1]
    assert poses[-1, 2] == pytest.approx(math.pi / 2, abs=math.pi / 4)
    for a, b in itertools.pairwise(poses):
        assert math.hypot(b[0] - a[0], b[1] - a[1]) <= 0.23
        assert abs(b[2] - a[2]) <= math.pi / 8 + 0.1
    assert all(body_clearance(scene, Pose2(*map(float, p))) > 0.02 for p in poses)


def test_where_the_body_cannot_turn_there_are_no_poses() -> None:
    scene = bend(0.66)
    grid = Grid.from_scene(scene)
    around = LocalCostmap(grid)
    pose = Pose2(2.0, 0.0, 0.0)
    path = Planner(grid).plan(scene.start, scene.dock)
    assert plan_through_gap(pose, path, 2.0, scene.dock, around.local_field(pose), Limits()) is None


def test_the_bend_is_walked_without_contact() -> None:
    scene = bend(1.0)
    navigator, walker = Navigator(Grid.from_scene(scene)), VelocityPlant(scene, scene.start, seed=1)
    navigator.set_goal(scene.dock, walker.pose)
    record = walk(navigator, walker)
    assert record.motion.state is State.ARRIVED
    assert (State.FOLLOWING, "threading") in record.states
    assert record.clearance > 0.0


def test_a_bend_too_narrow_for_the_body_is_left_for_a_longer_way() -> None:
    # A corridor of 66 cm bends left at x = 3. The robot stands in it, has to find out, back out without room to turn round,
    # and walk round the block inside the bend.
    obstacles = (Box(2.0, -0.83, 16.0, 1.0), Box(0.585, 1.33, 4.17, 2.0), Box(3.83, 1.5, 1.0, 4.0))
    scene = Scene("choice", (-5.0, -1.5, 6.0, 5.5), obstacles, Pose2(1.9, 0.0), Pose2(3.0, 4.2, math.pi / 2))
    navigator, walker = Navigator(Grid.from_scene(scene)), VelocityPlant(scene, scene.start, seed=2)
    navigator.set_goal(scene.dock, walker.pose)
    assert navigator.path is not None
    assert navigator.path.length < 6.0
    record = walk(navigator, walker)
    assert record.motion.state is State.ARRIVED
    assert record.clearance > 0.0
    assert record.distance > 10.0


def test_an_unknown_field_of_posts_is_crossed_by_lidar_alone() -> None:
    """BARN's task: nothing is on the map, the passages are narrow, and any contact ends the run."""
    rng = np.random.default_rng(4)
    posts: list[Obstacle] = []
    while len(posts) < 45:
        x, y = float(rng.uniform(-2.2, 2.2)), float(rng.uniform(2.0, 6.0))
        if all(math.hypot(p.x - x, p.y - y) > 0.95 or math.hypot(p.x - x, p.y - y) < 0.2 for p in posts):
            posts.append(Cylinder(x, y, 0.075))
    walls = (Box(-2.45, 4.0, 0.1, 12.0), Box(2.45, 4.0, 0.1, 12.0))
    floor = (-2.4, -2.0, 2.4, 10.0)
    scene = Scene("posts", floor, (*walls, *posts), Pose2(0.0, -0.5, math.pi / 2), Pose2(0.0, 9.0, math.pi / 2))
    empty = replace(scene, obstacles=())
    navigator, walker = Navigator(Grid.from_scene(empty)), VelocityPlant(scene, scene.start, seed=3)
    navigator.set_goal(scene.dock, walker.pose)
    record = walk(navigator, walker)
    assert record.motion.state is State.ARRIVED
    assert record.clearance > 0.0
