"""The camera's pictures against a ray for every pixel that is asked about: slow, simple, and right."""

from __future__ import annotations

from math import cos, hypot, inf, pi, sin, sqrt

import numpy as np
import pytest

from robot.estimation.detect import find_blobs
from robot.hardware.devices import Frame
from robot.hardware.lens import CX, CY, FOCAL, HEIGHT, WIDTH, deproject, project
from robot.scenes.scene import Box, Cylinder, Obstacle, Thing
from robot.scenes.worlds import get_world
from robot.sim.camera_columns import Eye
from robot.sim.camera_view import RANGE, View
from tests.robot.stage import floor

RED, BLUE = (210, 30, 30), (30, 40, 200)


def slab(position: float, slope: float, half: float) -> tuple[float, float]:
    if slope == 0.0:
        return (-inf, inf) if abs(position) <= half else (inf, -inf)
    a, b = (-half - position) / slope, (half - position) / slope
    return min(a, b), max(a, b)


def ray_depth(column: int, row: int, eye: Eye, shapes: list[tuple[Obstacle, float]]) -> float:
    """Depth of what one pixel sees: the nearest of the floor and of upright shapes, given with the height of their undersides."""
    across, up = (CX - column) / FOCAL, (CY - row) / FOCAL
    dx, dy = cos(eye.yaw) - sin(eye.yaw) * across, sin(eye.yaw) + cos(eye.yaw) * across
    nearest = -eye.z / up if up < 0.0 else inf
    for shape, z in shapes:
        level = slab(eye.z - z - shape.height / 2, up, shape.height / 2)
        if isinstance(shape, Box):
            c, s = cos(shape.yaw), sin(shape.yaw)
            x, y = eye.x - shape.x, eye.y - shape.y
            spans = [
                slab(c * x + s * y, c * dx + s * dy, shape.length / 2),
                slab(c * y - s * x, c * dy - s * dx, shape.width / 2),
            ]
        else:
            x, y = eye.x - shape.x, eye.y - shape.y
            a, b, c = dx * dx + dy * dy, x * dx + y * dy, x * x + y * y - shape.radius**2
            under = b * b - a * c
            spans = [((-b - sqrt(under)) / a, (-b + sqrt(under)) / a) if under > 0.0 else (inf, -inf)]
        enter, leave = max(level[0], *(one[0] for one in spans)), min(level[1], *(one[1] for one in spans))
        if enter < leave and leave > 0.05:
            nearest = min(nearest, max(enter, 0.05))
    return nearest


def assert_depths(frame: Frame, eye: Eye, shapes: list[tuple[Obstacle, float]], pixels: int = 1500) -> None:
    """All but the pixels that an edge runs through."""
    random = np.random.default_rng(1)
    depths = frame.millimetres()
    wrong = []
    for column, row in zip(
        random.integers(0, WIDTH, pixels).tolist(), random.integers(0, HEIGHT, pixels).tolist(), strict=True
    ):
        true = ray_depth(column, row, eye, shapes)
        expected = round(1000.0 * true) if true <= RANGE else 0
        if abs(int(depths[row, column]) - expected) > 1:
            around = {ray_depth(column + i, row + j, eye, shapes) for i in (-1, 0, 1) for j in (-1, 0, 1)}
            at_an_edge = max(around) - min(around) > 0.02 * min(around)
            wrong.append((column, row, int(depths[row, column]), expected, at_an_edge))
    assert [one for one in wrong if not one[-1]] == []
    assert len(wrong) <= 0.01 * pixels


@pytest.mark.parametrize("world", ["warehouse", "pillars", "corridor", "empty"])
@pytest.mark.parametrize("yaw", [0.0, 1.0, -2.3])
def test_depths_are_those_of_rays(world: str, yaw: float) -> None:
    hall = get_world(world)
    eye = Eye(hall.start.x + 0.1, hall.start.y + 0.2, 0.536, yaw)
    assert_depths(View(hall).look(eye), eye, [(one, 0.0) for one in hall.obstacles])


@pytest.mark.parametrize("world", ["warehouse", "corridor"])
def test_a_pixel_has_another_color_than_the_empty_hall_where_an_obstacle_is_and_only_there(world: str) -> None:
    hall = get_world(world)
    eye = Eye(hall.start.x + 0.1, hall.start.y + 0.2, 0.536, 1.0)
    picture, empty = (View(scene).look(eye).rgb.reshape(HEIGHT, WIDTH, 3) for scene in (hall, floor()))
    painted = (picture != empty).any(axis=2)
    obstacles = [(one, 0.0) for one in hall.obstacles]
    random = np.random.default_rng(1)
    wrong = 0
    for column, row in zip(
        random.integers(0, WIDTH, 1000).tolist(), random.integers(0, HEIGHT, 1000).tolist(), strict=True
    ):
        met = ray_depth(column, row, eye, obstacles) < ray_depth(column, row, eye, [])
        wrong += bool(painted[row, column]) != met
    assert wrong <= 10  # pixels that an edge runs through


@pytest.mark.parametrize("height", [0.24, 0.536, 0.9])
def test_low_obstacles_show_their_tops_and_things_hide_each_other(height: float) -> None:
    obstacles = (
        Box(2.0, 0.3, 0.6, 0.4, yaw=0.4, height=0.3), Cylinder(3.5, -0.8, 0.3, height=0.5), Box(5.0, 0.0, 0.4, 4.0, height=1.2),
        Box(2.4, -0.2, 0.3, 0.3, height=0.8),
    )  # fmt: skip
    things = (
        Thing("cup", Cylinder(2.0, 0.3, 0.04, height=0.1), RED, z=0.3),
        Thing("book", Box(1.5, -0.3, 0.2, 0.1, yaw=1.0, height=0.05), BLUE),
        Thing("lamp", Box(3.0, 0.5, 0.2, 0.2, height=0.1), RED, z=1.1),
        Thing("hidden", Cylinder(5.6, 0.0, 0.1, height=0.2), BLUE),
    )
    eye = Eye(0.0, 0.0, height, 0.05)
    frame = View(floor(*obstacles)).look(eye, things)
    assert_depths(frame, eye, [(one, 0.0) for one in obstacles] + [(one.shape, one.z) for one in things], 3000)


def test_a_camera_in_the_middle_of_a_thing_or_close_to_a_wall_still_sees() -> None:
    view = View(floor(Box(1.0, 0.0, 0.2, 4.0, height=2.0)))
    close = view.look(Eye(0.86, 0.0, 0.5, 0.0)).millimetres()
    assert close.max() == 50
    inside = view.look(Eye(0.0, 0.0, 0.5, 0.0), (Thing("fog", Box(0.0, 0.0, 1.0, 1.0, height=1.0), RED),))
    assert inside.millimetres().shape == (HEIGHT, WIDTH)


def test_frames_are_read_only_and_a_frame_does_not_change_when_the_next_is_made() -> None:
    view = View(get_world("warehouse"))
    first = view.look(Eye(0.0, 0.0, 0.5, 0.0))
    copy = (first.rgb.copy(), first.depth.copy())
    view.look(Eye(4.0, 0.5, 0.5, 2.0))
    assert (first.rgb == copy[0]).all() and (first.depth == copy[1]).all()
    for array in (first.rgb, first.depth, first.pixels(), first.millimetres()):
        assert not array.flags.writeable
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0


def test_pixels_and_points_are_each_others_inverse() -> None:
    column, row = project(*deproject(123.0, 321.0, 4.5))
    assert (column, row) == pytest.approx((123.0, 321.0))
    with pytest.raises(ValueError, match="not in front of the camera"):
        project(-1.0, 0.0, 0.0)


@pytest.mark.parametrize("x", [1.0, 1.7, 2.6, 4.1])
@pytest.mark.parametrize("angle", [-0.4, 0.0, 0.3])
def test_an_object_is_found_where_it_is_drawn(x: float, angle: float) -> None:
    """Its box within 2 px of its projected corners, its middle within 2 cm of its visible surface."""
    y, side, z = x * angle, 0.12, 0.4
    cube = Thing("cube", Box(x, y, side, side, height=side), RED, z=z)
    eye = Eye(0.0, 0.0, 0.536, 0.0)
    frame = View(get_world("empty")).look(eye, (cube,))
    (blob,) = find_blobs(frame.pixels(), frame.millimetres())
    corners = [
        project(x + i * side / 2, y + j * side / 2, z + k * side - eye.z)
        for i in (-1, 1)
        for j in (-1, 1)
        for k in (0, 1)
    ]
    columns, rows = zip(*corners, strict=True)
    assert blob.color == "red"
    assert abs(blob.x - min(columns)) <= 2 and abs(blob.x + blob.width - 1 - max(columns)) <= 2
    assert abs(blob.y - min(rows)) <= 2 and abs(blob.y + blob.height - 1 - max(rows)) <= 2
    px, py, pz = blob.position
    away = hypot(px - x, py - y, pz - (z + side / 2 - eye.z))
    assert away < side * 0.75
    assert x - side < px < x


def test_colors_are_told_apart_and_specks_and_walls_are_not_objects() -> None:
    colors = {"red": (220, 20, 30), "yellow": (230, 210, 30), "green": (40, 180, 60), "blue": (20, 60, 220)}
    image = np.full((HEIGHT, WIDTH, 3), (198, 186, 168), dtype=np.uint8)
    for place, color in enumerate(colors.values()):
        image[100 + 3 * place : 150, 50 + 100 * place : 90 + 100 * place] = color
    image[300, 300:305] = (255, 0, 0)
    found = {blob.color: blob for blob in find_blobs(image, np.zeros((HEIGHT, WIDTH), np.uint16))}
    assert set(found) == set(colors)
    blue = found["blue"]
    assert (blue.x, blue.y, blue.width, blue.height, blue.pixels) == (350, 109, 40, 41, 1640)
    assert np.isnan(blue.position).all()


def test_what_stands_behind_an_object_does_not_move_it() -> None:
    """A ring: through its hole the wall is seen."""
    image, depth = np.zeros((HEIGHT, WIDTH, 3), np.uint8), np.full((HEIGHT, WIDTH), 6000, np.uint16)
    rows, columns = np.mgrid[:HEIGHT, :WIDTH]
    disc = np.hypot(rows - 240, columns - 200) < 30
    image[disc] = (200, 0, 0)
    depth[disc] = 2000
    depth[disc & (rows < 216)] = 6000  # colour runs over its edge by a few rows
    (blob,) = find_blobs(image, depth)
    assert blob.position[0] == pytest.approx(2.0)


def test_the_lens_looks_seventy_degrees_wide() -> None:
    assert 2.0 * np.arctan(WIDTH / 2 / FOCAL) == pytest.approx(70.0 * pi / 180.0)
