"""Scan matching: how exact it is, and what it refuses."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import replace

import numpy as np
import pytest

from robot.estimation.scan_match import ACCEPTED, ScanMatcher
from robot.geometry.angles import wrap
from robot.geometry.planar import Pose2
from robot.planning.grid import Grid
from robot.scenes.scene import Box, Scene
from robot.scenes.worlds import get_world
from robot.sim.lidar_rays import cast
from tests.robot.stage import apart, floor

Scan = np.ndarray


def free_poses(grid: Grid, count: int, rng: np.random.Generator, room: float = 0.4) -> list[Pose2]:
    rows, columns = np.nonzero(grid.clearance > room)
    picks = rng.integers(0, len(rows), count)
    return [Pose2(*grid.middle(rows[k], columns[k]), float(rng.uniform(-math.pi, math.pi))) for k in picks]


def scan_at(scene: Scene, pose: Pose2, rng: np.random.Generator, sd: float = 0.02) -> Scan:
    ranges = cast(scene, pose.x, pose.y, pose.yaw)
    return np.where(ranges < 10.0, ranges + rng.normal(0.0, sd, len(ranges)), 10.0)


def moved(pose: Pose2, rng: np.random.Generator, by: float = 0.1, turn: float = math.radians(3.0)) -> Pose2:
    way = rng.uniform(-math.pi, math.pi)
    return Pose2(pose.x + by * math.cos(way), pose.y + by * math.sin(way), pose.yaw + turn * rng.choice([-1.0, 1.0]))


@pytest.mark.parametrize("source", ["scene", "message"])
def test_in_the_warehouse_the_median_is_under_5_mm_and_95_percent_under_15_mm(source: str) -> None:
    scene, rng = get_world("warehouse"), np.random.default_rng(3)
    grid = Grid.from_scene(scene)
    if source == "message":
        grid = Grid.from_occupancy(grid.to_occupancy(), grid.width, grid.height, 0.05, grid.origin_x, grid.origin_y)
    matcher = ScanMatcher(grid)
    errors, turns = [], []
    for truth in free_poses(grid, 300, rng):
        pose, quality = matcher.correct(moved(truth, rng), scan_at(scene, truth, rng))
        assert quality >= 0.9
        errors.append(apart(pose, truth))
        turns.append(abs(wrap(pose.yaw - truth.yaw)))
    assert np.median(errors) <= 0.005
    assert np.quantile(errors, 0.95) <= 0.015
    assert np.quantile(turns, 0.95) <= math.radians(0.1)


def test_a_good_prior_is_not_made_worse_than_the_noise() -> None:
    scene, rng = get_world("pillars"), np.random.default_rng(4)
    grid = Grid.from_scene(scene)
    for truth in free_poses(grid, 50, rng):
        pose, _ = ScanMatcher(grid).correct(truth, scan_at(scene, truth, rng))
        assert apart(pose, truth) < 0.01


def test_unmapped_boxes_do_not_pull_the_pose_away() -> None:
    scene, rng = get_world("warehouse"), np.random.default_rng(5)
    matcher = ScanMatcher(Grid.from_scene(scene))
    truth = Pose2(0.0, 0.5, 0.3)
    cluttered = dataclasses.replace(
        scene, obstacles=(*scene.obstacles, Box(0.0, 1.6, 1.0, 0.3), Box(1.2, 0.2, 0.3, 0.5))
    )
    pose, quality = matcher.correct(moved(truth, rng), scan_at(cluttered, truth, rng))
    assert ACCEPTED <= quality < 0.9
    assert apart(pose, truth) < 0.02


def test_along_a_bare_corridor_the_prior_holds_and_across_it_the_walls_do() -> None:
    walls = (Box(0.0, 1.05, 100.0, 0.1), Box(0.0, -1.05, 100.0, 0.1))
    scene = replace(floor(*walls), bounds=(-50.0, -1.0, 50.0, 1.0))
    rng = np.random.default_rng(6)
    pose, quality = ScanMatcher(Grid.from_scene(scene)).correct(
        Pose2(0.1, 0.1, 0.03), scan_at(scene, Pose2(0.0, 0.0), rng)
    )
    assert quality >= ACCEPTED
    assert abs(pose.y) < 0.01
    assert abs(pose.yaw) < 0.005
    assert pose.x == pytest.approx(0.1, abs=0.03)


def test_a_scan_from_elsewhere_is_refused_and_the_prior_comes_back_as_it_was() -> None:
    scene, rng = get_world("warehouse"), np.random.default_rng(7)
    matcher = ScanMatcher(Grid.from_scene(scene))
    prior = Pose2(0.0, 0.0, 0.0)
    for elsewhere in (Pose2(8.8, 6.0, 1.0), Pose2(4.75, 0.5, 2.0), Pose2(2.5, -2.1, -1.0)):
        pose, quality = matcher.correct(prior, scan_at(scene, elsewhere, rng))
        assert pose is prior
        assert quality < ACCEPTED


def test_a_scan_without_returns_is_refused() -> None:
    matcher = ScanMatcher(Grid.from_scene(get_world("warehouse")))
    prior = Pose2(1.0, 0.5, 0.2)
    for empty in (np.full(360, 10.0), np.full(360, np.inf), np.full(360, np.nan), np.zeros(360)):
        assert matcher.correct(prior, empty) == (prior, 0.0)


def test_a_map_without_obstacles_refuses_every_scan() -> None:
    grid = Grid.from_occupancy(np.zeros(400, dtype=np.int8), 20, 20, 0.5)
    prior = Pose2(5.0, 5.0)
    assert ScanMatcher(grid).correct(prior, np.full(360, 2.0)) == (prior, 0.0)


def test_beams_that_return_nothing_are_left_out() -> None:
    scene, rng = get_world("warehouse"), np.random.default_rng(8)
    truth = Pose2(0.0, 0.5, 0.3)
    scan = scan_at(scene, truth, rng)
    scan[::3] = np.nan
    scan[1::7] = 10.0
    pose, quality = ScanMatcher(Grid.from_scene(scene)).correct(moved(truth, rng), scan)
    assert quality > 0.9
    assert apart(pose, truth) < 0.015
