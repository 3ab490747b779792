"""The wave over any graph of even degree against scipy's Dijkstra."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra

from robot.planning.wavefront import Wavefront, spread

NODES, DEGREE = 40, 3
SMALLEST = 0.5


def graph(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Costs of each node's edges and the nodes at their ends; a third of the edges lead nowhere, many cost the same."""
    random = np.random.default_rng(seed)
    edges = random.choice((SMALLEST, 1.0, 1.5, random.uniform(0.5, 3.0), math.inf, math.inf), (NODES, DEGREE))
    return edges, random.integers(0, NODES, (NODES, DEGREE))


@settings(deadline=None, max_examples=25)
@given(
    seed=st.integers(0, 10_000), source=st.integers(0, NODES - 1), goals=st.sets(st.integers(0, NODES - 1), max_size=4)
)
def test_the_cheapest_target_is_found_at_scipys_cost_and_by_the_edges_there_are(
    seed: int, source: int, goals: set[int]
) -> None:
    edges, ends = graph(seed)
    targets = np.zeros(NODES, dtype=bool)
    targets[list(goals)] = True
    reached, costs, origin = spread(edges, lambda now: ends[now], source, targets, SMALLEST)
    best = np.full((NODES, NODES), np.inf)
    np.minimum.at(best, (np.repeat(np.arange(NODES), DEGREE), ends.ravel()), edges.ravel())
    rows, columns = np.nonzero(np.isfinite(best))
    truth = dijkstra(coo_matrix((best[rows, columns], (rows, columns)), (NODES, NODES)).tocsr(), indices=source)
    least = truth[targets].min(initial=math.inf)
    if reached is None:
        assert math.isinf(least)
        np.testing.assert_allclose(costs, truth)
        return
    assert targets[reached]
    assert costs[reached] == pytest.approx(least)
    node, walked = reached, 0.0
    while node != source:
        walked += float(best[origin[node], node])
        node = int(origin[node])
    assert walked == pytest.approx(least)


def test_without_targets_every_node_gets_its_cost_and_the_source_none() -> None:
    edges = np.array([[1.0, 3.0], [1.0, math.inf], [math.inf, math.inf], [1.0, 1.0]])
    ends = np.array([[1, 2], [2, 0], [0, 0], [0, 0]])
    reached, costs, origin = spread(edges, lambda now: ends[now], 0, np.zeros(4, dtype=bool), 1.0)
    assert reached is None
    assert costs.tolist() == [0.0, 1.0, 2.0, math.inf]
    assert origin.tolist() == [-1, 0, 1, -1]


def test_a_diagonal_step_needs_both_its_neighbors_and_costs_the_root_of_two() -> None:
    open_floor = np.ones((2, 2))
    assert Wavefront(open_floor).path((0, 0), (1, 1)) == ([(0, 0), (1, 1)], pytest.approx(math.sqrt(2.0)))
    corner = np.array([[1.0, math.inf], [1.0, 3.0]])
    assert Wavefront(corner).path((0, 0), (1, 1)) == ([(0, 0), (1, 0), (1, 1)], pytest.approx(1.0 + 2.0))


def test_a_step_costs_the_mean_of_its_two_cells_and_standing_still_nothing() -> None:
    weights = np.array([[1.0, 2.0, 6.0]])
    assert Wavefront(weights).path((0, 0), (0, 2)) == ([(0, 0), (0, 1), (0, 2)], pytest.approx(1.5 + 4.0))
    assert Wavefront(weights).path((0, 1), (0, 1)) == ([(0, 1)], 0.0)


def test_the_way_back_costs_as_much_and_a_wall_has_no_way() -> None:
    random = np.random.default_rng(3)
    weights = random.choice((1.0, 2.0, 5.0, math.inf), (15, 20), p=(0.6, 0.2, 0.1, 0.1))
    weights[0, 0] = weights[14, 19] = 1.0
    there, back = Wavefront(weights).path((0, 0), (14, 19)), Wavefront(weights).path((14, 19), (0, 0))
    assert there is not None
    assert back is not None
    assert there[1] == pytest.approx(back[1])
    weights[:, 10] = math.inf
    assert Wavefront(weights).path((0, 0), (14, 19)) is None


def test_there_is_no_way_round_the_edge_of_the_map() -> None:
    weights = np.ones((3, 5))
    weights[:, 2] = math.inf
    assert Wavefront(weights).path((1, 0), (1, 4)) is None
    assert Wavefront(weights).path((0, 1), (2, 0)) is not None
