"""Coloured objects against Python's own colour conversion, scipy's labels and the pinhole's geometry."""

from __future__ import annotations

import math
from colorsys import rgb_to_hsv

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy import ndimage

from robot.estimation.detect import COLORS, FEWEST, VIVID, find_blobs
from robot.hardware.lens import HEIGHT, WIDTH, project

GREY = 120
RED, BLUE = (200, 20, 20), (20, 20, 220)
HUES = {"red": (0.0, 1.0), "yellow": (1 / 6,), "green": (1 / 3,), "blue": (2 / 3,)}
channel = st.integers(0, 255)


def wall(rows: int = HEIGHT, columns: int = WIDTH, depth: int = 4000) -> tuple[NDArray[np.uint8], NDArray[np.uint16]]:
    """A grey picture, and its depths in mm."""
    return np.full((rows, columns, 3), GREY, dtype=np.uint8), np.full((rows, columns), depth, dtype=np.uint16)


@given(channel, channel, channel)
def test_a_pixel_has_the_color_whose_hue_is_nearest_if_it_is_vivid(red: int, green: int, blue: int) -> None:
    pixels, depths = wall(24, 24)
    pixels[8:14, 6:16] = (red, green, blue)
    found = find_blobs(pixels, depths)
    if max(red, green, blue) - min(red, green, blue) < VIVID:
        assert found == []
        return
    hue = rgb_to_hsv(red / 255, green / 255, blue / 255)[0]
    off = {name: min(abs(hue - known) for known in hues) for name, hues in HUES.items()}
    (blob,) = found
    assert off[blob.color] <= min(off.values()) + 1e-6
    assert (blob.x, blob.y, blob.width, blob.height, blob.pixels) == (6, 8, 10, 6, 60)


@given(st.integers(0, 10_000))
def test_objects_are_the_patches_that_scipy_labels_and_the_largest_come_first(seed: int) -> None:
    random = np.random.default_rng(seed)
    smooth = ndimage.uniform_filter(random.random((60, 80)), 5)
    mask = smooth > np.quantile(smooth, 0.8)
    mask = ndimage.binary_opening(mask, np.ones((4, 4)))  # what is looked for in every second row and column is wider
    pixels, depths = wall(60, 80)
    pixels[mask] = BLUE
    labels, count = ndimage.label(mask, np.ones((3, 3)))
    sizes = ndimage.sum_labels(mask, labels, range(1, count + 1))
    boxes = ndimage.find_objects(labels)
    expected = sorted(
        (int(size), box[1].start, box[0].start, box[1].stop - box[1].start, box[0].stop - box[0].start)
        for size, box in zip(sizes, boxes, strict=True)
        if size >= FEWEST
    )
    found = find_blobs(pixels, depths)
    assert sorted((b.pixels, b.x, b.y, b.width, b.height) for b in found) == expected
    assert [b.pixels for b in found] == sorted((b.pixels for b in found), reverse=True)
    assert {b.color for b in found} <= {"blue"}


@given(x=st.floats(0.5, 4.0), y=st.floats(-0.5, 0.5), z=st.floats(-0.5, 0.5))
def test_an_object_is_where_the_pinhole_put_it(x: float, y: float, z: float) -> None:
    pixels, depths = wall()
    column, row = (round(value) for value in project(x, y * x, z * x))
    patch = slice(row - 6, row + 7), slice(column - 8, column + 9)
    pixels[patch], depths[patch] = RED, round(1000 * x)
    (blob,) = find_blobs(pixels, depths)
    assert blob.position == pytest.approx((x, y * x, z * x), abs=0.002 * x + 1e-3)


def test_depths_of_the_wall_behind_it_do_not_count() -> None:
    pixels, depths = wall()
    pixels[100:120, 200:240], depths[100:120, 200:230] = RED, 1500
    (blob,) = find_blobs(pixels, depths)
    assert blob.position[0] == pytest.approx(1.5)
    assert project(*blob.position) == pytest.approx((214.5, 109.5)), "the middle of what is as near as it"


def test_without_depth_it_is_seen_and_nowhere() -> None:
    pixels, depths = wall(depth=0)
    pixels[100:120, 200:240] = RED
    (blob,) = find_blobs(pixels, depths)
    assert (blob.color, blob.pixels) == ("red", 800)
    assert all(math.isnan(value) for value in blob.position)
    depths[105, 210] = 900
    assert find_blobs(pixels, depths)[0].position[0] == pytest.approx(0.9), "one pixel of depth is enough"


def test_objects_side_by_side_are_two_when_their_colors_differ() -> None:
    pixels, depths = wall()
    pixels[50:60, 50:60], pixels[50:60, 60:64], pixels[200:210, 60:64] = RED, BLUE, BLUE
    found = find_blobs(pixels, depths)
    assert [(blob.color, blob.x, blob.width) for blob in found] == [("red", 50, 10), ("blue", 60, 4), ("blue", 60, 4)]


@pytest.mark.parametrize(("width", "seen"), [(FEWEST - 1, 0), (FEWEST, 1)])
def test_less_than_a_dozen_pixels_are_no_object(width: int, seen: int) -> None:
    pixels, depths = wall()
    pixels[30, 100 : 100 + width] = RED
    assert len(find_blobs(pixels, depths)) == seen


def test_an_object_at_the_edge_of_the_picture_is_whole_and_a_grey_picture_is_empty() -> None:
    pixels, depths = wall()
    assert find_blobs(pixels, depths) == []
    pixels[HEIGHT - 5 :, WIDTH - 7 :] = BLUE
    (blob,) = find_blobs(pixels, depths)
    assert (blob.x, blob.y, blob.width, blob.height) == (WIDTH - 7, HEIGHT - 5, 7, 5)
    assert set(COLORS) == set(HUES)
