"""The scan matcher against scipy's minimiser of the cost that docs/concepts/control.md states, and its symmetries."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage, optimize

from robot.estimation.scan_match import ACCEPTED, ScanMatcher
from robot.geometry.planar import Pose2
from robot.geometry.vectors import Floats
from robot.hardware.beams import beam_angles
from robot.planning.grid import Grid
from robot.scenes.scene import Box, Cylinder, Scene
from robot.sim.lidar_rays import cast

SHAPES = (Cylinder(1.5, 1.0, 0.4), Box(-1.4, 0.8, 0.8, 0.5, yaw=0.4), Box(0.5, -1.8, 1.2, 0.4))
WALLS = (Box(0, -3.05, 6.2, 0.1), Box(0, 3.05, 6.2, 0.1), Box(-3.05, 0, 0.1, 6.2), Box(3.05, 0, 0.1, 6.2))
TRUTH = Pose2(-0.2, -0.3, 0.4)
SIGMA, PRIOR, SCALE = 0.02, np.array((0.3, 0.3, 0.2)), 0.05
"""Of a beam and of the prior, and the last scale of the weight: as the manual has them."""


def room(*shapes: Box | Cylinder, turned: bool = False) -> Scene:
    obstacles = (*WALLS, *(shapes or SHAPES))
    if turned:  # by a quarter turn to the left
        obstacles = tuple(
            Cylinder(-o.y, o.x, o.radius) if isinstance(o, Cylinder) else Box(-o.y, o.x, o.length, o.width, o.yaw + math.pi / 2)
            for o in obstacles
        )  # fmt: skip
    return Scene("room", (-3.0, -3.0, 3.0, 3.0), obstacles, TRUTH, TRUTH)


GRID = Grid.from_scene(room())
MATCHER = ScanMatcher(GRID)


def scan(pose: Pose2 = TRUTH, seed: int = 0, sd: float = 0.0, turned: bool = False) -> Floats:
    exact = cast(room(turned=turned), pose.x, pose.y, pose.yaw)
    return exact + np.random.default_rng(seed).normal(0.0, sd, 360) if sd else exact


def cost(state: Floats, prior: Floats, ranges: Floats) -> float:
    """The sum that is minimised, with scipy's bilinear interpolation of the map's distances."""
    x = state[0] + ranges * np.cos(state[2] + beam_angles(360))
    y = state[1] + ranges * np.sin(state[2] + beam_angles(360))
    at = (y - GRID.origin_y) / GRID.resolution - 0.5, (x - GRID.origin_x) / GRID.resolution - 0.5
    distance = ndimage.map_coordinates(np.clip(GRID.clearance, -2.0, 2.0), at, order=1, mode="nearest")
    robust = (SCALE**2 * np.log1p((distance / SCALE) ** 2)).sum()
    return float(robust + (((state - prior) * SIGMA / PRIOR) ** 2).sum())


@settings(deadline=None, max_examples=12)
@given(seed=st.integers(0, 1000), dx=st.floats(-0.12, 0.12), dy=st.floats(-0.12, 0.12), turn=st.floats(-0.06, 0.06))
def test_the_pose_is_the_one_that_minimises_the_stated_cost(seed: int, dx: float, dy: float, turn: float) -> None:
    """A sixth of the beams end 10 to 40 cm before the walls, on what the map does not know."""
    prior, ranges = np.array((TRUTH.x + dx, TRUTH.y + dy, TRUTH.yaw + turn)), scan(seed=seed, sd=0.02)
    ranges[100:160] -= np.random.default_rng(seed).uniform(0.1, 0.4, 60)
    pose, quality = MATCHER.correct(Pose2(*prior), ranges)
    least = optimize.minimize(cost, (TRUTH.x, TRUTH.y, TRUTH.yaw), (prior, ranges), method="Nelder-Mead")
    assert quality > 0.75
    found = np.array((pose.x, pose.y, pose.yaw))
    assert found == pytest.approx(least.x, abs=1.5e-3)
    assert cost(found, prior, ranges) <= 1.001 * least.fun


@settings(deadline=None, max_examples=20)
@given(x=st.floats(-0.5, 0.5), y=st.floats(-0.5, 0.5), yaw=st.floats(-3.1, 3.1), dx=st.floats(-0.1, 0.1))
def test_a_map_turned_by_a_quarter_gives_the_pose_turned_by_a_quarter(
    x: float, y: float, yaw: float, dx: float
) -> None:
    """The beams are those of the robot's own axes, so the scan is the same one."""
    pose, ranges = Pose2(x, y, yaw), scan(Pose2(x, y, yaw))
    here, _ = MATCHER.correct(Pose2(x + dx, y, yaw), ranges)
    turned = ScanMatcher(Grid.from_scene(room(turned=True)))
    there, _ = turned.correct(Pose2(-y, x + dx, yaw + math.pi / 2), ranges)
    assert (there.x, there.y) == pytest.approx((-here.y, here.x), abs=2e-3)
    assert math.cos(there.yaw - here.yaw - math.pi / 2) == pytest.approx(1.0, abs=1e-5)
    assert (here.x, here.y) == pytest.approx((pose.x, pose.y), abs=4e-3)


def test_the_yaw_that_comes_back_is_wrapped() -> None:
    backward = Pose2(0.0, 0.0, math.pi - 0.01)
    pose, quality = MATCHER.correct(Pose2(0.0, 0.0, -math.pi + 0.03), scan(backward))
    assert quality > 0.9
    assert pose.yaw == pytest.approx(math.pi - 0.01, abs=2e-3)


@pytest.mark.parametrize(("by", "turn"), [(0.55, 0.0), (0.0, 0.40)])
def test_a_correction_beyond_half_a_meter_or_twenty_degrees_is_refused(by: float, turn: float) -> None:
    prior = Pose2(TRUTH.x - by, TRUTH.y, TRUTH.yaw + turn)
    pose, quality = MATCHER.correct(prior, scan())
    assert pose is prior
    assert quality < ACCEPTED


def test_thirty_beams_are_enough_and_twenty_nine_are_not() -> None:
    ranges = np.full(360, np.inf)
    ranges[::12] = scan()[::12]
    prior = Pose2(TRUTH.x + 0.03, TRUTH.y, TRUTH.yaw)
    pose, quality = MATCHER.correct(prior, ranges)
    assert quality > 0.9
    assert pose.x == pytest.approx(TRUTH.x, abs=6e-3)
    ranges[0] = np.nan
    assert MATCHER.correct(prior, ranges) == (prior, 0.0)


def test_the_quality_is_the_share_of_beams_that_end_on_mapped_faces() -> None:
    ranges, random = scan(), np.random.default_rng(5)
    lost = random.choice(360, 90, replace=False)
    ranges[lost] = np.maximum(0.2, ranges[lost] * 0.4)
    pose, quality = MATCHER.correct(TRUTH, ranges)
    assert quality == pytest.approx(0.75, abs=0.03)
    assert (pose.x, pose.y, pose.yaw) == pytest.approx((TRUTH.x, TRUTH.y, TRUTH.yaw), abs=5e-3)


def test_where_nothing_shows_the_way_along_the_prior_holds() -> None:
    corridor = Scene("long", (-9.0, -1.0, 9.0, 1.0), (Box(0, 1.05, 30, 0.1), Box(0, -1.05, 30, 0.1)), TRUTH, TRUTH)
    ranges = cast(corridor, 0.0, 0.1, 0.0)
    ranges[ranges > 4.0] = 10.0
    pose, quality = ScanMatcher(Grid.from_scene(corridor)).correct(Pose2(0.2, 0.0, 0.05), ranges)
    assert quality > 0.9
    assert pose.x == pytest.approx(0.2, abs=0.02)
    assert (pose.y, pose.yaw) == pytest.approx((0.1, 0.0), abs=3e-3)


def test_it_says_of_what_map_it_is() -> None:
    assert repr(MATCHER) == "ScanMatcher(128 x 128 cells of 0.05 m)"
