"""Exact shortest paths: against a plain search that is obviously right, and against the Moving AI benchmarks."""

from __future__ import annotations

import heapq
import itertools
import json
import math
import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy import ndimage

from robot.planning.errors import GoalBlocked, StartBlocked, Unreachable
from robot.planning.grid import Cell
from robot.planning.path import line_cells, pull
from robot.planning.wavefront import Wavefront
from tests.figures import maps
from tests.figures.__main__ import main
from tests.figures.jump_points import OctileSearch
from tests.figures.landmarks import components

VECTORS = Path(__file__).parents[2] / "conformance" / "vectors" / "movingai"
SHARED = Path(os.environ.get("ROBACTOR_SHARED", Path(__file__).parents[4] / "shared")) / "maps" / "movingai"


def plain(weights: np.ndarray, start: Cell, goal: Cell) -> float:
    """Dijkstra as in the textbook: cost of the cheapest path, inf for none."""
    height, width = weights.shape
    costs, heap = {start: 0.0}, [(0.0, start)]
    while heap:
        cost, (r, c) = heapq.heappop(heap)
        if (r, c) == goal:
            return cost
        if cost > costs[(r, c)]:
            continue
        for dr, dc in itertools.product((-1, 0, 1), repeat=2):
            to = (r + dr, c + dc)
            if not (0 <= to[0] < height and 0 <= to[1] < width) or math.isinf(weights[to]) or to == (r, c):
                continue
            if dr and dc and (math.isinf(weights[r, c + dc]) or math.isinf(weights[r + dr, c])):
                continue
            new = cost + math.hypot(dr, dc) * (weights[r, c] + weights[to]) / 2
            if new < costs.get(to, math.inf):
                costs[to] = new
                heapq.heappush(heap, (new, to))
    return math.inf


def check_walk(cells: tuple[Cell, ...], free: np.ndarray) -> float:
    """Length of a path of turning cells; every stretch is straight or diagonal, free, and cuts no corner."""
    length = 0.0
    for (r0, c0), (r1, c1) in itertools.pairwise(cells):
        steps = max(abs(r1 - r0), abs(c1 - c0))
        dr, dc = (r1 - r0) // steps, (c1 - c0) // steps
        assert (r0 + steps * dr, c0 + steps * dc) == (r1, c1)
        for k in range(1, steps + 1):
            r, c = r0 + k * dr, c0 + k * dc
            assert free[r, c]
            assert free[r - dr, c]
            assert free[r, c - dc]
        length += steps * math.hypot(dr, dc)
    return length


mazes = arrays(np.bool_, st.tuples(st.integers(1, 14), st.integers(1, 14)), elements=st.integers(0, 3).map(bool))


@given(mazes, st.booleans(), st.data())
def test_the_path_is_as_short_as_any(free: np.ndarray, landmarks: bool, data: st.DataObject) -> None:
    open_cells = [tuple(map(int, cell)) for cell in np.argwhere(free)]
    assume(len(open_cells) >= 2)
    start, goal = data.draw(st.sampled_from(open_cells)), data.draw(st.sampled_from(open_cells))
    expected = plain(np.where(free, 1.0, np.inf), start, goal)
    search = OctileSearch(free, landmarks=landmarks)
    if math.isinf(expected):
        with pytest.raises(Unreachable, match="no passage joins"):
            search.solve(start, goal)
        return
    found = search.solve(start, goal)
    assert found.cost == pytest.approx(expected, abs=1e-9)
    assert found.cells[0] == start
    assert found.cells[-1] == goal
    assert check_walk(found.cells, free) == pytest.approx(expected, abs=1e-9)


@given(
    arrays(
        np.float64,
        st.tuples(st.integers(1, 10), st.integers(1, 10)),
        elements=st.sampled_from([1.0, 1.0, 1.5, 2.25, 4.0, 6.0, math.inf]),
    ),
    st.data(),
)
def test_the_wave_finds_the_cheapest_path(weights: np.ndarray, data: st.DataObject) -> None:
    open_cells = [tuple(map(int, cell)) for cell in np.argwhere(np.isfinite(weights))]
    assume(len(open_cells) >= 2)
    start, goal = data.draw(st.sampled_from(open_cells)), data.draw(st.sampled_from(open_cells))
    expected = plain(weights, start, goal)
    found = Wavefront(weights).path(start, goal)
    if found is None:
        assert math.isinf(expected)
        return
    cells, cost = found
    assert cost == pytest.approx(expected, abs=1e-9)
    steps = list(itertools.pairwise(cells))
    assert all(max(abs(a[0] - b[0]), abs(a[1] - b[1])) == 1 for a, b in steps)
    walked = sum(math.dist(a, b) * (weights[a] + weights[b]) / 2 for a, b in steps)
    assert walked == pytest.approx(expected, abs=1e-9)


def test_blocked_ends_have_names() -> None:
    free = np.ones((4, 5), dtype=bool)
    free[1, 1] = False
    search = OctileSearch(free)
    with pytest.raises(StartBlocked, match=r"\(1, 1\)"):
        search.solve((1, 1), (0, 0))
    with pytest.raises(GoalBlocked, match=r"\(9, 0\)"):
        search.solve((0, 0), (9, 0))
    assert search.solve((2, 2), (2, 2)).cost == 0.0


def test_cells_are_joined_as_scipy_labels_them() -> None:
    free = np.pad(np.random.default_rng(3).random((60, 80)) > 0.42, 1)
    labels, expected = components(free), ndimage.label(free)[0]
    pairs = set(zip(labels[free].tolist(), expected[free].tolist(), strict=True))
    assert len(pairs) == expected.max() == len(set(labels[free].tolist()))
    assert (labels[~free] == -1).all()


def test_cells_of_a_serpentine_are_all_joined() -> None:
    free = np.ones((41, 21), dtype=bool)
    free[1::4, :-1] = free[3::4, 1:] = False
    assert len(set(components(np.pad(free, 1)).ravel().tolist())) == 2  # one way, and the walls


@pytest.mark.parametrize("share", [0.1, 0.3])
def test_landmarks_leave_costs_as_they_are_and_most_cells_unopened(share: float) -> None:
    free = np.random.default_rng(1).random((150, 150)) > share
    plain_search, helped = OctileSearch(free), OctileSearch(free, landmarks=True)
    opened = np.zeros(2)
    random = np.random.default_rng(2)
    open_cells = np.argwhere(free)
    for _ in range(60):
        start, goal = (tuple(map(int, open_cells[k])) for k in random.integers(0, len(open_cells), 2))
        try:
            one = plain_search.solve(start, goal)
        except Unreachable:
            with pytest.raises(Unreachable):
                helped.solve(start, goal)
            continue
        other = helped.solve(start, goal)
        assert other.cost == pytest.approx(one.cost, abs=1e-9)
        assert check_walk(other.cells, free) == pytest.approx(one.cost, abs=1e-9)
        opened += one.expanded, other.expanded
    assert opened[1] < 0.7 * opened[0]


def test_a_map_without_a_free_cell_has_no_landmarks() -> None:
    with pytest.raises(StartBlocked):
        OctileSearch(np.zeros((3, 3), dtype=bool), landmarks=True).solve((0, 0), (1, 1))


def test_no_corner_is_cut() -> None:
    free = np.array([[True, False], [True, True]])
    assert OctileSearch(free).solve((0, 0), (1, 1)).cost == 2.0


@given(mazes, st.data())
def test_pulled_paths_are_free_at_every_half_cell_and_never_longer(free: np.ndarray, data: st.DataObject) -> None:
    open_cells = [tuple(map(int, cell)) for cell in np.argwhere(free)]
    assume(len(open_cells) >= 2)
    weights = np.where(free, 1.0, np.inf)
    found = Wavefront(weights).path(data.draw(st.sampled_from(open_cells)), data.draw(st.sampled_from(open_cells)))
    assume(found is not None)
    assert found is not None
    chain = pull(found[0], weights)
    assert chain[0] == found[0][0]
    assert chain[-1] == found[0][-1]
    assert all(free[line_cells(a, b)].all() for a, b in itertools.pairwise(chain))
    assert sum(math.dist(a, b) for a, b in itertools.pairwise(chain)) <= found[1] + 1e-9


def test_an_open_field_is_crossed_in_one_straight_line() -> None:
    weights = np.ones((30, 50))
    found = Wavefront(weights).path((2, 3), (27, 44))
    assert found is not None
    assert pull(found[0], weights) == [(2, 3), (27, 44)]


def test_moving_ai_every_row_of_the_arena_is_exact() -> None:
    report = maps.evaluate(VECTORS / "arena.map")
    assert (report.exact, report.rows) == (160, 160)
    assert report.wrong == ()
    assert 0.9 < report.any_angle < 1.0


@pytest.mark.skipif(not SHARED.is_dir(), reason="the larger Moving AI maps are not part of the repository")
def test_moving_ai_samples_of_every_larger_map_are_exact(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["maps", str(SHARED), "--limit", "25", "--json"]) == 0
    reports = json.loads(capsys.readouterr().out)["maps"]
    assert all(report["exact"] == report["rows"] for report in reports)


def test_the_command_prints_exact_rows_and_speed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["maps", str(VECTORS), "--limit", "20"]) == 0
    printed = capsys.readouterr().out
    assert "20 / 20 rows exact" in printed
    assert "jump points/s" in printed
