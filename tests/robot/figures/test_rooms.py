"""Rooms with things that no map shows: how they are drawn, and one in which the robot fell before it could see."""

from __future__ import annotations

import pytest

from robot.geometry.planar import Pose2
from robot.planning.grid import Grid
from robot.scenes.scene import Box, Obstacle, Pit, Scene
from tests.figures.room_worlds import Room, room
from tests.figures.rooms_run import walk

WALLS = (
    *(Box(3.0, y, 8.0, 0.1, height=2.0) for y in (-2.05, 2.05)),
    *(Box(x, 0.0, 0.1, 4.2, height=2.0) for x in (-1.05, 7.05)),
)


def one_room(*things: Obstacle, pits: tuple[Pit, ...] = ()) -> Room:
    start = Pose2(0.0, 0.0)
    return Room(Scene("one", (-1.0, -2.0, 7.0, 2.0), (*WALLS, *things), start, start, pits=pits), (Pose2(5.5, 0.0),))


def test_a_seed_gives_one_room_and_its_map_shows_the_furniture_alone() -> None:
    first = room(3)
    assert first == room(3)
    assert first != room(4)
    hidden = [one for one in first.scene.obstacles if not one.mapped]
    assert len(hidden) == 12
    assert len(first.scene.pits) == 3
    assert all(0.05 <= one.height <= 2.0 for one in hidden)
    known = Scene(
        "known", first.scene.bounds, tuple(one for one in first.scene.obstacles if one.mapped), *[Pose2(0, 0)] * 2
    )
    assert (Grid.from_scene(first.scene).occupied == Grid.from_scene(known).occupied).all()


@pytest.mark.slow(reason="walks with real sensors")
@pytest.mark.parametrize(
    ("thing", "hole"),
    [(Box(2.5, 0.05, 0.4, 0.5, height=0.3, mapped=False), None), (None, Pit(2.5, 0.05, 0.5, 0.6, 0.3))],
)
def test_a_robot_that_sees_walks_round_what_fells_one_that_does_not(thing: Obstacle | None, hole: Pit | None) -> None:
    pytest.importorskip("mujoco")
    here = one_room(*([thing] if thing else []), pits=(hole,) if hole else ())
    blind = walk(here, seed=1, speed=1.0, sight=False)
    assert blind.falls == 1
    seeing = walk(here, seed=1, speed=1.0)
    assert (seeing.falls, seeing.bumps, seeing.reached) == (0, {}, 1)
    assert seeing.fastest > 0.9
