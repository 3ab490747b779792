"""The planner against scipy's Dijkstra on the same priced cells, and by what it promises of every path."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra

from robot.geometry.planar import Pose2
from robot.geometry.vectors import Floats
from robot.model.footprint import Footprint
from robot.planning.errors import GoalBlocked, InvalidPose, NavigationError, StartBlocked, Unreachable
from robot.planning.grid import Cell, Grid
from robot.planning.inflation import Inflation
from robot.planning.path import Path
from robot.planning.planner import Margins, Planner, check_finite
from robot.scenes.scene import Box, Cylinder, Scene

SIDE = 4.0


def scene(*obstacles: Box | Cylinder) -> Scene:
    return Scene("test", (-SIDE, -SIDE, SIDE, SIDE), obstacles, Pose2(0.0, 0.0), Pose2(0.0, 0.0))


def gap(width: float) -> Scene:
    """A wall across the floor with one gap about y = 0."""
    length = SIDE - width / 2
    return scene(Box(0.0, (SIDE + width / 2) / 2, 0.4, length), Box(0.0, -(SIDE + width / 2) / 2, 0.4, length))


FIELD = scene(
    Cylinder(-1.5, -1.0, 0.4), Box(0.5, 1.2, 1.5, 0.6, yaw=0.5), Cylinder(1.5, -1.5, 0.5), Box(-1.5, 2.0, 0.6, 0.6)
)
GRID = Grid.from_scene(FIELD)
PLANNER = Planner(GRID)
SPOT = Inflation.for_footprint(Footprint(), Margins().roomy)
WEST, EAST = Pose2(-2.5, 0.0), Pose2(2.5, 0.0)
places = st.tuples(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0))
# A place on the border of two cells lies in the upper one, and so does its image: there two mirrored worlds are no mirror images.
within = st.builds(lambda cell, share: (cell + share) * GRID.resolution, st.integers(-60, 59), st.floats(0.01, 0.99))
inside = st.tuples(within, within)


def cheapest(grid: Grid, start: Cell, goal: Cell) -> float:
    """Metres of open floor: scipy's Dijkstra on the cells that the roomy try uses."""
    coarse = grid.coarser(2)
    weights = SPOT.weights(coarse.clearance)
    cells = np.arange(weights.size).reshape(weights.shape)
    rows, columns, prices = [], [], []
    for up, right in ((0, 1), (1, 0), (1, 1), (1, -1)):
        a = np.s_[: weights.shape[0] - up, max(0, -right) : weights.shape[1] - max(0, right)]
        b = np.s_[up:, max(0, right) : weights.shape[1] + min(0, right)]
        price = math.hypot(up, right) * (weights[a] + weights[b]) / 2
        if up and right:
            left, right_ = max(0, -right), weights.shape[1] - max(0, right)
            beside = weights[up:, left:right_], weights[:-up, max(0, right) : weights.shape[1] + min(0, right)]
            price = np.where(np.isinf(beside[0]) | np.isinf(beside[1]), np.inf, price)
        free = np.isfinite(price)
        rows.append(cells[a][free])
        columns.append(cells[b][free])
        prices.append(price[free])
    graph = coo_matrix((np.concatenate(prices), (np.concatenate(rows), np.concatenate(columns))), (weights.size,) * 2)
    costs = dijkstra(graph.tocsr(), directed=False, indices=cells[start])
    return float(costs[cells[goal]]) * coarse.resolution


def paid(path: Path, inflation: Inflation, grid: Grid) -> float:
    """The price of a path's metres, every 5 mm of it at the clearance that it has there."""
    points = path.spaced(0.005).points
    clearance = np.array([grid.clearance[grid.cell(x, y)] for x, y in points])
    weights = inflation.weights(np.maximum(clearance, inflation.inscribed))
    steps = np.hypot(*np.diff(points, axis=0).T)
    return float((steps * (weights[1:] + weights[:-1]) / 2).sum())


def clearance_along(path: Path, grid: Grid) -> Floats:
    return np.array([grid.clearance[grid.cell(x, y)] for x, y in path.spaced(0.02).points])


@settings(deadline=None, max_examples=25)
@given(places, places)
@example((0.0, 0.0), (0.1953125, 0.0))
def test_no_path_costs_more_than_the_cheapest_way_over_cells(
    begin: tuple[float, float], end: tuple[float, float]
) -> None:
    start, goal = Pose2(*begin), Pose2(*end)
    coarse = GRID.coarser(2)
    cells = [coarse.cell(pose.x, pose.y) for pose in (start, goal)]
    assume(all(coarse.clearance[cell] > SPOT.inscribed + 0.1 for cell in cells))
    path = PLANNER.plan(start, goal)
    least = cheapest(GRID, cells[0], cells[1])
    clearance = np.array([GRID.clearance[GRID.cell(pose.x, pose.y)] for pose in (start, goal)])
    off = 0.15 * SPOT.weights(np.maximum(clearance, SPOT.inscribed)).sum()
    assert paid(path, SPOT, GRID) <= 1.03 * least + off, "the ends lie off the middles of their cells: 15 cm each"


@settings(deadline=None, max_examples=40)
@given(places, places)
def test_a_path_joins_its_two_places_exactly_and_never_comes_nearer_than_the_body_needs(
    begin: tuple[float, float], end: tuple[float, float]
) -> None:
    start, goal = Pose2(*begin), Pose2(*end)
    try:
        path = PLANNER.plan(start, goal)
    except NavigationError:
        room = [float(GRID.clearance[GRID.cell(pose.x, pose.y)]) for pose in (start, goal)]
        assert min(room) < PLANNER.tightest, "in this field every place is reached where the body fits"
        return
    assert path.points[0].tolist() == list(begin)
    assert path.points[-1].tolist() == list(end)
    walk = clearance_along(path, GRID)
    inner = (path.spaced(0.02).arc > 0.6) & (path.spaced(0.02).arc < path.length - 0.15)
    assert (walk[inner] >= PLANNER.tightest - 0.1).all()
    assert path.length >= math.dist(begin, end) - 1e-9


@pytest.mark.parametrize(("width", "passes"), [(0.48, False), (0.62, True), (0.90, True)])
def test_a_gap_is_planned_through_when_the_body_fits_with_its_margin(width: float, passes: bool) -> None:
    planner = Planner(Grid.from_scene(gap(width)))
    if passes:
        assert planner.plan(WEST, EAST).length == pytest.approx(5.0, abs=0.1)
    else:
        with pytest.raises(
            Unreachable, match=r"no passage of 0\.52 m or more joins \(-2\.50, 0\.00\) and \(2\.50, 0\.00\)"
        ):
            planner.plan(WEST, EAST)


def test_a_wider_body_needs_a_wider_gap() -> None:
    grid, wide = Grid.from_scene(gap(0.9)), Footprint(length=1.2, width=1.0)
    assert Planner(grid).plan(WEST, EAST).length < 5.2
    with pytest.raises(Unreachable, match=r"1\.02 m"):
        Planner(grid, wide).plan(WEST, EAST)
    assert Planner(grid, wide).tightest == pytest.approx(0.51)


@settings(deadline=None, max_examples=10)
@given(st.sampled_from([(1, -1), (-1, 1), (-1, -1)]), inside, inside)
def test_the_mirrored_world_costs_as_much(
    mirror: tuple[int, int], begin: tuple[float, float], end: tuple[float, float]
) -> None:
    sx, sy = mirror
    turn = sx * sy
    shapes = tuple(
        Cylinder(sx * o.x, sy * o.y, o.radius) if isinstance(o, Cylinder) else Box(sx * o.x, sy * o.y, o.length, o.width, turn * o.yaw)
        for o in FIELD.obstacles
    )  # fmt: skip
    mirrored = Planner(Grid.from_scene(scene(*shapes)))
    try:
        here = PLANNER.plan(Pose2(*begin), Pose2(*end))
    except NavigationError as error:
        with pytest.raises(type(error)):
            mirrored.plan(Pose2(sx * begin[0], sy * begin[1]), Pose2(sx * end[0], sy * end[1]))
        return
    there = mirrored.plan(Pose2(sx * begin[0], sy * begin[1]), Pose2(sx * end[0], sy * end[1]))
    assert paid(there, SPOT, Grid.from_scene(scene(*shapes))) == pytest.approx(paid(here, SPOT, GRID), rel=0.05)


def test_the_way_past_a_wall_keeps_its_comfort_where_there_is_room() -> None:
    grid = Grid.from_scene(scene(Box(0.0, -1.2, 8.0, 0.2)))
    path = Planner(grid).plan(Pose2(-3.0, -0.6), Pose2(3.0, -0.6))
    middle = clearance_along(path, grid)[40:-40]
    assert middle.min() > 0.6 > float(grid.clearance[grid.cell(-3.0, -0.6)])
    assert path.length < 6.6


def test_what_the_map_does_not_know_is_walked_round_too() -> None:
    grid = Grid.from_scene(scene())
    extra = np.full_like(grid.clearance, np.inf)
    y, x = np.mgrid[: grid.height, : grid.width] * grid.resolution - SIDE - 0.2
    extra = np.maximum(np.hypot(x, y) - 0.5, -0.4)
    planner = Planner(grid)
    straight, around = planner.plan(WEST, EAST), planner.plan(WEST, EAST, extra)
    assert straight.length == pytest.approx(5.0)
    assert np.hypot(*around.spaced(0.02).points.T).min() > 0.5 + 0.34 - 0.1
    assert planner.price(straight.spaced(0.05).points, extra) == math.inf
    assert planner.price(straight.spaced(0.05).points) == pytest.approx(5.0)
    assert planner.price(around.spaced(0.05).points, extra) < 8.0


def test_a_robot_too_near_to_something_begins_at_the_nearest_place_that_is_not() -> None:
    grid = Grid.from_scene(scene(Box(0.0, 0.0, 1.0, 1.0)))
    close = Pose2(0.6, 0.0)
    path = Planner(grid).plan(close, EAST)
    assert path.points[0].tolist() == [0.6, 0.0]
    assert path.points[1][0] >= 0.5 + 0.26 - 0.05 or len(path.points) == 2
    assert path.length == pytest.approx(1.9, abs=0.15)


@pytest.mark.parametrize(
    ("start", "goal", "error", "words"),
    [
        (Pose2(0.1, 0.0), EAST, StartBlocked, r"stands in an obstacle"),
        (Pose2(9.0, 0.0), EAST, StartBlocked, r"stands outside of the map"),
        (WEST, Pose2(0.0, 0.1), GoalBlocked, r"has 0\.00 m to the nearest obstacle; the robot needs 0\.26 m"),
        (WEST, Pose2(0.7, 0.0), GoalBlocked, r"has 0\.[12]\d m to the nearest obstacle"),
        (WEST, Pose2(0.0, 9.0), GoalBlocked, r"lies outside of the map"),
        (WEST, Pose2(math.nan, 0.0), InvalidPose, r"the goal .* holds NaN or infinity"),
        (Pose2(0.0, math.inf), EAST, InvalidPose, r"the start .* holds NaN"),
    ],
)
def test_what_cannot_be_planned_has_a_name_and_figures(
    start: Pose2, goal: Pose2, error: type[NavigationError], words: str
) -> None:
    planner = Planner(Grid.from_scene(scene(Box(0.0, 0.0, 1.0, 1.0))))
    with pytest.raises(error, match=words) as raised:
        planner.plan(start, goal)
    assert raised.value.name == error.__name__


def test_a_goal_is_checked_by_the_map_alone_before_a_walk() -> None:
    planner = Planner(Grid.from_scene(scene(Box(0.0, 0.0, 1.0, 1.0))))
    planner.check_goal(EAST)
    planner.check_on_map(Pose2(0.0, 0.0))
    with pytest.raises(GoalBlocked, match="nearest obstacle"):
        planner.check_goal(Pose2(0.0, 0.0))
    with pytest.raises(GoalBlocked, match="outside"):
        planner.check_on_map(Pose2(0.0, 5.0))
    for check in (planner.check_goal, planner.check_on_map):
        with pytest.raises(InvalidPose):
            check(Pose2(0.0, 0.0, math.nan))
    check_finite(Pose2(1.0, 2.0, 3.0), "goal")


def test_prices_are_metres_where_there_is_room_and_infinite_off_the_map_and_in_things() -> None:
    def price(*points: tuple[float, float]) -> float:
        line = np.array(
            [(a + (b - a) * k / 100) for a, b in itertools.pairwise(map(np.array, points)) for k in range(101)]
        )
        return PLANNER.price(line)

    assert price((-2.9, -3.0), (-2.6, -2.8)) == pytest.approx(math.hypot(0.3, 0.2))
    assert price((0.5, -0.5), (0.5, 1.2)) == math.inf
    assert price((2.5, 0.0), (7.0, 0.0)) == math.inf
    assert PLANNER.price(np.array([(1.0, 0.0)])) == 0.0
    assert PLANNER.price(np.array([(9.0, 0.0)])) == math.inf
    assert price((-1.0, 0.0), (0.0, 0.0)) > 1.0
