"""Where columns of the picture meet shapes, against exact distances along each column's ray."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robot.hardware.lens import WIDTH, column_slopes
from robot.planning.grid import signed_distance
from robot.scenes.scene import Box, Cylinder
from robot.sim.camera_columns import NEAREST, Eye, Prisms, columns_of

eyes = st.builds(Eye, st.floats(-3, 3), st.floats(-3, 3), st.just(0.5), st.floats(-3.1, 3.1))
boxes = st.builds(Box, st.floats(-3, 3), st.floats(-3, 3), st.floats(0.1, 1.5), st.floats(0.1, 1.5), st.floats(-3, 3))
shapes = st.one_of(boxes, st.builds(Cylinder, st.floats(-3, 3), st.floats(-3, 3), st.floats(0.05, 0.8)))
COLUMNS = np.arange(0, WIDTH, 40)


def places(eye: Eye, depth: np.ndarray, columns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The points so many metres ahead in these columns."""
    aside = column_slopes()[columns] * depth
    c, s = math.cos(eye.yaw), math.sin(eye.yaw)
    return eye.x + c * depth - s * aside, eye.y + s * depth + c * aside


@settings(deadline=None, max_examples=25)
@given(eyes, shapes)
def test_a_column_enters_and_leaves_a_shape_on_its_outline_and_is_inside_between(
    eye: Eye, shape: Box | Cylinder
) -> None:
    hits = Prisms((shape,)).seen_from(eye, 20.0)
    if not len(hits.which):
        enter = np.full(WIDTH, np.inf)
    else:
        enter, leave = hits.enter[0], hits.leave[0]
        met = COLUMNS[np.isfinite(enter[COLUMNS])]
        for depth in (enter[met], leave[met]):
            off = signed_distance(shape, *places(eye, depth, met))
            assert np.abs(off[depth > NEAREST]).max(initial=0.0) < 1e-6
        middle = signed_distance(shape, *places(eye, (enter[met] + leave[met]) / 2, met))
        assert (middle <= 1e-9).all()
    marched = np.linspace(NEAREST, 9.0, 300)
    for column in COLUMNS[np.isinf(enter[COLUMNS])]:
        x, y = places(eye, marched, np.full(300, column))
        assert signed_distance(shape, x, y).min() > -0.05, "a ray that misses is nowhere inside"


@settings(deadline=None, max_examples=25)
@given(eyes, shapes)
def test_facing_is_the_cosine_between_the_ray_and_the_sides_normal(eye: Eye, shape: Box | Cylinder) -> None:
    """The normal is the gradient of the exact distance, by differences."""
    hits = Prisms((shape,)).seen_from(eye, 20.0)
    if not len(hits.which):
        return
    met = COLUMNS[np.isfinite(hits.enter[0][COLUMNS]) & (hits.enter[0][COLUMNS] > 2 * NEAREST)]
    x, y = places(eye, hits.enter[0][met] - 1e-4, met)
    step = 1e-5
    right, left = (signed_distance(shape, x + side * step, y) for side in (1, -1))
    above, below = (signed_distance(shape, x, y + side * step) for side in (1, -1))
    normal = np.array([right - left, above - below]) / (2 * step)
    ray = np.array([x - eye.x, y - eye.y])
    cosine = np.abs((normal * ray).sum(axis=0)) / np.hypot(*ray)
    flat = np.hypot(*normal) > 0.999  # not at an edge, where there is no one normal
    if isinstance(shape, Box):
        turned = np.abs(
            normal.T @ [(math.cos(shape.yaw), -math.sin(shape.yaw)), (math.sin(shape.yaw), math.cos(shape.yaw))]
        )
        flat &= (turned.max(axis=1) > 0.99999) & (cosine > 0.05)
    assert hits.facing[0][met][flat] == pytest.approx(cosine[flat], abs=0.02)


@settings(deadline=None, max_examples=25)
@given(eyes, shapes)
def test_no_column_outside_of_the_part_that_is_looked_at_meets_the_shape(eye: Eye, shape: Box | Cylinder) -> None:
    part = columns_of(shape, eye, 10.0)
    hits = Prisms((shape,)).seen_from(eye, 10.0)
    met = np.flatnonzero(np.isfinite(hits.enter[0])) if len(hits.which) else np.array([], dtype=int)
    if part is None:
        assert not len(met)
        return
    assert ((met >= part.start) & (met < part.stop)).all()
    again = Prisms((shape,)).seen_from(eye, 10.0, part)
    if len(again.which):
        np.testing.assert_array_equal(again.enter[0], hits.enter[0][part])


def test_shapes_keep_their_places_in_the_list_and_those_out_of_view_are_left_out() -> None:
    behind, near, beside, far = Box(-3, 0, 1, 1), Cylinder(2, 0.2, 0.3), Box(1, -5, 1, 1), Box(4, 0, 1, 1, 0.3)
    hits = Prisms((behind, near, beside, far)).seen_from(Eye(0.0, 0.0, 0.5, 0.0), 10.0)
    assert sorted(hits.which.tolist()) == [1, 3]
    middle = {int(which): float(enter[WIDTH // 2]) for which, enter in zip(hits.which, hits.enter, strict=True)}
    assert middle[1] == pytest.approx(2.0 - math.sqrt(0.09 - 0.04), abs=2e-3)
    assert middle[3] > 3.3
    assert Prisms(()).seen_from(Eye(0.0, 0.0, 0.5, 0.0), 10.0).enter.shape == (0, WIDTH)


def test_within_a_shape_it_is_seen_from_the_nearest_depth_on() -> None:
    hits = Prisms((Cylinder(0.1, 0.0, 0.5),)).seen_from(Eye(0.0, 0.0, 0.5, 0.0), 10.0)
    assert hits.enter[0][WIDTH // 2] == NEAREST
    assert hits.leave[0][WIDTH // 2] == pytest.approx(0.6, abs=1e-3)
