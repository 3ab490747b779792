"""Ramps and blocks on the map: how high the ground is, where it can be walked on, and what of it a LiDAR meets."""

from __future__ import annotations

from math import cos, pi, radians, sin, tan

import numpy as np
import pytest

from robot.geometry.planar import Pose2
from robot.navigation.local_costmap import LocalCostmap
from robot.planning.errors import NavigationError
from robot.planning.grid import Grid
from robot.planning.planner import Planner
from robot.scenes.ramps import ramps
from robot.scenes.scene import Scene
from robot.scenes.terrain import Ramp
from robot.sim.depth_rays import sight
from robot.sim.ground import Ground
from robot.sim.mjcf import write_model

HERE = Pose2(0.0, 0.0)


def world(*terrain: Ramp) -> Scene:
    return Scene("world", (-2.0, -3.0, 8.0, 3.0), (), HERE, HERE, terrain=terrain)


def slope(degrees: float, *, width: float = 2.0) -> tuple[Ramp, Ramp]:
    """Up along x from x = 1 to a height of 0.6 m, and a block there, 2 m long."""
    length = 0.6 / tan(radians(degrees))
    return Ramp(1.0 + length / 2, 0.0, length, width, 0.6), Ramp(2.0 + length, 0.0, 2.0, width, 0.6, bottom=0.6)


def test_the_ground_is_as_high_as_the_physics_engine_has_it() -> None:
    mujoco = pytest.importorskip("mujoco")
    c, s = cos(2.8), sin(2.8)
    turned = (
        Ramp(1.0, -2.0, 1.5, 0.8, 0.4, bottom=0.1, yaw=2.8),
        Ramp(1.0 + 1.25 * c, -2.0 + 1.25 * s, 1.0, 0.8, 0.4, bottom=0.4, yaw=2.8),
    )
    pieces = (*slope(17.0), *turned)
    scene = world(*pieces)
    grid = Grid.from_scene(scene)
    assert grid.ground is not None
    model = mujoco.MjModel.from_xml_string(write_model(scene, Ground(), 0.002))
    data = mujoco.MjData(model)
    data.qpos[:3] = (0.0, 0.0, 50.0)
    mujoco.mj_forward(model, data)
    random, hit = np.random.default_rng(1), np.zeros(1, dtype=np.int32)
    checked = 0
    for row, column in zip(random.integers(6, grid.height - 6, 900), random.integers(6, 140, 900), strict=True):
        around = grid.ground[row - 2 : row + 3, column - 2 : column + 3]
        if np.abs(np.diff(around, axis=0)).max() > 0.03 or np.abs(np.diff(around, axis=1)).max() > 0.03:
            continue  # at an edge
        x, y = grid.middle(int(row), int(column))
        below = mujoco.mj_ray(model, data, np.array((x, y, 3.0)), np.array((0.0, 0.0, -1.0)), None, 1, -1, hit)
        assert grid.ground[row, column] == pytest.approx(3.0 - below, abs=1e-6)
        checked += grid.ground[row, column] > 0.0
    assert checked > 50


def test_a_ramp_of_twenty_degrees_leads_up_and_a_steeper_one_is_a_wall() -> None:
    goal = Pose2(3.5, 0.0)
    path = Planner(Grid.from_scene(world(*slope(20.0)))).plan(HERE, goal)
    assert path.length == pytest.approx(3.5, abs=0.1)
    with pytest.raises(NavigationError):
        Planner(Grid.from_scene(world(*slope(20.5)))).plan(HERE, goal)


def test_the_sides_of_a_block_are_walls_and_a_low_step_is_none() -> None:
    beside = Pose2(3.0, -2.5)
    grid = Grid.from_scene(world(*slope(20.0)))
    path = Planner(grid).plan(Pose2(3.6, 0.0), beside)
    assert path.points[:, 0].min() < 1.0, "back down the ramp, not over the edge"
    low = Grid.from_scene(world(Ramp(3.0, 0.0, 1.0, 1.0, 0.1, bottom=0.1)))
    assert not low.occupied[low.cell(3.0, 0.0) or (0, 0)]
    assert low.clearance[low.cell(2.5, 0.0) or (0, 0)] > 1.0
    high = Grid.from_scene(world(Ramp(3.0, 0.0, 1.0, 1.0, 0.13, bottom=0.13)))
    assert high.clearance[high.cell(2.5, 0.0) or (0, 0)] <= 0.0


def test_walls_beside_a_ramp_stay_where_they_are() -> None:
    scene = ramps(20.0)
    level = Grid.from_scene(Scene("level", scene.bounds, scene.obstacles, scene.start, scene.dock))
    assert (Grid.from_scene(scene).clearance == level.clearance).all()


@pytest.mark.parametrize("mapped", [True, False])
def test_a_ramp_that_the_map_shows_is_no_obstacle_to_a_lidar_that_it_rises_before(mapped: bool) -> None:
    scene = world(*slope(20.0))
    grid = Grid.from_scene(scene if mapped else world())
    angles = -pi + np.arange(360) * (2 * pi / 360)
    rays = np.column_stack((np.cos(angles), np.sin(angles), np.zeros(360)))
    met = sight((), (), np.array((0.0, 0.0, 0.5)), rays, 10.0, scene.terrain)
    assert np.isfinite(met).sum() > 30
    around = LocalCostmap(grid)
    around.integrate_scan(0.0, HERE, np.minimum(met, 10.0))
    assert around.marked.any() != mapped


def test_somebody_on_the_floor_before_a_ramp_is_seen() -> None:
    grid, around = Grid.from_scene(world(*slope(20.0))), LocalCostmap(Grid.from_scene(world(*slope(20.0))))
    ranges = np.full(360, 10.0)
    ranges[175:186] = 1.2
    around.integrate_scan(0.0, HERE, ranges)
    assert around.marked[grid.cell(1.21, 0.0) or (0, 0)]


def test_from_the_top_the_floor_below_is_level_with_nothing() -> None:
    grid = Grid.from_scene(world(*slope(20.0)))
    columns = np.arange(grid.width)
    rows = np.full(grid.width, (grid.cell(0.0, 0.0) or (0, 0))[0])
    assert grid.is_ground(0.0, 0.0, rows, columns).any()
    assert not grid.is_ground(3.5, 0.0, rows, columns).any()
