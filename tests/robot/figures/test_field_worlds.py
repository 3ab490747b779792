"""Fields drawn from a seed: what is promised of each of them, measured by other means than it was drawn with."""

from __future__ import annotations

from math import hypot, pi

import numpy as np
import pytest
from scipy.sparse.csgraph import minimum_spanning_tree, shortest_path
from scipy.spatial.distance import cdist

from robot.scenes.scene import Cylinder
from tests.figures.field_worlds import PASSAGE, field_world

LEFT, RIGHT, RADIUS = 0.075, 4.425, 0.075


def posts(seed: int) -> np.ndarray:
    found = [post for post in field_world(seed).scene.obstacles if isinstance(post, Cylinder)]
    assert {post.radius for post in found} == {RADIUS}
    return np.array([(post.x, post.y) for post in found])


def widest_way(places: np.ndarray) -> float:
    """Through posts between two walls: whoever gets through passes a gap of each chain of posts that joins the walls, so it is the least,
    over all chains, of the widest gap in one: the widest edge on the way from wall to wall in the tree that spans the posts.
    """
    places = places[places[:, 1] > 0.1]  # without the wall behind the start, which joins the two but bars nothing
    gaps = cdist(places, places)
    tree = minimum_spanning_tree(gaps)
    left, right = (int(np.flatnonzero(np.isclose(places[:, 0], x))[0]) for x in (LEFT, RIGHT))
    _, before = shortest_path(tree, directed=False, indices=left, return_predecessors=True)
    widest, node = 0.0, right
    while node != left:
        widest, node = max(widest, gaps[node, before[node]]), int(before[node])
    return float(widest) - 2 * RADIUS


@pytest.mark.parametrize("seed", range(8))
def test_the_widest_way_through_is_narrow_but_wide_enough(seed: int) -> None:
    # A way is looked for on cells of 5 cm, among squares instead of the posts in them: it can be up to a diagonal of a cell wider.
    assert PASSAGE[0] <= widest_way(posts(seed)) <= PASSAGE[1] + 2 * 0.05 * 2**0.5


def test_a_seed_is_a_world_and_another_seed_another() -> None:
    assert field_world(3) == field_world(3)
    assert field_world(3).scene.obstacles != field_world(4).scene.obstacles


def test_the_robot_begins_at_one_end_and_looks_down_the_corridor_to_its_goal() -> None:
    world = field_world(3)
    assert (world.index, world.scene.name, world.goal_radius) == (3, "field 3", 1.0)
    start, goal = world.scene.start, world.goal
    assert (start.x, start.y, start.yaw) == pytest.approx((2.325, 1.275, pi / 2))
    assert (goal.x, goal.y) == pytest.approx((2.325, 8.325))
    # The reference path winds a little, and no way is shorter than the straight one.
    assert 7.05 <= world.reference <= 1.5 * 7.05
    assert world.optimal_time == world.reference / 2


def test_start_and_goal_have_room_and_walls_close_both_sides_up_to_the_end_of_the_field() -> None:
    world = field_world(3)
    places = posts(3)
    for x, y in ((world.scene.start.x, world.scene.start.y), (world.goal.x, world.goal.y)):
        assert min(hypot(a - x, b - y) for a, b in places) > 0.6
    rows = 0.075 + 0.15 * np.arange(49)
    for wall in (LEFT, RIGHT):
        assert sorted(y for x, y in places if x == pytest.approx(wall)) == pytest.approx(rows.tolist())
    assert sum(y < 0.1 for _, y in places) == 30
