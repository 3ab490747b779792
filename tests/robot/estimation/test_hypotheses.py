"""Places that one scan cannot tell from each other, weighed by the next ones."""

from __future__ import annotations

from math import pi

from robot.estimation.hypotheses import PoseHypotheses
from robot.estimation.relocalize import Relocalizer, apart
from robot.geometry.planar import Pose2, compose
from robot.planning.grid import Grid
from robot.scenes.scene import Box, Scene
from robot.sim.kinematic import KinematicBody

WALLS = (
    *(Box(0.0, y, 12.2, 0.1, height=2.0) for y in (-2.05, 2.05)),
    *(Box(x, 0.0, 0.1, 4.2, height=2.0) for x in (-6.05, 6.05)),
)
BARE = Scene("bare", (-6.0, -2.0, 6.0, 2.0), WALLS, Pose2(0.0, 0.0), Pose2(0.0, 0.0))
MARKED = Scene("marked", BARE.bounds, (*WALLS, Box(5.8, 1.8, 0.4, 0.4, height=2.0)), BARE.start, BARE.dock)
"""A little pillar in one corner."""
HERE, THERE = Pose2(-3.0, 0.5, 0.1), Pose2(3.0, -0.5, 0.1 - pi)
"""The same by half a turn."""


def weighed(scene: Scene, way: list[Pose2], places: tuple[Pose2, ...] = (THERE, HERE)) -> PoseHypotheses:
    """PoseHypotheses that were shown a scan from each step of a way that begins at `HERE`; odometry has each as it is."""
    body = KinematicBody(scene, seed=3)
    rivals = PoseHypotheses(Relocalizer(Grid.from_scene(scene)), places, way[0])
    for moved in way:
        body.place(compose(HERE, moved))
        body.advance(body.time + 0.1)
        list(rivals.weighing(body.lidar(), moved))
    return rivals


STANDING = [Pose2(0.0, 0.0)] * 40


def test_halves_of_a_bare_rectangle_stay_alike_however_long_one_looks() -> None:
    rivals = weighed(BARE, STANDING)
    assert rivals.offset() is None
    assert rivals.best > 0.9
    assert len(rivals) == 2


def test_a_little_pillar_is_seen_when_one_walks_up_to_it() -> None:
    assert weighed(MARKED, STANDING).offset() is None
    offset = weighed(MARKED, [Pose2(0.1 * step, 0.0) for step in range(80)]).offset()
    assert offset is not None
    assert not apart(offset, HERE)


def test_no_single_scan_decides() -> None:
    rivals = weighed(MARKED, STANDING[:9], places=(Pose2(0.0, 1.0, 1.5), HERE))
    assert rivals.offset() is None
    assert weighed(MARKED, STANDING[:10], places=(Pose2(0.0, 1.0, 1.5), HERE)).offset() is not None
