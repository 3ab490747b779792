"""What the outline overlaps, against a linear programme that looks for a common point."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import linprog

from robot.geometry.planar import Pose2
from robot.scenes.scene import Box, Cylinder, Scene
from robot.sim.touch import Outline

places = st.floats(-1.5, 1.5)
turns = st.floats(-3.1, 3.1)
boxes = st.builds(Box, places, places, st.floats(0.05, 1.5), st.floats(0.05, 1.5), turns)


def outline(*obstacles: Box | Cylinder) -> Outline:
    return Outline(Scene("some", (-5.0, -5.0, 5.0, 5.0), obstacles, Pose2(0, 0), Pose2(0, 0)))


def sides(x: float, y: float, length: float, width: float, yaw: float) -> tuple[np.ndarray, np.ndarray]:
    """The half planes of a rectangle, a p <= b."""
    ahead, left = np.array((math.cos(yaw), math.sin(yaw))), np.array((-math.sin(yaw), math.cos(yaw)))
    rows = np.array((ahead, -ahead, left, -left))
    return rows, rows @ (x, y) + np.array((length, length, width, width)) / 2


def deepest(pose: tuple[float, float, float], box: Box) -> float:
    """Radius of the largest disc that fits into both rectangles, m; negative when they are apart."""
    body, other = sides(pose[0], pose[1], 1.1, 0.5, pose[2]), sides(box.x, box.y, box.length, box.width, box.yaw)
    rows, right = np.vstack((body[0], other[0])), np.concatenate((body[1], other[1]))
    found = linprog((0.0, 0.0, -1.0), np.column_stack((rows, np.ones(8))), right, bounds=((None, None),) * 3)
    return float(found.x[2])


@given(st.tuples(places, places, turns), boxes)
def test_two_rectangles_touch_when_they_have_a_point_in_common(pose: tuple[float, float, float], box: Box) -> None:
    common = deepest(pose, box)
    if abs(common) > 1e-6:
        assert outline(box).touching(*pose) == (("box_0",) if common > 0.0 else ())


@given(x=places, y=places, yaw=turns, radius=st.floats(0.05, 0.8), pose=st.tuples(places, places, turns))
def test_a_disc_touches_when_its_middle_is_nearer_than_its_radius(
    x: float, y: float, yaw: float, radius: float, pose: tuple[float, float, float]
) -> None:
    c, s = math.cos(pose[2]), math.sin(pose[2])
    ahead, left = c * (x - pose[0]) + s * (y - pose[1]), c * (y - pose[1]) - s * (x - pose[0])
    nearest = min(max(ahead, -0.55), 0.55), min(max(left, -0.25), 0.25)
    gap = math.dist((ahead, left), nearest) - radius
    if abs(gap) > 1e-9:
        assert outline(Cylinder(x, y, radius)).touching(*pose) == (("cylinder_0",) if gap < 0.0 else ())


def test_names_come_in_the_scenes_order_and_an_empty_scene_touches_nothing() -> None:
    crowd = outline(Cylinder(0.0, 0.0, 0.1), Box(0.3, 0.0, 0.1, 0.1), Box(3.0, 0.0, 0.1, 0.1), Cylinder(-0.3, 0.0, 0.1))
    assert crowd.touching(0.0, 0.0, 0.0) == ("cylinder_0", "box_1", "cylinder_3")
    assert outline().touching(0.0, 0.0, 0.0) == ()
