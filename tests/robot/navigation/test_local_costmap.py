"""What scans add to the map, against a march of cells written here and scipy's distance transform."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage

from robot.geometry.planar import Pose2
from robot.geometry.vectors import Floats
from robot.hardware.beams import beam_angles
from robot.model.footprint import Footprint
from robot.navigation.local_costmap import MEMORY, LocalCostmap
from robot.planning.grid import Grid
from robot.scenes.scene import Box, Cylinder, Scene
from robot.sim.lidar_rays import cast

WALL = Box(3.5, 0.0, 0.2, 6.0)
SCENE = Scene("hall", (-4.0, -4.0, 4.0, 4.0), (WALL,), Pose2(0.0, 0.0), Pose2(0.0, 0.0))
HERE = Pose2(0.2, -0.3, 0.6)
CRATE = Box(1.6, 0.8, 0.4, 0.5, yaw=0.3)
CELL = 0.05
BEHIND = 20
"""A beam that looks away from crate and wall."""


def grid() -> Grid:
    return Grid.from_scene(SCENE, CELL)


def scan(*others: Box | Cylinder, pose: Pose2 = HERE) -> Floats:
    return cast(dataclasses.replace(SCENE, obstacles=(WALL, *others)), pose.x, pose.y, pose.yaw)


def seen(*others: Box | Cylinder, around: LocalCostmap | None = None, now: float = 0.0) -> LocalCostmap:
    around = around or LocalCostmap(grid())
    around.integrate_scan(now, HERE, scan(*others))
    return around


def test_the_cells_in_which_unexplained_beams_end_are_marked_and_no_others() -> None:
    around, ranges = seen(CRATE), scan(CRATE)
    expected = np.zeros_like(around.marked)
    for angle, r in zip(beam_angles(360), ranges, strict=True):
        x, y = HERE.x + r * np.cos(HERE.yaw + angle), HERE.y + r * np.sin(HERE.yaw + angle)
        nearest_mapped = min(abs(x - 3.4), *(4.0 - abs(v) for v in (x, y)))
        cell = around.grid.cell(x, y)
        if r < 10.0 and cell is not None and nearest_mapped > 0.12 + 0.02 * r + CELL:
            expected[cell] = True
    assert expected.sum() > 10
    np.testing.assert_array_equal(around.marked, expected)


@pytest.mark.parametrize(("distance", "far", "marked"), [(3.0, 0.14, False), (3.0, 0.20, True), (1.0, 0.14, True)])
def test_a_hit_near_a_mapped_face_is_that_face_and_the_more_so_the_farther_the_beam(
    distance: float, far: float, marked: bool
) -> None:
    """`far` m before the wall, seen from `distance` m away."""
    around, ranges = LocalCostmap(grid()), np.full(360, 10.0)
    ranges[180] = distance
    around.integrate_scan(0.0, Pose2(3.4 - far - distance, 0.01), ranges)
    assert around.marked.any() == marked


def test_hits_on_its_own_body_are_not_marked() -> None:
    around, ranges = LocalCostmap(grid(), Footprint(length=1.0, width=0.6)), np.full(360, 10.0)
    ranges[[0, 90, 180, 270]] = 0.49, 0.29, 0.49, 0.29
    around.integrate_scan(0.0, HERE, ranges)
    assert not around.marked.any()
    ranges[[0, 90, 180, 270]] = 0.56, 0.36, 0.56, 0.36
    around.integrate_scan(0.1, HERE, ranges)
    assert around.marked.sum() == 4


@pytest.mark.parametrize("nothing", [10.0, np.inf, np.nan, 12.0])
def test_a_beam_without_a_return_marks_nothing_and_clears_what_it_passes_through(nothing: float) -> None:
    around = seen(CRATE)
    assert around.marked.any()
    around.integrate_scan(0.1, HERE, np.full(360, nothing))
    assert not around.marked.any()


def looked_past(beams: int, past: float) -> bool:
    """Whether one mark 2 m away, seen by one beam, goes when so many beams about it end `past` m behind it."""
    around, ranges, middle = LocalCostmap(grid()), np.full(360, 10.0), 200
    ranges[middle] = 2.0
    around.integrate_scan(0.0, HERE, ranges)
    cell = np.argwhere(around.marked)
    assert len(cell) == 1
    x, y = around.grid.middle(*map(int, cell[0]))
    far, bearing = np.hypot(x - HERE.x, y - HERE.y), np.arctan2(y - HERE.y, x - HERE.x) - HERE.yaw
    middle = round((bearing + np.pi) / (2 * np.pi) * 360)
    hidden = np.full(360, 0.7)
    hidden[middle - beams // 2 : middle + beams // 2 + 1] = far + past
    around.integrate_scan(0.1, HERE, hidden)
    return not around.marked[tuple(cell[0])]


@pytest.mark.parametrize(
    ("beams", "past", "gone"), [(3, 0.12, True), (3, 0.09, False), (1, 3.0, False), (5, 3.0, True)]
)
def test_a_mark_goes_when_three_beams_side_by_side_pass_it_by_a_tenth_of_a_metre(
    beams: int, past: float, gone: bool
) -> None:
    assert looked_past(beams, past) == gone


def test_a_mark_is_kept_for_its_memory_behind_what_hides_it_and_for_no_longer() -> None:
    around = seen(CRATE)
    hidden, marks = np.full(360, 0.8), around.marked.copy()
    around.integrate_scan(MEMORY - 0.1, HERE, hidden)
    assert (around.marked & marks).sum() == marks.sum()
    around.integrate_scan(MEMORY + 0.1, HERE, hidden)
    assert not (around.marked & marks).any()


def test_changes_are_counted_when_marks_change_and_only_then() -> None:
    around = seen(CRATE)
    assert around.changes == 1
    seen(CRATE, around=around, now=0.1)
    assert around.changes == 1
    seen(around=around, now=0.2)
    assert around.changes == 2
    around.forget()
    assert around.changes == 3
    assert around.clearance_to_unmapped() is None


def test_forgetting_drops_marks_and_movers_but_not_what_is_blocked() -> None:
    around = seen(CRATE)
    around.block(-1.0, -1.0)
    around.forget()
    clearance = around.clearance_to_unmapped()
    assert not around.marked.any()
    assert clearance is not None
    assert np.unravel_index(int(clearance.argmin()), clearance.shape) == around.grid.cell(-1.0, -1.0)


def test_the_clearance_to_what_is_unmapped_is_scipys_distance_up_to_a_meter() -> None:
    around = seen(CRATE, Cylinder(-1.0, 1.0, 0.2))
    around.block(-2.0, -2.0)
    marks = around.marked.copy()
    marks[around.grid.cell(-2.0, -2.0)] = True
    middles = ndimage.distance_transform_edt(~marks) * CELL
    clearance = around.clearance_to_unmapped()
    assert clearance is not None
    near = ~marks & (middles < 0.95)
    assert clearance[near] == pytest.approx(middles[near] - 0.01), "a hit lies in the middle of its cell, less 1 cm"
    assert clearance[middles > 1.1].min() > 0.95


def test_places_are_blocked_until_all_are_unblocked() -> None:
    around = LocalCostmap(grid())
    assert around.clearance_to_unmapped() is None
    assert not around.unblock_all(), "there was none"
    around.block(1.0, 1.0)
    around.block(100.0, 100.0)
    clearance = around.clearance_to_unmapped()
    assert clearance is not None
    assert clearance[around.grid.cell(1.0, 1.0)] < 0.0 < clearance[around.grid.cell(1.2, 1.0)]
    assert around.unblock_all()
    assert around.clearance_to_unmapped() is None


def test_blocked_places_are_for_plans_and_do_not_stand_in_the_way_of_a_step() -> None:
    around = LocalCostmap(grid())
    before = around.local_field(HERE).fine
    around.block(0.5, 0.0)
    np.testing.assert_array_equal(around.local_field(HERE).fine, before)


@settings(deadline=None, max_examples=15)
@given(x=st.floats(-3.5, 3.0), y=st.floats(-3.5, 3.5))
def test_the_field_around_the_robot_is_the_nearer_of_map_and_marks(x: float, y: float) -> None:
    around = seen(CRATE)
    field = around.local_field(Pose2(x, y))
    unmapped = around.clearance_to_unmapped()
    assert unmapped is not None
    whole = np.minimum(around.grid.clearance, unmapped)
    rows, columns = ((size + 1) // 2 for size in field.fine.shape)
    part = whole[field.top : field.top + rows, field.left : field.left + columns]
    inner = slice(20, -20), slice(20, -20)  # a meter from the rim, behind which marks are not looked for
    near = part[inner] < 0.9
    np.testing.assert_allclose(field.fine[::2, ::2][inner][near], part[inner][near], atol=1e-9)
    np.testing.assert_allclose(field.fine[1::2, ::2], (field.fine[:-1:2, ::2] + field.fine[2::2, ::2]) / 2)
    np.testing.assert_allclose(field.fine[:, 1::2], (field.fine[:, :-1:2] + field.fine[:, 2::2]) / 2)


def test_the_field_reaches_three_metres_to_every_side_as_far_as_there_is_a_map() -> None:
    middle, corner = LocalCostmap(grid()).local_field(Pose2(0.0, 0.0)), LocalCostmap(grid()).local_field(Pose2(-4, -4))
    assert middle.fine.shape == (2 * 120 - 1, 2 * 120 - 1)
    assert (corner.top, corner.left) == (0, 0)
    assert 60 <= (corner.fine.shape[0] + 1) / 2 <= 66


def test_time_alone_ends_what_moved() -> None:
    around = LocalCostmap(grid())
    for step in range(20):
        post = Cylinder(1.5, -1.0 + 0.08 * step, 0.2)
        around.integrate_scan(0.1 * step, HERE, scan(post))
    assert len(around.movers.moving) == 1
    around.advance(1.9 + 0.7)
    assert around.movers.moving == ()
    assert around.local_field(HERE).movers == ()


def test_forgetting_forgets_what_moved() -> None:
    around = LocalCostmap(grid())
    for step in range(20):
        around.integrate_scan(0.1 * step, HERE, scan(Cylinder(1.5, -1.0 + 0.08 * step, 0.2)))
    around.forget()
    assert around.movers.moving == ()
