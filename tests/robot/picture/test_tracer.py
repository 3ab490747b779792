"""The geometry of the pictures: a ball is seen where it must be, the nearer hides the farther, shadows fall away from the lamp."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from robot.picture.camera import Camera
from robot.picture.palette import BLACK, WHITE
from robot.picture.solids import Solid, ball, box, capsule, distance, enter, normal, stick
from robot.picture.tracer import FLOOR, NOTHING, Hits, lit, nearest, openness
from tests.robot.picture.kit import rays_through

EYE = np.array((0.0, -4.0, 1.0))
AXES = np.eye(3)
UP = np.array((0.0, 0.0, 1.0), dtype=np.float32)
places = st.tuples(st.floats(-1.5, 1.5), st.floats(-1.0, 2.0), st.floats(0.6, 2.0)).map(np.array)


def eye() -> NDArray[np.float32]:
    return EYE[:, None].astype(np.float32)


def look(solids: list[Solid], targets: NDArray[np.float64]) -> Hits:
    return nearest(solids, eye(), rays_through(targets, EYE))


def floor_at(*points: tuple[float, float]) -> Hits:
    """Hits on the floor at these points, seen from straight above each."""
    origins = np.array([(x, y, 5.0) for x, y in points], dtype=np.float32).T
    origins = np.pad(origins, ((0, 0), (0, -len(points) % 256)), mode="edge")
    rays = np.broadcast_to(-UP[:, None], origins.shape).copy()
    return nearest([], origins, rays)


@pytest.mark.parametrize("place", [(0.0, 0.0, 1.0), (1.2, 0.5, 1.4), (-0.8, 1.0, 0.7)])
def test_a_ball_is_seen_around_the_point_it_projects_to(place: tuple[float, float, float]) -> None:
    camera = Camera(EYE, np.array((0.0, 0.0, 1.0)), 256, 192)
    y, x = (grid.ravel().astype(np.float32) + 0.5 for grid in np.indices((192, 256)))
    hits = nearest([ball(np.array(place), 0.1, WHITE)], eye(), camera.rays(x, y))
    seen = hits.what == 0
    px, py, depth = camera.project(np.array(place))
    assert depth == pytest.approx(4.0 + place[1])
    assert (x[seen].mean(), y[seen].mean()) == pytest.approx((px, py), abs=0.6)
    assert seen.sum() == pytest.approx(np.pi * (0.1 / depth / camera.pixel) ** 2, rel=0.1)


def test_the_image_is_not_mirrored() -> None:
    camera = Camera(EYE, np.array((0.0, 0.0, 1.0)), 200, 100)
    right, above = camera.project(np.array((1.0, 0.0, 1.0))), camera.project(np.array((0.0, 0.0, 1.5)))
    assert right[0] > 100.0
    assert right[1] == pytest.approx(50.0)
    assert above[0] == pytest.approx(100.0)
    assert above[1] < 50.0


@given(place=places, radius=st.floats(0.05, 0.5), seed=st.integers(0, 999))
@settings(max_examples=40, deadline=None)
def test_a_ball_is_met_where_the_quadratic_says(place: NDArray[np.float64], radius: float, seed: int) -> None:
    targets = place + np.random.default_rng(seed).normal(size=(256, 3)) * radius
    rays = rays_through(targets, EYE).astype(np.float64)
    along = (place - EYE) @ rays
    inside = radius**2 - ((place - EYE) ** 2).sum() + along**2
    clear = np.abs(inside) > 1e-3  # rays that do not graze
    expected = np.where(inside > 0.0, along - np.sqrt(np.maximum(inside, 0.0)), np.inf)
    hits = nearest([ball(place, radius, WHITE)], eye(), rays.astype(np.float32))
    assert np.array_equal((hits.what == 0)[clear], (inside > 0.0)[clear])
    met = clear & (inside > 0.0)
    # A ray that nearly grazes turns the smallest error of depth into a long way along it: what counts is the depth.
    points = EYE[:, None] + rays[:, met] * hits.along[met]
    assert np.allclose(np.linalg.norm(points - place[:, None], axis=0), radius, atol=2e-3)
    steep = met & (inside > 0.5 * radius**2)
    assert np.allclose(hits.along[steep], expected[steep], atol=2e-3)


def test_the_nearer_hides_the_farther_whatever_their_order() -> None:
    near = box(np.array((0.0, 0.0, 1.0)), AXES, (0.5, 0.5, 0.5), WHITE)
    far = box(np.array((0.0, 2.0, 1.0)), AXES, (3.0, 0.5, 1.5), BLACK)
    targets = np.array([(x, 0.0, 1.0) for x in np.linspace(-0.9, 0.9, 256)])
    first, second = look([near, far], targets), look([far, near], targets)
    middle = np.abs(targets[:, 0]) < 0.2
    assert (first.what[middle] == 0).all()
    assert (second.what[middle] == 1).all()
    assert (first.what[np.abs(targets[:, 0]) > 0.3] == 1).all()
    assert np.array_equal(first.along, second.along)


def test_below_the_horizon_is_floor_and_above_is_nothing() -> None:
    hits = look([], np.array([(0.0, 0.0, 0.0), (0.0, 0.0, 2.0)]))
    assert (int(hits.what[0]), int(hits.what[1])) == (FLOOR, NOTHING)
    assert hits.points[:, 0] == pytest.approx((0.0, 0.0, 0.0), abs=1e-5)
    assert hits.along[1] == np.inf


def some_solids(rng: np.random.Generator) -> list[Solid]:
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    points = rng.uniform((-1.0, -1.0, 0.3), (1.0, 2.0, 1.6), size=(8, 3))
    return [
        box(points[0], turn, (0.6, 0.3, 0.2), WHITE),
        box(points[1], turn, (0.5, 0.4, 0.3), WHITE, rounding=0.08),
        capsule(points[2], points[3], 0.06, WHITE),
        stick(points[4], points[5], 0.1, WHITE, rounding=0.03),
        stick(points[6], points[6] + (0.0, 0.0, 0.4), 0.15, WHITE),
        ball(points[7], 0.2, WHITE),
    ]


@given(seed=st.integers(0, 9999))
@settings(max_examples=25, deadline=None)
def test_testing_chunks_first_loses_no_hit(seed: int) -> None:
    rng = np.random.default_rng(seed)
    solids = some_solids(rng)
    narrow = rng.uniform((-1.0, 0.0, 0.0), (1.0, 0.0, 2.0), size=(8, 1, 3)) + rng.normal(size=(8, 256, 3)) * 0.05
    rays = rays_through(narrow.reshape(-1, 3), EYE)
    hits = nearest(solids, eye(), rays)
    limit = np.full(rays.shape[1], np.inf, dtype=np.float32)
    each = [enter(solid, solid.local(eye()), solid.turned(rays), limit) for solid in solids]
    floor = np.where(rays[2] < 0.0, -EYE[2] / rays[2], np.inf)
    assert np.allclose(hits.along, np.minimum.reduce([floor, *each]), atol=1e-4)


@given(seed=st.integers(0, 9999))
@settings(max_examples=25, deadline=None)
def test_hits_lie_on_the_surface_and_normals_look_at_the_eye(seed: int) -> None:
    rng = np.random.default_rng(seed)
    solids = some_solids(rng)
    rays = rays_through(rng.uniform((-1.0, 0.0, 0.0), (1.0, 0.0, 2.0), size=(512, 3)), EYE)
    hits = nearest(solids, eye(), rays)
    for index, solid in enumerate(solids):
        mine = hits.what == index
        own = solid.local(hits.points[:, mine])
        normals = normal(solid, own)
        assert np.all(np.abs(distance(solid, own)) < 1e-3)
        assert np.allclose((normals**2).sum(axis=0), 1.0, atol=1e-4)
        assert np.all((normals * rays[:, mine]).sum(axis=0) < 0.02)


def test_a_shadow_is_dark_in_the_middle_soft_at_the_edge_and_gone_beyond() -> None:
    lamp = np.array((0.6, 0.0, 0.8), dtype=np.float32)
    shade = ball(np.array((0.0, 0.0, 0.8)), 0.2, WHITE)  # its shadow's middle lies at x = -0.6, its edge 0.25 further
    xs = np.linspace(-0.6, 0.2, 64)
    seen = lit([shade], floor_at(*((float(x), 0.0) for x in xs)), lamp, 0.05)[:64]
    assert seen[0] == pytest.approx(0.0, abs=1e-3)
    assert seen[-1] == 1.0
    assert np.all(np.diff(seen) >= -1e-3)
    assert seen[int(np.argmin(np.abs(xs + 0.35)))] == pytest.approx(0.5, abs=0.15)


def test_what_lies_beyond_the_lamp_side_casts_no_shadow() -> None:
    lamp = np.array((0.6, 0.0, 0.8), dtype=np.float32)
    beside = box(np.array((-1.0, 0.0, 0.5)), AXES, (0.4, 0.4, 1.0), WHITE)
    assert lit([beside], floor_at((0.0, 0.0)), lamp, 0.05)[0] == 1.0


def test_corners_are_less_open_than_the_middle_of_the_floor() -> None:
    wall = box(np.array((0.0, 1.0, 1.0)), AXES, (4.0, 0.2, 2.0), WHITE)
    board = box(np.array((3.0, 0.0, 0.15)), AXES, (1.0, 1.0, 0.1), WHITE)
    middle, corner, under = openness([wall, board], floor_at((0.0, -2.0), (0.0, 0.88), (3.0, 0.0)))[:3]
    assert middle == 1.0
    assert corner < 0.7
    assert under < 0.7
