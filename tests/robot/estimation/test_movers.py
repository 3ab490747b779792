"""What moves is followed while it is seen, and forgotten soon after: by itself, as part of the surroundings, and by the navigator."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from numpy.typing import NDArray

from robot.control.navigator import Navigator
from robot.estimation.movers import Movers
from robot.estimation.surroundings import Surroundings
from robot.geometry.planar import Pose2
from robot.planning.grid import Grid
from robot.scenes.scene import Cylinder, Scene
from robot.scenes.worlds import get_world
from robot.sim.rays import cast

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
    around = Surroundings(Grid.from_scene(EMPTY))
    for scan in range(WALK):
        around.integrate_scan(0.1 * scan, HERE, cast(pedestrian(0.1 * scan), 0.0, 0.0, 0.0))
    assert len(around.movers.moving) == 1
    for scan in range(WALK, WALK + 20):
        around.integrate_scan(0.1 * scan, HERE, cast(EMPTY, 0.0, 0.0, 0.0))
    assert not around.marked.any()
    assert around.movers.moving == ()


def test_a_navigator_without_scans_keeps_clear_of_nobody_who_was_seen_long_ago() -> None:
    navigator = Navigator(Grid.from_scene(EMPTY))
    for scan in range(WALK):
        navigator.step(0.1 * scan, HERE, scan=cast(pedestrian(0.1 * scan), 0.0, 0.0, 0.0))
    assert len(navigator.around.movers.moving) == 1
    navigator.step(0.1 * WALK + 60.0, HERE)
    assert navigator.around.movers.moving == ()
