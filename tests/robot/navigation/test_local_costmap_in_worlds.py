"""What the LiDAR adds to the map in the built-in worlds: what is new, what is gone, and what moves."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from robot.geometry.planar import Pose2
from robot.navigation.local_costmap import LocalCostmap
from robot.planning.grid import Grid
from robot.scenes.scene import Box
from robot.scenes.worlds import get_world
from robot.sim.lidar_rays import cast
from tests.robot.navigation.navigation_sim import VelocityPlant


def test_what_the_map_knows_is_not_marked() -> None:
    scene = get_world("warehouse")
    around = LocalCostmap(Grid.from_scene(scene))
    walker = VelocityPlant(scene, scene.start)
    for tick in range(20):
        around.integrate_scan(0.1 * tick, walker.estimate(), walker.scan())
    assert not around.marked.any()


def test_a_new_box_is_marked_where_it_stands_and_forgotten_when_it_is_gone() -> None:
    scene = get_world("warehouse")
    around = LocalCostmap(Grid.from_scene(scene))
    walker = VelocityPlant(scene, scene.start)
    walker.drop(Box(2.0, 0.5, 0.4, 0.4))
    around.integrate_scan(0.0, walker.pose, walker.scan())
    rows, columns = np.nonzero(around.marked)
    assert len(rows) > 3
    for row, column in zip(rows, columns, strict=True):
        x, y = around.grid.middle(row, column)
        assert abs(x - 2.0) < 0.3
        assert abs(y - 0.5) < 0.3
    assert around.local_field(walker.pose).clearance(np.array([1.5]), np.array([0.4]))[0] < 0.4
    walker.scene = scene
    around.integrate_scan(0.1, walker.pose, walker.scan())
    assert not around.marked.any()


def test_distances_serve_on_near_their_middle_until_a_mark_changes() -> None:
    scene = get_world("empty")
    around = LocalCostmap(Grid.from_scene(scene))
    walker = VelocityPlant(scene, Pose2(0, 0))
    first = around.local_field(walker.pose)
    assert around.local_field(Pose2(0.9, 0.0), first).fine is first.fine
    assert around.local_field(Pose2(1.1, 0.0), first).fine is not first.fine
    walker.drop(Box(2.0, 0.0, 0.4, 0.4))
    around.integrate_scan(0.0, walker.pose, walker.scan())
    x, y = np.array([1.5]), np.array([0.0])
    assert first.clearance(x, y)[0] > 1.0, "an answer that was given does not change any more"
    assert around.local_field(walker.pose, first).clearance(x, y)[0] < 0.4
    other = LocalCostmap(Grid.from_scene(scene)).local_field(walker.pose, around.local_field(walker.pose))
    assert other.clearance(x, y)[0] > 1.0, "distances of another map do not serve"


def test_a_mark_out_of_sight_is_kept_for_its_memory_only() -> None:
    scene = get_world("empty")
    around = LocalCostmap(Grid.from_scene(scene), memory=5.0)
    walker = VelocityPlant(scene, Pose2(0, 0))
    walker.drop(Box(2.0, 0.0, 0.4, 0.4))
    around.integrate_scan(0.0, walker.pose, walker.scan())
    assert around.marked.any()
    blind = np.full(360, 0.9)  # something else close by hides it
    around.integrate_scan(4.0, walker.pose, blind)
    far = np.hypot(*np.meshgrid(*[np.arange(s) * 0.05 - 10.2 for s in around.marked.shape])) > 1.5
    assert around.marked[far].any()
    around.integrate_scan(6.0, walker.pose, blind)
    assert not around.marked[far].any()


def test_a_walking_cylinder_is_seen_to_move_and_a_standing_one_is_not() -> None:
    from robot.scenes.scene import Cylinder

    scene = get_world("empty")
    around = LocalCostmap(Grid.from_scene(scene))
    for tick in range(15):
        t = 0.1 * tick
        pose = Pose2(0.05 * tick, 0.0)
        obstacles = (Cylinder(4.0, 2.0 - 0.5 * t, 0.25), Cylinder(2.0, -1.5, 0.25), Box(3.0, -3.0, 0.5, 0.5))
        world = replace(scene, obstacles=obstacles)
        around.integrate_scan(t, pose, cast(world, pose.x, pose.y, pose.yaw))
    (mover,) = around.movers.moving
    assert mover.vy == pytest.approx(-0.5, abs=0.1)
    assert mover.vx == pytest.approx(0.0, abs=0.1)
    assert math.hypot(mover.x - 4.0, mover.y - 1.3) < 0.3
