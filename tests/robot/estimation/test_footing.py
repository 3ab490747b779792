"""Where the robot may tread: reliefs laid onto a map."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from robot.estimation.elevation import FREE, HIDDEN, LOW, UNSEEN, UPRIGHT, WALL, Relief
from robot.estimation.footing import Footing
from robot.estimation.movers import Mover
from robot.geometry.planar import Pose2
from robot.model.footprint import Footprint
from robot.navigation.caution import cautious_speed
from robot.navigation.limits import Limits
from robot.navigation.navigator_config import NavigatorConfig
from robot.planning.grid import Grid

BODY, HERE = Footprint(), Pose2(0.0, 0.0)
FLOOR = Grid(np.zeros((160, 160), dtype=np.bool_), 0.05, -4.0, -4.0)


def relief(*patches: tuple[int, float, float], rest: int = FREE) -> Relief:
    """A square of 8 m about the origin, with patches of 3 x 3 cells of a kind at (x, y)."""
    cells = np.full((160, 160), rest, dtype=np.int8)
    for kind, x, y in patches:
        row, column = int((y + 4.0) / 0.05), int((x + 4.0) / 0.05)
        cells[row - 1 : row + 2, column - 1 : column + 2] = kind
    return Relief(cells, 0.05, -4.0, -4.0)


def test_walls_and_steps_lie_where_they_were_seen_also_on_a_map_with_another_origin() -> None:
    grid = Grid(np.zeros((100, 100), dtype=np.bool_), 0.05, -1.98, -1.53)
    footing = Footing(grid)
    assert footing.integrate(relief((WALL, 1.5, 0.5), (LOW, 1.0, -1.0)), HERE, BODY, (), scanned=True)
    assert footing.walls[grid.cell(1.5, 0.5)]
    assert footing.steps[grid.cell(1.0, -1.0)]
    assert (footing.walls.sum(), footing.steps.sum()) == (9, 9)
    assert not footing.integrate(relief((WALL, 1.5, 0.5), (LOW, 1.0, -1.0)), HERE, BODY, (), scanned=True)


def test_what_stands_in_the_lidars_plane_is_left_to_it_while_it_sees() -> None:
    footing = Footing(FLOOR)
    footing.integrate(relief((UPRIGHT, 1.5, 0.0)), HERE, BODY, (), scanned=True)
    assert not footing.walls.any()
    footing.integrate(relief((UPRIGHT, 1.5, 0.0)), HERE, BODY, (), scanned=False)
    assert footing.walls.sum() == 9


def test_the_body_itself_a_mapped_wall_and_somebody_who_walks_are_no_obstacles() -> None:
    occupied = np.zeros((160, 160), dtype=np.bool_)
    occupied[:, 120:] = True  # from x = 2.0 on
    footing = Footing(Grid(occupied, 0.05, -4.0, -4.0))
    person = Mover(0.0, 2.0, 1.0, 0.0, 0.25)
    seen = relief((WALL, 0.3, 0.1), (WALL, 1.95, 0.0), (WALL, -0.1, 2.0))
    footing.integrate(seen, HERE, BODY, (person,), scanned=True)
    assert not footing.walls.any()
    footing.integrate(seen, HERE, BODY, (), scanned=True)
    assert footing.walls.sum() == 9


def test_a_wall_out_of_sight_stays_and_goes_when_its_floor_is_seen() -> None:
    footing = Footing(FLOOR)
    footing.integrate(relief((WALL, 1.5, 0.0)), HERE, BODY, (), scanned=True)
    footing.integrate(relief(rest=UNSEEN), HERE, BODY, (), scanned=True)
    assert footing.walls.sum() == 9
    assert footing.integrate(relief(), HERE, BODY, (), scanned=True)
    assert not footing.walls.any()


def test_what_is_hidden_behind_an_edge_is_a_wall_but_on_a_slope_that_the_map_shows() -> None:
    seen = relief((HIDDEN, 1.5, 0.0), (LOW, 1.5, 1.0), (WALL, 1.5, -1.0))
    footing = Footing(FLOOR)
    footing.integrate(seen, HERE, BODY, (), scanned=True)
    assert (footing.walls.sum(), footing.steps.sum()) == (18, 9)

    ground = np.broadcast_to(np.clip(np.arange(160) - 110, 0, 20) * 0.015, (160, 160))  # up from x = 1.5 on
    on_a_slope = Footing(dataclasses.replace(FLOOR, ground=ground))
    on_a_slope.integrate(seen, HERE, BODY, (), scanned=True)
    assert (on_a_slope.walls.sum(), on_a_slope.steps.sum()) == (9, 0), "a wall is one on a slope, too"


def test_floor_that_the_map_shows_below_the_robot_is_no_hole_where_a_crest_hides_it() -> None:
    seen = relief((HIDDEN, 3.7, 0.0))
    x = np.arange(160) * 0.05 - 4.0
    ground = np.broadcast_to(np.clip(0.36 * (2.0 - x), 0.0, 0.72), (160, 160))  # down from x = 0 to x = 2
    footing = Footing(dataclasses.replace(FLOOR, ground=ground))
    footing.integrate(seen, HERE, BODY, (), scanned=True)
    assert not footing.walls.any()
    footing.integrate(seen, Pose2(2.5, 0.0), BODY, (), scanned=True)
    assert footing.walls.sum() == 9, "seen from that floor it is one"


def test_the_floor_ahead_is_seen_up_to_the_first_gap_that_is_no_single_cell() -> None:
    footing = Footing(FLOOR)
    line = np.column_stack((np.linspace(0.0, 2.0, 41), np.zeros(41)))
    assert footing.seen_along(line) == math.inf  # nobody looks
    gap = relief()
    gap.cells[:, 112] = UNSEEN  # one column at x = 1.6
    footing.integrate(gap, HERE, BODY, (), scanned=True)
    assert footing.seen_along(line) == math.inf
    gap.cells[:, 100:] = UNSEEN  # from x = 1.0 on
    footing = Footing(FLOOR)
    footing.integrate(gap, HERE, BODY, (), scanned=True)
    assert footing.seen_along(line) == pytest.approx(1.05, abs=0.051)


@pytest.mark.parametrize(("seen", "fastest"), [(math.inf, 1.0), (1.3, 0.85), (0.9, 0.4), (0.8, 0.2), (0.0, 0.2)])
def test_the_robot_can_stop_within_the_floor_that_it_sees(seen: float, fastest: float) -> None:
    limits = cautious_speed(Limits(vx_max=1.0), NavigatorConfig(), seen, stepping=False)
    assert limits.vx_max == pytest.approx(fastest)


def test_steps_are_crossed_slowly() -> None:
    limits = cautious_speed(Limits(vx_max=1.0), NavigatorConfig(), math.inf, stepping=True)
    assert limits.vx_max == pytest.approx(0.3, abs=0.051)
    assert limits.vx_min == Limits().vx_min


def test_steps_are_near_within_a_radius() -> None:
    footing = Footing(FLOOR)
    footing.integrate(relief((LOW, 1.5, 0.0)), HERE, BODY, (), scanned=True)
    assert footing.steps_within(HERE, 1.6)
    assert not footing.steps_within(HERE, 1.2)
