"""Paths against a walk along them in tiny steps, and straightened chains by what they cost."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial import distance

from robot.planning.path import Path, line_cells, pull
from robot.planning.wavefront import Wavefront

coordinate = st.floats(-3.0, 3.0)
lines = st.lists(st.tuples(coordinate, coordinate), min_size=2, max_size=6).map(lambda points: Path(np.array(points)))


def walked(path: Path, steps: int = 401) -> tuple[np.ndarray, np.ndarray]:
    """Places along the path and how far along each is, made piece by piece."""
    places, along, before = [], [], 0.0
    for a, b in itertools.pairwise(path.points):
        share = np.linspace(0.0, 1.0, steps)
        places.append(a + share[:, None] * (b - a))
        along.append(before + share * math.dist(a, b))
        before += math.dist(a, b)
    return np.concatenate(places), np.concatenate(along)


@given(lines)
def test_the_length_is_the_sum_of_the_pieces(path: Path) -> None:
    pieces = [math.dist(a, b) for a, b in itertools.pairwise(path.points.tolist())]
    assert path.length == pytest.approx(sum(pieces))
    assert path.arc == pytest.approx(np.concatenate(([0.0], np.cumsum(pieces))))
    assert repr(path) == f"Path({len(path.points)} points, {path.length:.2f} m)"


@given(lines, st.floats(-0.5, 1.5))
def test_the_point_so_far_along_is_where_a_walk_gets_after_so_far(path: Path, share: float) -> None:
    places, along = walked(path)
    reached = places[np.abs(along - min(max(share, 0.0), 1.0) * path.length).argmin()]
    assert math.dist(path.at(share * path.length), reached) <= path.length / 200 + 1e-9


@given(lines, coordinate, coordinate)
def test_a_point_projects_to_the_nearest_place_of_the_path(path: Path, x: float, y: float) -> None:
    along, off = path.project(x, y)
    places, _ = walked(path)
    nearest = distance.cdist([(x, y)], places).min()
    assert off == pytest.approx(nearest, abs=path.length / 400 + 1e-6)
    assert math.dist(path.at(along), (x, y)) == pytest.approx(off, abs=1e-6)


@given(lines, coordinate, coordinate, st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_of_a_stretch_only_that_stretch_is_looked_at(path: Path, x: float, y: float, a: float, b: float) -> None:
    low, high = sorted((a * path.length, b * path.length))
    along, off = path.project(x, y, low, high)
    assert low - 1e-9 <= along <= high + 1e-9
    places, arcs = walked(path)
    inside = (arcs >= low - 1e-9) & (arcs <= high + 1e-9)
    if inside.any():
        nearest = distance.cdist([(x, y)], places[inside]).min()
        assert off <= nearest + path.length / 400 + 1e-9, "it may count what the pieces at its ends have beyond it"


def test_a_stretch_without_length_is_a_point() -> None:
    path = Path(np.array([(0.0, 0.0), (2.0, 0.0)]))
    assert path.project(1.0, 1.0, 0.0, 0.0)[0] == 0.0
    assert path.project(1.0, 1.0, 2.0, 2.0)[0] == 2.0
    assert Path(np.zeros((2, 2))).project(3.0, 4.0, 0.0, 0.0) == (0.0, 5.0)


def test_a_path_of_one_point_is_that_point() -> None:
    here = Path(np.array([(1.0, 2.0)]))
    assert (here.length, here.at(3.0), here.project(4.0, 6.0)) == (0.0, (1.0, 2.0), (0.0, 5.0))


def test_a_path_that_stands_still_in_between_is_no_trouble() -> None:
    path = Path(np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 0.0), (1.0, 1.0)]))
    assert path.project(1.2, 0.5) == pytest.approx((1.5, 0.2))
    assert path.at(1.0) == (1.0, 0.0)


@given(lines, st.floats(0.05, 1.0))
def test_a_spaced_path_is_the_same_line_with_no_longer_steps(path: Path, step: float) -> None:
    assume(path.length > 0.01)
    spaced = path.spaced(step)
    assert np.diff(spaced.arc).max() <= step + 1e-9
    assert spaced.length == pytest.approx(path.length)
    for point in path.points:
        assert distance.cdist([point], spaced.points).min() == pytest.approx(0.0, abs=1e-9)
    assert all(path.project(float(x), float(y))[1] < 1e-6 for x, y in spaced.points)


def test_a_path_is_a_value() -> None:
    with pytest.raises(ValueError, match="read-only"):
        Path(np.zeros((2, 2))).points[0, 0] = 1.0


@given(st.tuples(st.integers(0, 30), st.integers(0, 30)), st.tuples(st.integers(0, 30), st.integers(0, 30)))
def test_the_cells_under_a_line_lead_from_end_to_end_without_a_leap(a: tuple[int, int], b: tuple[int, int]) -> None:
    rows, columns = line_cells(a, b)
    assert ((rows[0], columns[0]), (rows[-1], columns[-1])) == (a, b)
    assert max(np.abs(np.diff(rows)).max(), np.abs(np.diff(columns)).max()) <= 1
    length = math.dist(a, b)
    for row, column in zip(rows, columns, strict=True):
        off = abs((b[0] - a[0]) * (column - a[1]) - (b[1] - a[1]) * (row - a[0]))
        assert off <= length * math.sqrt(0.5) + 1e-9, "a cell that the line passes through"


@given(
    arrays(np.float64, st.tuples(st.integers(4, 14), st.integers(4, 14)), elements=st.sampled_from([1.0, 1.0, 1.0, 1.5, 4.0, math.inf])),
    st.data(),
)  # fmt: skip
def test_a_straightened_chain_costs_at_most_a_hundredth_more_than_the_cells(
    weights: np.ndarray, data: st.DataObject
) -> None:
    cells = [tuple(map(int, cell)) for cell in np.argwhere(np.isfinite(weights))]
    assume(len(cells) > 2)
    found = Wavefront(weights).path(data.draw(st.sampled_from(cells)), data.draw(st.sampled_from(cells)))
    assume(found is not None)
    chain = pull(found[0], weights)
    assert (chain[0], chain[-1]) == (found[0][0], found[0][-1])
    assert [found[0].index(cell) for cell in chain] == sorted(found[0].index(cell) for cell in chain)
    cost = 0.0
    for a, b in itertools.pairwise(chain):
        price = weights[line_cells(a, b)]
        assert np.isfinite(price).all()
        step = (weights[a] + weights[b]) / 2 if max(abs(a[0] - b[0]), abs(a[1] - b[1])) == 1 else price.mean()
        cost += math.dist(a, b) * step
    assert cost <= found[1] * 1.01 + 1e-6


def test_a_path_along_a_wall_keeps_the_distance_that_its_costs_asked_for() -> None:
    weights = np.ones((20, 40))
    weights[8:12, 10:30] = 6.0
    found = Wavefront(weights).path((10, 2), (10, 37))
    chain = pull(found[0], weights)
    assert max(abs(row - 10) for row, _ in chain) >= 2, "round the costly middle, not straight through it"
    assert 2 < len(chain) < 8
