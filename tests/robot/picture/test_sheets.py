"""Maps, plots, and the sheet they are drawn on; and the PNG file, read back by hand."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robot.picture.axis import spanning
from robot.picture.canvas import Canvas
from robot.picture.strokes import GLYPHS, strokes, width
from robot.png import Image, encode
from tests.robot.picture.kit import decoded

WHITE, BLACK, RED = (255, 255, 255), (0, 0, 0), (255, 0, 0)


def near(image: Image, ink: tuple[int, int, int], off: int = 30) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
    """Which pixels have about this colour."""
    result: np.ndarray[tuple[int, ...], np.dtype[np.bool_]] = np.abs(image.astype(int) - ink).max(axis=2) < off
    return result


@given(st.integers(1, 9), st.integers(1, 9), st.integers(0, 999))
def test_a_png_file_reads_back_as_what_was_written(height: int, wide: int, seed: int) -> None:
    image = np.random.default_rng(seed).integers(0, 256, (height, wide, 3), dtype=np.uint8)
    assert np.array_equal(decoded(encode(image)), image)


def test_what_is_no_image_of_bytes_is_refused() -> None:
    with pytest.raises(ValueError, match="three channels of bytes"):
        encode(np.zeros((2, 2, 4), dtype=np.uint8))


def test_a_rectangle_covers_pixels_in_part() -> None:
    canvas = Canvas(4, 3, WHITE)
    canvas.rectangle(1.0, 0.5, 2.5, 2.0, BLACK)
    assert canvas.image[:, :, 0].tolist() == [[255, 128, 191, 255], [255, 0, 128, 255], [255, 255, 255, 255]]


def test_a_line_is_where_it_should_be_and_a_folded_one_is_not_darker() -> None:
    canvas = Canvas(40, 20, WHITE)
    canvas.line([(5.0, 10.0), (35.0, 10.0), (5.0, 10.0)], BLACK, 4.0, opacity=0.5)
    red = canvas.image[:, :, 0]
    assert (red[9:11, 6:34] == 128).all()
    assert (red[:7] == 255).all()
    assert (red[:, :2] == 255).all()


@given(st.tuples(st.floats(-99, 99), st.floats(-99, 99)), st.tuples(st.floats(-99, 99), st.floats(-99, 99)))
@settings(max_examples=50, deadline=None)
def test_drawing_beyond_the_sheet_is_cut_off(a: tuple[float, float], b: tuple[float, float]) -> None:
    canvas = Canvas(16, 8, WHITE)
    canvas.line([a, b], BLACK)
    canvas.disc(*a, 3.0, BLACK)
    canvas.polygon([a, b, (b[0] + 9.0, a[1])], BLACK)
    canvas.text(*a, "8.5 m/s", BLACK)
    assert canvas.image.shape == (8, 16, 3)


@pytest.mark.parametrize("turned", [False, True])
def test_a_polygon_is_filled_whichever_way_round(turned: bool) -> None:
    points = [(2.0, 2.0), (14.0, 2.0), (14.0, 10.0), (2.0, 10.0)]
    canvas = Canvas(16, 12, WHITE)
    canvas.polygon(points[::-1] if turned else points, RED)
    assert near(canvas.image, RED).sum() == 12 * 8


def test_text_stands_on_its_baseline_and_ends_where_its_width_says() -> None:
    canvas = Canvas(120, 40, WHITE)
    canvas.text(10.0, 30.0, "12.5", BLACK, 12.0)
    rows, columns = np.nonzero(canvas.image[:, :, 0] < 128)
    assert rows.min() == pytest.approx(18, abs=1.5)
    assert rows.max() == pytest.approx(30, abs=1.5)
    assert columns.max() == pytest.approx(10.0 + width("12.5") * 2.0, abs=2)


def test_every_sign_has_a_form_of_its_own() -> None:
    assert len({str(strokes(sign)) for sign in GLYPHS}) == len(GLYPHS)
    assert strokes("LiDAR") == strokes("lidar")
    assert strokes("~") == []


@given(st.floats(-50, 50), st.floats(0.01, 100), st.integers(2, 12))
def test_an_axis_spans_its_values_with_round_numbers(low: float, size: float, ticks: int) -> None:
    axis = spanning(low, low + size, 0.0, 100.0, ticks)
    assert axis.low <= low + 1e-6
    assert axis.high >= low + size - 1e-6
    marks = axis.ticks()
    assert 2 <= len(marks) <= ticks + 3
    assert float(marks[0][1]) == pytest.approx(axis.low, abs=1e-9)
    assert marks[0][0] == pytest.approx(0.0, abs=1e-6)
    assert marks[-1][0] == pytest.approx(100.0, abs=1e-6)


def test_an_axis_of_one_value_is_still_an_axis() -> None:
    axis = spanning(0.0, 0.0, 0.0, 100.0, 4)
    assert axis.pixel(0.0) == 0.0
    assert len(axis.ticks()) >= 2
