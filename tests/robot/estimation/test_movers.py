"""What moves is followed while it is seen, and forgotten soon after: by itself, as part of the surroundings, and by the navigator."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from numpy.typing import NDArray

from robot.estimation.movers import Movers
from robot.geometry.planar import Pose2
from robot.navigation.local_costmap import LocalCostmap
from robot.navigation.navigator import Navigator
from robot.planning.grid import Grid
from robot.scenes.scene import Cylinder, Scene
from robot.scenes.worlds import get_world
from robot.sim.lidar_rays import cast

HERE = Pose2(0.0, 0.0)
EMPTY = get_world("empty")
WALK = 25
"""Scans for which the pedestrian is in sight, at 10 Hz."""


def disc(x: float, y: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The hits on the near side of a disc of 20 cm radius."""
    angle = np.linspace(2.0, 4.3, 12)
    return x + 0.2 * np.cos(angle), y + 0.2 * np.sin(angle)


def followed(scans: int, speed: float = 0.6) -> Movers:
    """A disc that has walked along y for so many scans at 10 Hz; the last was at 0.1 (scans - 1) s."""
    movers = Movers()
    for scan in range(scans):
        x, y = disc(3.0, -1.0 + speed * 0.1 * scan)
        movers.update(0.1 * scan, x, y, np.zeros(len(x), dtype=np.bool_))
    return movers


def nothing() -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]:
    return np.zeros(0), np.zeros(0), np.zeros(0, dtype=np.bool_)


def pedestrian(time: float) -> Scene:
    return dataclasses.replace(EMPTY, obstacles=(Cylinder(3.0, -1.0 + 0.8 * time, 0.25),))


def test_what_moves_steadily_is_known_by_its_velocity() -> None:
    (mover,) = followed(12).moving
    assert (mover.vx, mover.vy) == pytest.approx((0.0, 0.6), abs=0.02)


def test_two_scans_are_too_few_and_what_creeps_stands() -> None:
    assert followed(2).moving == ()
    assert followed(40, speed=0.1).moving == ()


def test_what_stands_on_places_known_for_a_while_does_not_move() -> None:
    movers = followed(12)
    x, y = disc(3.0, -1.0 + 0.06 * 12)
    movers.update(1.2, x, y, np.ones(len(x), dtype=np.bool_))
    assert movers.moving == ()


def test_what_is_too_large_is_not_followed() -> None:
    movers = Movers()
    for scan in range(12):
        y = np.linspace(-0.8, 0.8, 20) + 0.06 * scan
        movers.update(0.1 * scan, np.full(20, 3.0), y, np.zeros(20, dtype=np.bool_))
    assert movers.moving == ()


def test_one_missed_scan_does_not_lose_it() -> None:
    movers = followed(12)
    movers.update(1.2, *nothing())
    assert len(movers.moving) == 1


def test_what_left_is_forgotten_by_scans_without_a_single_hit() -> None:
    movers = followed(12)
    for scan in range(12, 20):
        movers.update(0.1 * scan, *nothing())
    assert movers.moving == ()


def test_what_left_is_forgotten_when_scans_stop_coming() -> None:
    movers = followed(12)
    movers.age(1.5)
    assert len(movers.moving) == 1
    movers.age(2.0)
    assert movers.moving == ()


def test_the_surroundings_forget_a_pedestrian_who_vanishes_from_an_otherwise_empty_view() -> None:
    around = LocalCostmap(Grid.from_scene(EMPTY))
    for scan in range(WALK):
        around.integrate_scan(0.1 * scan, HERE, cast(pedestrian(0.1 * scan), 0.0, 0.0, 0.0))
    assert len(around.movers.moving) == 1
    for scan in range(WALK, WALK + 20):
        around.integrate_scan(0.1 * scan, HERE, cast(EMPTY, 0.0, 0.0, 0.0))
    assert not around.marked.any()
    assert around.movers.moving == ()


def test_somebody_who_comes_nearer_leaves_no_marks_in_the_shadow_behind() -> None:
    around, marks = LocalCostmap(Grid.from_scene(EMPTY)), []
    for scan in range(60):
        x = 4.5 - 0.06 * scan
        here = dataclasses.replace(EMPTY, obstacles=(Cylinder(x, 0.1, 0.25),))
        around.integrate_scan(0.1 * scan, HERE, cast(here, 0.0, 0.0, 0.0))
        grid = around.grid
        columns = grid.origin_x + (np.nonzero(around.marked)[1] + 0.5) * grid.resolution
        marks.append(int((columns > x + 1.0).sum()))
    assert max(marks) == 0


def test_what_stood_there_before_somebody_walked_past_it_stays_in_the_shadow() -> None:
    around = LocalCostmap(Grid.from_scene(EMPTY))
    post = Cylinder(3.0, 0.0, 0.1)
    for scan in range(60):
        person = Cylinder(1.5, -1.5 + 0.05 * max(0, scan - 25), 0.25)  # passes before the post at last
        here = dataclasses.replace(EMPTY, obstacles=(post, person))
        around.integrate_scan(0.1 * scan, HERE, cast(here, 0.0, 0.0, 0.0))
    cell = around.grid.cell(2.92, 0.0)
    assert cell is not None
    assert around.marked[cell]


def test_a_navigator_without_scans_keeps_clear_of_nobody_who_was_seen_long_ago() -> None:
    navigator = Navigator(Grid.from_scene(EMPTY))
    for scan in range(WALK):
        navigator.step(0.1 * scan, HERE, scan=cast(pedestrian(0.1 * scan), 0.0, 0.0, 0.0))
    assert len(navigator.around.movers.moving) == 1
    navigator.step(0.1 * WALK + 60.0, HERE)
    assert navigator.around.movers.moving == ()


def at(movers: Movers, now: float, x: float, y: float, radius: float = 0.2, known: bool = False) -> None:
    """One scan with one disc in it."""
    angle = np.linspace(2.0, 4.3, 12)
    hits = x + radius * np.cos(angle), y + radius * np.sin(angle)
    movers.update(now, *hits, np.full(12, known))


def test_the_speed_is_a_mean_at_first_and_then_a_low_pass_of_the_differences() -> None:
    random, movers, expected = np.random.default_rng(4), Movers(), np.zeros(2)
    places = np.cumsum(random.normal((0.09, 0.05), 0.01, (12, 2)), axis=0)
    for scan, (x, y) in enumerate(places):
        at(movers, 0.1 * scan, float(x), float(y))
        if scan:
            newest = (places[scan] - places[scan - 1]) / 0.1
            expected = expected + max(0.4, 1.0 / scan) * (newest - expected)
    (mover,) = movers.moving
    assert (mover.vx, mover.vy) == pytest.approx(tuple(expected), abs=1e-9)


def test_its_radius_is_the_largest_seen_and_falls_by_two_per_cent_a_scan() -> None:
    movers = Movers()
    for scan in range(8):
        at(movers, 0.1 * scan, 0.08 * scan, 0.0, radius=0.4 if scan == 2 else 0.1)
    angle = np.linspace(2.0, 4.3, 12)
    hits = 0.4 * np.column_stack((np.cos(angle), np.sin(angle)))
    widest = float(np.linalg.norm(hits - hits.mean(axis=0), axis=1).max()) + 0.05
    assert movers.moving[0].radius == pytest.approx(widest * 0.98**5)


def test_it_must_have_gone_a_quarter_of_a_metre_from_where_it_was_seen_first() -> None:
    movers = Movers()
    for scan in range(4):
        at(movers, 0.1 * scan, 0.08 * scan, 0.0)
        assert movers.moving == ()
    at(movers, 0.4, 0.32, 0.0)
    assert [mover.x for mover in movers.moving] == pytest.approx(
        [0.32 + 0.2 * float(np.cos(np.linspace(2.0, 4.3, 12)).mean())]
    )


def test_two_that_pass_each_other_keep_their_own_speeds() -> None:
    movers = Movers()
    for scan in range(15):
        one, other = disc(2.0, -0.7 + 0.1 * scan), disc(2.9, 0.7 - 0.1 * scan)
        hits = (np.concatenate(pair) for pair in zip(one, other, strict=True))
        movers.update(0.1 * scan, *hits, np.zeros(24, dtype=np.bool_))
    assert sorted(mover.vy for mover in movers.moving) == pytest.approx([-1.0, 1.0], abs=0.01)


def test_hits_a_third_of_a_metre_apart_are_two_things_and_two_hits_are_none() -> None:
    movers = Movers()
    for scan in range(6):
        x = np.array((1.0, 1.02, 1.04, 1.39, 1.41, 1.43, 2.5, 2.52)) + 0.1 * scan
        movers.update(0.1 * scan, x, np.zeros(8), np.zeros(8, dtype=np.bool_))
    assert sorted(mover.x for mover in movers.moving) == pytest.approx([1.52, 1.91])
    assert repr(movers) == "Movers(2 moving of 2 things followed)"


def test_what_jumps_farther_than_it_can_have_gone_is_another_thing() -> None:
    movers = followed(12)
    at(movers, 1.2, 3.0, -1.0 + 0.6 * 1.2 + 0.5)
    assert len(movers.moving) == 1, "the old one, not seen in this scan"
    assert movers.moving[0].y < 0.0
    assert repr(movers) == "Movers(1 moving of 2 things followed)"


def test_a_second_scan_of_the_same_instant_changes_nothing() -> None:
    movers = followed(12)
    before = movers.moving
    at(movers, 1.1, 3.05, -0.3)
    assert movers.moving == before


def test_after_a_missed_scan_it_is_looked_for_where_it_should_have_got_to() -> None:
    movers = Movers()
    for scan in (0, 1, 2, 3, 5, 6):
        at(movers, 0.1 * scan, 0.35 * scan, 0.0)
    (mover,) = movers.moving
    assert mover.vx == pytest.approx(3.5)
    assert repr(movers) == "Movers(1 moving of 1 things followed)"


def test_forgetting_starts_anew() -> None:
    movers = followed(12)
    movers.forget()
    assert movers.moving == ()
    at(movers, 1.2, 3.0, -0.28)
    assert movers.moving == ()
