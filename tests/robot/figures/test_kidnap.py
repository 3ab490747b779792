"""What `tests.figures kidnap` counts as right, which places it takes to be alike, and how a robot is carried."""

from __future__ import annotations

from math import cos, pi, sin

import numpy as np
import pytest

from robot.geometry.planar import Pose2
from robot.scenes.scene import Box, Scene
from robot.scenes.worlds import get_world
from tests.figures.fidelity import Fidelity
from tests.figures.kidnap import right, show, summary
from tests.figures.kidnap_run import CarriedBody, Ended, Outcome, alike, carry, place


def outcome(ended: Ended, *, others: int = 0, fallen: bool = False, seconds: float | None = None) -> Outcome:
    return Outcome(1, "room", 1.0, 2.0, 0.5, others, ended, seconds, 0.01, "tracking", fallen)


@pytest.mark.parametrize(
    ("one", "expected"),
    [
        (outcome("found"), True),
        (outcome("found", fallen=True), False),
        (outcome("alike"), False),
        (outcome("lost"), False),
        (outcome("wrong"), False),
        (outcome("alike", others=1), True),
        (outcome("found", others=1), False),  # it has guessed
        (outcome("wrong", others=1), False),
    ],
)
def test_to_be_right_is_to_know_the_place_or_to_say_that_nobody_can(one: Outcome, expected: bool) -> None:
    assert right(one) is expected


def test_the_summary_counts_robots_and_the_places_that_no_other_is_like() -> None:
    told = summary(
        [outcome("found", seconds=2.0), outcome("found", seconds=4.0), outcome("alike", others=1), outcome("wrong")]
    )
    assert (told["trials"], told["right"], told["unique"], told["unique_found"]) == (4, 3, 3, 2)
    assert (told["median_seconds"], told["longest_seconds"]) == (4.0, 4.0)
    assert told["ends"] == {"found": 2, "alike": 1, "lost": 0, "wrong": 1}
    circumstances = {
        "seed": 1, "date": "today", "wall_seconds": 1.0, "worlds": ["room"], "sensors": "real", "actuators": "real",
        "machine": {"processor": "one", "cores": 2, "python": "3", "mujoco": "3"},
    }  # fmt: skip
    assert "right within 10 s  3 of 4; known after 4.0 s (median)" in show(told | circumstances)


def test_a_bare_rectangle_looks_the_same_from_both_ends_and_a_pillar_tells_them_apart() -> None:
    walls = (
        *(Box(0.0, y, 8.2, 0.1, height=2.0) for y in (-2.05, 2.05)),
        *(Box(x, 0.0, 0.1, 4.2, height=2.0) for x in (-4.05, 4.05)),
    )
    bare = Scene("bare", (-4.0, -2.0, 4.0, 2.0), walls, Pose2(0.0, 0.0), Pose2(0.0, 0.0))
    assert alike(bare, Pose2(1.3, 0.7, 0.4)) == 1
    pillar = Box(-3.0, 1.0, 0.6, 0.6, height=2.0)
    marked = Scene("marked", bare.bounds, (*walls, pillar), bare.start, bare.dock)
    assert alike(marked, Pose2(1.3, 0.7, 0.4)) == 0
    # The tables of the kitchen are lower than the LiDAR looks.
    assert alike(get_world("kitchen"), Pose2(5.0, 2.0, 0.4)) == 1


@pytest.mark.parametrize("world", ["warehouse", "room"])
def test_a_seed_gives_one_place_with_room_to_stand(world: str) -> None:
    scene, there = place(4, world)
    assert place(4, world) == (scene, there)
    assert place(5, world)[1] != there
    x0, y0, x1, y1 = scene.bounds
    assert x0 + 0.5 < there.x < x1 - 0.5
    assert y0 + 0.5 < there.y < y1 - 0.5


def test_who_is_carried_stands_elsewhere_as_it_stood() -> None:
    pytest.importorskip("mujoco")
    body = CarriedBody(get_world("warehouse"), seed=1)
    body.push((60.0, 20.0, 0.0))
    body.advance(0.1)
    before = body.truth()
    body.carry(Pose2(8.8, 3.4, 2.0))
    after = body.truth()
    assert after.position == pytest.approx([8.8, 3.4, before.position[2]])
    assert after.yaw == pytest.approx(2.0)
    assert after.joints == pytest.approx(before.joints)
    turn = 2.0 - before.yaw
    c, s = cos(turn), sin(turn)
    assert after.velocity == pytest.approx(np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ before.velocity)
    assert after.angular_velocity == pytest.approx(before.angular_velocity)
    assert abs(before.velocity[0]) > 0.1


@pytest.mark.slow(reason="a walk through a warehouse")
def test_a_robot_that_is_carried_through_a_warehouse_knows_where_it_is() -> None:
    pytest.importorskip("mujoco")
    one = carry(3, "warehouse", Fidelity())
    assert one.ended == "found"
    assert one.error < 0.1
    assert one.seconds is not None and 1.0 < one.seconds < 10.0
    assert not one.fallen
    assert abs(one.yaw) <= pi
