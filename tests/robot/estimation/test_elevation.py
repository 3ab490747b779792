"""The elevation map against worlds whose heights are known."""

from __future__ import annotations

import math

import numpy as np
import pytest

from robot.estimation.elevation import CEILING, FREE, HIDDEN, LOW, UNSEEN, UPRIGHT, WALL, ElevationMap, Relief
from robot.geometry.planar import Pose2
from robot.hardware.beams import beam_angles
from robot.hardware.depth import PATTERNS, eyes
from robot.scenes.scene import Box, Cylinder, Obstacle, Pit, Scene
from robot.scenes.terrain import Ramp
from robot.sim.depth_noise import DepthNoise, look, seen
from robot.sim.lidar_rays import cast

EYE_HEIGHT = 0.486
LEVEL = np.eye(3)


def pictures(
    world: ElevationMap,
    obstacles: tuple[Obstacle, ...] = (),
    pits: tuple[Pit, ...] = (),
    *,
    count: int = 12,
    begin: float = 0.0,
    step: float = 0.0,
    noise: int | None = 1,
    x: float = 0.0,
    plane: float = math.inf,
) -> float:
    """Take so many pictures while walking ahead by `step` m each; returns the time of the last."""
    spoil = DepthNoise(np.random.default_rng(noise)) if noise is not None else None
    now = begin
    for number in range(count):
        now = begin + 0.1 * number
        place = np.array([x + step * number, 0.0, EYE_HEIGHT])
        depths = look(obstacles, pits, place, LEVEL, number % PATTERNS)
        measured = spoil.apply(depths) if spoil is not None else depths
        if measured is None:
            continue
        points = seen(measured, number % PATTERNS)
        met = np.isfinite(points[:, 0])
        world.move(place[0], 0.0)
        world.integrate(now, points[met] + place, eyes()[met] + place, plane)
    return now


def true_height(world: ElevationMap, obstacles: tuple[Obstacle, ...], pits: tuple[Pit, ...]) -> np.ndarray:
    """The height of each cell's middle, straight from the world's description."""
    x, y = (np.broadcast_to(axis, world.heights.shape) for axis in world.centres())
    height = np.zeros(x.shape)
    for pit in pits:
        height[(np.abs(x - pit.x) < pit.length / 2) & (np.abs(y - pit.y) < pit.width / 2)] = -pit.depth
    for one in obstacles:
        if isinstance(one, Cylinder):
            inside = np.hypot(x - one.x, y - one.y) < one.radius
        else:
            c, s = np.cos(one.yaw), np.sin(one.yaw)
            along, across = c * (x - one.x) + s * (y - one.y), c * (y - one.y) - s * (x - one.x)
            inside = (np.abs(along) < one.length / 2) & (np.abs(across) < one.width / 2)
        height[inside] = one.height
    return height


def kinds(relief: Relief, x: tuple[float, float], y: tuple[float, float]) -> set[int]:
    """What a rectangle holds."""
    rows = slice(*(int((v - relief.origin_y) // relief.resolution) for v in y))
    columns = slice(*(int((v - relief.origin_x) // relief.resolution) for v in x))
    return set(relief.cells[rows, columns].ravel().tolist())


def test_heights_are_those_of_the_world_but_for_cells_on_an_edge() -> None:
    obstacles = (Box(1.6, 0.5, 0.5, 0.5, 0.3, 0.10), Cylinder(1.5, -0.6, 0.25, 0.2))
    pits = (Pit(2.2, 0.0, 0.5, 0.4, 0.15),)
    world = ElevationMap(standing=0.8)
    now = pictures(world, obstacles, pits, count=16, step=0.05)

    truth, height = true_height(world, obstacles, pits), world.heights
    padded = np.pad(truth, 1, mode="edge")
    around = [padded[1 + r : 161 + r, 1 + c : 161 + c] for r in (-1, 0, 1) for c in (-1, 0, 1)]
    inner = (np.max(around, axis=0) == np.min(around, axis=0)) & (world.doubt(now) < 0.1)
    near = np.hypot(*np.broadcast_arrays(world.centres()[0] - 1.2, world.centres()[1])) < 1.6
    judged = inner & near & np.isfinite(height)
    assert judged.sum() > 2000
    assert np.abs(height - truth)[judged].max() < 0.03
    assert np.sqrt(np.mean((height - truth)[judged] ** 2)) < 0.006


@pytest.mark.parametrize("height", [0.05, 0.08, 0.12])
def test_a_thing_from_five_centimetres_on_is_a_step_before_the_robot_is_there(height: float) -> None:
    world = ElevationMap(standing=0.8)
    now = pictures(world, (Box(2.0, 0.0, 0.3, 0.6, height=height),), count=10, step=0.03)
    assert LOW in kinds(world.relief(now), (1.8, 1.95), (-0.25, 0.25))
    assert WALL not in kinds(world.relief(now), (1.0, 2.5), (-0.5, 0.5))


@pytest.mark.parametrize("height", [0.2, 0.45, 1.0, 2.0])
def test_what_is_higher_than_the_trot_can_is_a_wall(height: float) -> None:
    world = ElevationMap(standing=0.8)
    now = pictures(world, (Box(2.0, 0.0, 0.3, 0.6, height=height),))
    assert WALL in kinds(world.relief(now), (1.8, 1.95), (-0.25, 0.25))


def test_a_table_is_a_wall_and_a_beam_over_the_head_is_not() -> None:
    low, high = (Box(1.8, 0.0, 0.4, 0.8, height=bottom + 0.1, bottom=bottom) for bottom in (0.55, CEILING))
    under = ElevationMap(standing=0.8)
    now = pictures(under, (low,))
    assert WALL in kinds(under.relief(now), (1.55, 1.75), (-0.3, 0.3))
    free = ElevationMap(standing=0.8)
    now = pictures(free, (high,))
    assert kinds(free.relief(now), (1.3, 2.3), (-0.5, 0.5)) <= {FREE, UNSEEN}


def test_level_floor_is_floor_however_noisy_the_pictures() -> None:
    world = ElevationMap(standing=0.8)
    now = pictures(world, count=30, step=0.05, noise=4)
    assert set(np.unique(world.relief(now).cells)) == {UNSEEN, FREE}


@pytest.mark.parametrize("degrees", [10, 20])
def test_a_ramp_is_no_step(degrees: int) -> None:
    rise = np.tan(np.radians(degrees))
    x, y = np.meshgrid(np.arange(0.5, 3.0, 0.02), np.arange(-1.0, 1.0, 0.02))
    points = np.stack([x, y, np.maximum(x - 1.0, 0.0) * rise], axis=-1).reshape(-1, 3)
    world = ElevationMap()
    for tenth in range(10):
        world.integrate(0.1 * tenth, points, np.broadcast_to([0.0, 0.0, 0.5], points.shape))
    assert set(np.unique(world.relief(1.0).cells)) == {UNSEEN, FREE}


def test_the_edge_of_a_hole_is_seen_although_its_bottom_is_hidden() -> None:
    world = ElevationMap(standing=0.8)
    now = pictures(world, pits=(Pit(2.0, 0.0, 0.6, 1.0, 1.0),))
    relief = world.relief(now)
    edge = kinds(relief, (1.78, 1.92), (-0.4, 0.4))
    assert LOW in edge
    assert FREE not in edge
    assert HIDDEN in kinds(relief, (1.75, 2.25), (-0.4, 0.4))
    assert kinds(relief, (1.3, 1.65), (-0.4, 0.4)) == {FREE}


HILL = (
    Ramp(2.0, 0.0, 2.0, 3.0, 0.7),
    Ramp(4.0, 0.0, 2.0, 3.0, 0.7, bottom=0.7),
    Ramp(6.0, 0.0, 2.0, 3.0, 0.7, yaw=np.pi),
)
"""Up from x = 1, level from 3 to 5, down to 7: slopes of 19 degrees."""


def over_the_hill(world: ElevationMap, end: float, obstacles: tuple[Obstacle, ...] = ()) -> float:
    """Walk from the start to x = `end`, leaning with the ground, a picture every 5 cm; returns the time of the last."""
    spoil, places = DepthNoise(np.random.default_rng(2)), np.arange(0.0, end, 0.05)
    for number, x in enumerate(places):
        lean = -np.arctan(0.35) if 1.0 < x < 3.0 else np.arctan(0.35) if 5.0 < x < 7.0 else 0.0
        ground = float(np.interp(x, [1.0, 3.0, 5.0, 7.0], [0.0, 0.7, 0.7, 0.0]))
        rotation = np.array([[np.cos(lean), 0.0, np.sin(lean)], [0.0, 1.0, 0.0], [-np.sin(lean), 0.0, np.cos(lean)]])
        place = np.array([x, 0.0, ground + EYE_HEIGHT])
        measured = spoil.apply(look(obstacles, (), place, rotation, number % PATTERNS, HILL))
        if measured is None:
            continue
        points = seen(measured, number % PATTERNS)
        met = np.isfinite(points[:, 0])
        world.move(x, 0.0)
        world.integrate(0.1 * number, points[met] @ rotation.T + place, eyes()[met] @ rotation.T + place)
    return 0.1 * (len(places) - 1)


def test_the_slopes_of_a_hill_are_floor_and_the_ground_is_as_high_as_what_the_robot_stands_on() -> None:
    world = ElevationMap(standing=0.8)
    now = over_the_hill(world, 2.5)
    assert world.ground == pytest.approx(0.525, abs=0.05)
    assert kinds(world.relief(now), (1.3, 2.9), (-0.6, 0.6)) == {FREE}
    now = over_the_hill(world, 6.0)
    assert world.ground == pytest.approx(0.35, abs=0.05)
    assert kinds(world.relief(now), (5.2, 7.4), (-0.6, 0.6)) <= {FREE, UNSEEN}


def test_behind_the_crest_of_a_hill_floor_is_hidden_until_the_robot_is_near_it() -> None:
    world = ElevationMap(standing=0.8)
    now = over_the_hill(world, 3.4)
    assert HIDDEN in kinds(world.relief(now), (5.0, 6.0), (-0.3, 0.3))
    now = over_the_hill(world, 4.6)
    assert kinds(world.relief(now), (4.5, 5.8), (-0.3, 0.3)) == {FREE}


def test_a_height_of_odometry_that_drifts_makes_no_steps_of_what_is_out_of_sight() -> None:
    world, spoil = ElevationMap(standing=0.8), DepthNoise(np.random.default_rng(3))
    for number in range(60):
        turn, drift = 0.05 * number, 0.002 * number  # on the spot, by 3 rad; 12 cm in all
        c, s = np.cos(turn), np.sin(turn)
        rotation, believed = (
            np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]),
            np.array([0.0, 0.0, EYE_HEIGHT + drift]),
        )
        measured = spoil.apply(look((), (), np.array([0.0, 0.0, EYE_HEIGHT]), rotation, number % PATTERNS))
        if measured is None:
            continue
        points = seen(measured, number % PATTERNS)
        met = np.isfinite(points[:, 0])
        world.move(0.0, 0.0)
        world.integrate(0.1 * number, points[met] @ rotation.T + believed, eyes()[met] @ rotation.T + believed)
    assert world.ground == pytest.approx(0.118, abs=0.01)
    assert LOW not in world.relief(6.0).cells


def test_what_hangs_over_a_hill_is_judged_by_its_height_over_the_hill() -> None:
    for bottom, expected in ((0.55, True), (1.2, False)):
        world = ElevationMap(standing=0.8)
        beam = Box(4.6, 0.0, 0.3, 1.0, height=0.7 + bottom + 0.2, bottom=0.7 + bottom)
        now = over_the_hill(world, 3.6, (beam,))
        assert (WALL in kinds(world.relief(now), (4.35, 4.6), (-0.3, 0.3))) == expected


def test_where_somebody_walked_by_there_is_floor_and_a_box_that_was_seen_as_shortly_stays() -> None:
    box = Box(1.8, 1.0, 0.3, 0.3, height=0.3)
    for walks in (True, False):
        world = ElevationMap(standing=0.8)
        for number in range(40):
            person = Cylinder(1.8, -2.0 + 0.1 * number, 0.25, 1.75)
            obstacles: tuple[Obstacle, ...] = (person,) if walks else (box,) if number < 5 else ()
            scene = Scene("hall", (-5.0, -5.0, 5.0, 5.0), obstacles, Pose2(0.0, 0.0), Pose2(0.0, 0.0))
            ranges = cast(scene, 0.0, 0.0, 0.0, height=EYE_HEIGHT)
            world.integrate_scan(
                0.1 * number, 0.0, 0.0, EYE_HEIGHT, beam_angles(len(ranges)), np.where(ranges < 9.0, ranges, np.inf)
            )
            if walks or number < 5:
                pictures(world, obstacles, count=1, begin=0.1 * number, noise=number, plane=EYE_HEIGHT)
        behind = kinds(world.relief(4.0), (1.4, 2.2), (-1.2, 1.2))
        assert ({LOW, WALL, UPRIGHT} & behind != set()) == (not walks)


def test_beams_of_a_body_that_leans_back_pass_over_a_slope_and_it_stays() -> None:
    rise = math.tan(math.radians(20.0))
    x, y = (v.ravel() for v in np.meshgrid(np.arange(-0.5, 4.0, 0.02), np.arange(-1.0, 1.0, 0.02)))
    slope = np.column_stack((x, y, np.maximum(rise * (x - 0.5), 0.0)))
    free = np.full(len(beam_angles()), np.inf)
    for lean, stays in ((rise, True), (0.0, False)):
        world = ElevationMap(standing=0.8)
        world.integrate(0.0, slope, np.broadcast_to((0.0, 0.0, EYE_HEIGHT), slope.shape))
        met = np.where(np.abs(beam_angles()) < 0.1, (EYE_HEIGHT + 0.5 * rise) / rise + 0.5, np.inf)
        world.integrate_scan(0.1, 0.0, 0.0, EYE_HEIGHT, beam_angles(), met)  # level, it sees the slope as a wall
        for number in range(2, 5):
            world.integrate_scan(0.1 * number, 0.0, 0.0, EYE_HEIGHT, beam_angles(), free, (lean, 0.0))
        ahead = kinds(world.relief(0.5), (1.5, 3.5), (-0.5, 0.5))
        assert (WALL not in ahead and UPRIGHT not in ahead) == stays


def test_a_wrong_pixel_in_one_picture_is_no_thing() -> None:
    world = ElevationMap(standing=0.8)
    now = pictures(world, count=10)
    ghost = np.array([[1.52, 0.02, 0.4], [1.53, 0.03, 0.4]])
    world.integrate(now + 0.1, ghost, np.broadcast_to([0.4, 0.0, 0.5], ghost.shape))
    assert kinds(world.relief(now + 0.1), (1.4, 1.65), (-0.1, 0.1)) == {FREE}
    world.integrate(now + 0.2, ghost, np.broadcast_to([0.4, 0.0, 0.5], ghost.shape))
    assert WALL in kinds(world.relief(now + 0.2), (1.4, 1.65), (-0.1, 0.1))


def test_a_thing_that_was_taken_away_is_forgotten_when_the_floor_is_seen_again() -> None:
    world = ElevationMap(standing=0.8)
    now = pictures(world, (Box(1.8, 0.0, 0.3, 0.3, height=0.3),), count=10)
    assert WALL in kinds(world.relief(now), (1.6, 1.75), (-0.1, 0.1))
    now = pictures(world, count=8, begin=now + 0.1)
    assert kinds(world.relief(now), (1.5, 2.1), (-0.3, 0.3)) == {FREE}


def test_doubt_grows_with_age_and_after_half_a_minute_nothing_is_known() -> None:
    world = ElevationMap(standing=0.8)
    now = pictures(world)
    cell = (80, 110)  # 1.5 m ahead
    assert world.age(now)[cell] <= 0.3
    assert world.doubt(now)[cell] < 0.01
    assert world.doubt(now + 9.0)[cell] > 0.025
    nothing = np.empty((0, 3))
    world.integrate(now + 31.0, nothing, nothing)
    assert np.isnan(world.heights).all()


def test_floor_that_was_hidden_behind_an_edge_is_unseen_once_it_is_forgotten() -> None:
    nothing = np.empty((0, 3))
    for away in (0.0, 9.0):
        world = ElevationMap(standing=0.8)
        now = pictures(world, pits=(Pit(2.0, 0.0, 0.6, 1.0, 1.0),))
        assert HIDDEN in world.relief(now).cells
        world.move(away, 0.0)
        world.integrate(now + 31.0, nothing, nothing)
        assert set(np.unique(world.relief(now + 31.0).cells)) == {UNSEEN}


def test_the_floor_that_the_robot_stands_on_at_first_is_known_whatever_the_time_of_day() -> None:
    noon = 1.7e9
    world = ElevationMap(standing=0.8, now=noon)
    now = pictures(world, begin=noon)
    assert kinds(world.relief(now), (-0.4, 0.4), (-0.4, 0.4)) == {FREE}


def test_what_was_seen_stays_in_its_place_while_the_robot_walks_on_and_what_comes_in_is_unknown() -> None:
    world = ElevationMap(standing=0.8)
    now = pictures(world, (Box(1.8, 0.3, 0.3, 0.3, height=0.3),))
    before = world.relief(now).cells
    world.move(1.32, -0.72)
    after = world.relief(now).cells
    assert WALL in before[:145, 26:]
    assert (after[15:, :134] == before[:145, 26:]).all()
    assert (after[:15] == UNSEEN).all()
    assert (after[:, 134:] == UNSEEN).all()
    world.move(100.0, 0.0)
    assert np.isnan(world.heights).all()
