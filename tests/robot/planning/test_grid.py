"""Occupancy grid: frame and indices as in nav_msgs/OccupancyGrid, distances, inflation."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from robot.geometry.planar import Pose2
from robot.model.footprint import Footprint
from robot.planning.errors import InvalidPose
from robot.planning.grid import Grid, distance_to
from robot.planning.inflation import Inflation
from robot.scenes.scene import Box, Scene
from robot.scenes.worlds import WORLDS, get_world


def test_cell_1_0_is_data_1_and_cell_0_1_is_data_width() -> None:
    data = [0, 100, 0, 0, 0, 0]
    grid = Grid.from_occupancy(data, width=3, height=2, resolution=0.5, origin_x=-1.0, origin_y=2.0)
    assert grid.occupied.tolist() == [[False, True, False], [False, False, False]]
    assert grid.middle(0, 1) == (-0.25, 2.25)
    assert grid.middle(1, 0) == (-0.75, 2.75)
    assert grid.cell(-0.25, 2.25) == (0, 1)
    assert grid.bounds == (-1.0, 2.0, 0.5, 3.0)
    assert grid.to_occupancy().tolist() == data


def test_unknown_and_likely_cells_are_obstacles() -> None:
    grid = Grid.from_occupancy([-1, 64, 65, 0], 4, 1, 0.1)
    assert grid.occupied.tolist() == [[True, False, True, False]]


def test_what_does_not_fit_is_refused_in_words() -> None:
    with pytest.raises(ValueError, match="says 3 x 2 cells, but its data holds 5"):
        Grid.from_occupancy([0] * 5, 3, 2, 0.1)
    with pytest.raises(ValueError, match="resolution"):
        Grid.from_occupancy([0], 1, 1, math.nan)
    with pytest.raises(ValueError, match="2-D"):
        Grid(np.zeros((0, 4), dtype=bool), 0.1)
    with pytest.raises(InvalidPose, match="finite"):
        Grid.from_occupancy([0], 1, 1, 0.1).cell(math.nan, 0.0)


def test_outside_of_the_map_is_no_cell() -> None:
    grid = Grid.from_occupancy([0] * 6, 3, 2, 0.5)
    assert grid.cell(-0.01, 0.0) is None
    assert grid.cell(0.0, 1.0) is None
    assert grid.cell(1.49, 0.99) == (1, 2)


def test_a_grid_is_a_value() -> None:
    grid = Grid.from_scene(get_world("pillars"))
    with pytest.raises(ValueError, match="read-only"):
        grid.occupied[0, 0] = True
    with pytest.raises(ValueError, match="read-only"):
        grid.clearance[0, 0] = 1.0
    assert "0.05 m" in repr(grid)


@pytest.mark.parametrize("name", WORLDS)
def test_a_scene_survives_the_way_over_the_message(name: str) -> None:
    drawn = Grid.from_scene(get_world(name))
    received = Grid.from_occupancy(
        drawn.to_occupancy(), drawn.width, drawn.height, drawn.resolution, drawn.origin_x, drawn.origin_y
    )
    assert (received.occupied == drawn.occupied).all()
    # Outside of obstacles, distances measured on cells agree with the exact ones to a cell's diagonal.
    near = ~drawn.occupied & (drawn.clearance < 2.9)
    assert np.abs(received.clearance - drawn.clearance)[near].max() <= 0.05 * math.sqrt(2.0)


def test_the_clearance_of_a_scene_is_exact() -> None:
    scene = Scene("box", (0, 0, 4, 4), (Box(2, 2, 1, 1),), Pose2(0, 0), Pose2(0, 0))
    grid = Grid.from_scene(scene, resolution=0.1)
    cell = grid.cell(1.05, 2.05)
    assert cell is not None
    assert grid.clearance[cell] == pytest.approx(0.45)
    inside = grid.cell(2.05, 2.05)
    assert inside is not None
    assert grid.clearance[inside] == pytest.approx(-0.45)
    rim = grid.cell(-0.05, 2.05)
    assert rim is not None
    assert grid.occupied[rim]


def test_a_coarser_grid_covers_the_same_floor() -> None:
    grid = Grid.from_scene(get_world("warehouse")).coarser(2)
    assert grid.resolution == 0.1
    cell = grid.cell(2.5, 0.1)
    assert cell is not None
    assert grid.clearance[cell] == pytest.approx(0.9, abs=0.08)


@settings(max_examples=50, deadline=None)
@given(arrays(np.bool_, st.tuples(st.integers(1, 12), st.integers(1, 12))), st.sampled_from([0.2, 0.5, 3.0]))
def test_distances_agree_with_brute_force(occupied: np.ndarray, reach: float) -> None:
    found = distance_to(occupied, 0.1, reach)
    cells, free = np.argwhere(occupied), np.argwhere(~occupied)
    for row, column in np.ndindex(occupied.shape):
        others = free if occupied[row, column] else cells
        gap = np.hypot(*(others - (row, column)).T).min(initial=math.inf)
        said = abs(found[row, column]) / 0.1 + 0.5
        assert (found[row, column] < 0) == occupied[row, column]
        if gap * 0.1 <= reach:
            assert said == pytest.approx(gap)
        else:
            assert said * 0.1 > reach


def test_inflation_is_that_of_the_body_with_room_to_turn_as_comfort() -> None:
    spot, wide = (Inflation.for_footprint(Footprint(width=width), 0.01) for width in (0.5, 0.9))
    assert (spot.inscribed, spot.comfort) == pytest.approx((0.26, 0.85))
    assert (wide.inscribed, wide.comfort) == pytest.approx((0.46, 0.96))


def test_a_meter_costs_a_meter_where_there_is_comfort_and_six_where_it_just_fits() -> None:
    weights = Inflation(inscribed=0.3, comfort=0.9, aversion=5.0).weights(np.array([0.29, 0.3, 0.6, 0.9, math.inf]))
    assert weights.tolist() == pytest.approx([math.inf, 6.0, 1.0 + 5.0 / 4, 1.0, 1.0])


@pytest.mark.parametrize("resolution", [0.05, 0.02, 0.01, 0.005])
def test_a_hall_has_the_same_clearances_in_cells_of_any_size(resolution: float) -> None:
    hall = np.zeros((round(2.5 / resolution), round(3.0 / resolution)), dtype=bool)
    hall[:, : round(0.1 / resolution)] = True
    field = distance_to(hall, resolution)
    assert np.isfinite(field).all()
    row = field.shape[0] // 2
    for away in (0.2, 0.5, 0.9):
        column = round((0.1 + away) / resolution)
        assert field[row, column] == pytest.approx(away, abs=resolution)
    assert field[:, round(1.3 / resolution) :].min() > 0.99
