"""Map files: what is written is read back, by us and by a reader made from the format's description alone; what is wrong is told with its line."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from PIL import Image

from robot.nodes.map_files import InvalidMap, Mode, Occupancy, read_map, write_map
from robot.planning.grid import Grid
from robot.scenes.worlds import get_world

SHAPES = st.tuples(st.integers(1, 12), st.integers(1, 12))
TRINARY = arrays(np.int8, SHAPES, elements=st.sampled_from([-1, 0, 100]))
ANY = arrays(np.int8, SHAPES, elements=st.integers(-1, 100))
PLAIN = (
    "image: m.pgm\nresolution: 0.05\norigin: [-1.5, 2.0, 0.0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
)

BOMB = "0.05\na0: &a0 [x, x]\n" + "".join(f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 9)}]\n" for n in range(1, 30))
"""Thirty lines that stand for 10^28 values."""


def by_the_book(file: Path) -> np.ndarray:
    """The cells of a map by the formulas of ROS 2's map_server, pixel by pixel, in single precision; row 0 is the lowest y."""
    said = yaml.safe_load(file.read_text())
    occupied, free = np.float32(said["occupied_thresh"]), np.float32(said["free_thresh"])
    picture = Image.open(file.parent / said["image"])
    width, height = picture.size
    cells = np.zeros((height, width), dtype=int)
    for row in range(height):
        for column in range(width):
            pixel = picture.getpixel((column, height - 1 - row))
            weights = (0.212656, 0.715158, 0.072186)
            x = pixel if isinstance(pixel, int) else round(float(np.dot(pixel[:3], weights)))  # type: ignore[arg-type, index]
            opaque = isinstance(pixel, int) or len(pixel) < 4 or pixel[3] == 255  # type: ignore[arg-type, index]
            shade = np.float32(x) / np.float32(255)
            p = shade if said["negate"] else np.float32(1) - shade
            if said["mode"] == "raw":
                value = round(x) if x <= 100 else -1
            elif not opaque:
                value = -1
            elif p <= free:
                value = 0
            elif p >= occupied:
                value = 100
            elif said["mode"] == "trinary":
                value = -1
            else:
                value = round(100 * (p - free) / (occupied - free))
            cells[row, column] = value
    return cells


def written(folder: Path, picture: bytes, text: str = PLAIN) -> Path:
    (folder / "m.pgm").write_bytes(picture)
    (folder / "m.yaml").write_text(text)
    return folder / "m.yaml"


@given(TRINARY, st.floats(0.01, 1.0), st.floats(-100.0, 100.0), st.sampled_from(["pgm", "png"]))
def test_a_trinary_map_comes_back_as_it_was(
    tmp_path_factory: pytest.TempPathFactory, data: np.ndarray, resolution: float, x: float, image_format: str
) -> None:
    file = write_map(
        Occupancy(data, resolution, x, -x), tmp_path_factory.mktemp("map") / "hall", image_format=image_format
    )
    back = read_map(file)
    assert np.array_equal(back.data, data)
    assert (back.resolution, back.origin_x, back.origin_y) == (resolution, x, -x)
    assert np.array_equal(by_the_book(file), data)


@settings(max_examples=40, deadline=None)
@given(ANY)
def test_a_raw_map_comes_back_value_by_value(tmp_path_factory: pytest.TempPathFactory, data: np.ndarray) -> None:
    file = write_map(Occupancy(data, 0.1), tmp_path_factory.mktemp("map") / "hall", mode="raw")
    assert np.array_equal(read_map(file).data, data)
    assert np.array_equal(by_the_book(file), data)


@settings(max_examples=40, deadline=None)
@given(ANY)
def test_a_scaled_map_with_thresholds_at_the_ends_comes_back_value_by_value(
    tmp_path_factory: pytest.TempPathFactory, data: np.ndarray
) -> None:
    file = write_map(
        Occupancy(data, 0.1), tmp_path_factory.mktemp("map") / "hall", mode="scale", free=0.0, occupied=1.0
    )
    assert np.array_equal(read_map(file).data, data)
    assert np.array_equal(by_the_book(file), data)


@given(
    arrays(np.uint8, SHAPES),
    st.sampled_from(["trinary", "scale", "raw"]),
    st.booleans(),
    st.tuples(st.floats(0.0, 0.5), st.floats(0.51, 1.0)),
)
def test_any_picture_is_read_as_the_formulas_say(
    tmp_path_factory: pytest.TempPathFactory,
    shades: np.ndarray,
    mode: Mode,
    negate: bool,
    thresholds: tuple[float, float],
) -> None:
    folder = tmp_path_factory.mktemp("map")
    height, width = shades.shape
    free, occupied = thresholds
    text = f"image: m.pgm\nmode: {mode}\nresolution: 1.0\norigin: [0, 0, 0]\nnegate: {int(negate)}\noccupied_thresh: {occupied}\nfree_thresh: {free}\n"
    file = written(folder, b"P5\n# a comment\n%d %d\n255\n" % (width, height) + shades.tobytes(), text)
    assert np.abs(read_map(file).data - by_the_book(file)).max() <= (mode == "scale")  # a rounding half at most


def test_the_pictures_upper_row_is_the_farthest_in_y(tmp_path: Path) -> None:
    found = read_map(written(tmp_path, b"P2\n3 2\n255\n0 255 255\n255 255 205 # grey\n"))
    assert found.data.tolist() == [[0, 0, -1], [100, 0, 0]]
    grid = found.grid()
    assert grid.cell(-1.47, 2.08) == (1, 0)
    assert grid.occupied.tolist() == [[False, False, True], [True, False, False]]


def test_a_pgm_with_another_largest_value_and_one_with_two_bytes_a_pixel_are_read(tmp_path: Path) -> None:
    assert read_map(written(tmp_path, b"P5 2 1 1\n\x00\x01")).data.tolist() == [[100, 0]]
    assert read_map(written(tmp_path, b"P5 2 1 65535\n\x00\x00\xff\xff")).data.tolist() == [[100, 0]]


def test_what_nav2s_saver_writes_is_read(tmp_path: Path) -> None:
    text = "image: m.pgm\nmode: trinary\nresolution: 0.05\norigin: [-10, -10, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.25"
    found = read_map(written(tmp_path, b"P5\n3 1\n255\n\x00\xfe\xcd", text))
    assert found.data.tolist() == [[100, 0, 0]]  # its unknown cells read as free by its own threshold


def test_a_shade_at_a_threshold_is_free_or_occupied_as_in_nav2(tmp_path: Path) -> None:
    text = PLAIN.replace("0.65", "0.6").replace("0.196", "0.2")
    found = read_map(written(tmp_path, b"P5 4 1 255\n\x66\x67\xcb\xcc", text))
    assert found.data.tolist() == [[100, -1, -1, 0]]


def test_the_shade_of_a_colour_is_its_luma(tmp_path: Path) -> None:
    Image.fromarray(np.array([[[255, 0, 0], [0, 255, 0], [0, 0, 255]]], dtype=np.uint8)).save(tmp_path / "m.png")
    (tmp_path / "m.yaml").write_text(PLAIN.replace("m.pgm", "m.png"))
    assert read_map(tmp_path / "m.yaml").data.tolist() == [[100, -1, 100]]


def test_what_is_transparent_is_unknown(tmp_path: Path) -> None:
    Image.fromarray(np.array([[[0, 0, 0, 255], [0, 0, 0, 0], [255, 255, 255, 255]]], dtype=np.uint8)).save(
        tmp_path / "m.png"
    )
    text = PLAIN.replace("m.pgm", "m.png")
    (tmp_path / "m.yaml").write_text(text + "mode: scale\n")
    assert read_map(tmp_path / "m.yaml").data.tolist() == [[100, -1, 0]]
    (tmp_path / "m.yaml").write_text(text + "mode: trinary\n")
    assert read_map(tmp_path / "m.yaml").data.tolist() == [[100, -1, 0]]


@pytest.mark.parametrize(
    ("old", "new", "where"),
    [
        ("resolution: 0.05", "resolution: -1", r"m\.yaml:2: resolution: -1 m a cell"),
        ("resolution: 0.05", "resolution: [1]", r"m\.yaml:2: resolution: \[1\] is no number"),
        ("resolution: 0.05\n", "", r"m\.yaml: resolution is missing"),
        ("resolution: 0.05", "resolution: 1e-300", r"m\.yaml:2: resolution: 1e-300 m a cell"),
        ("resolution: 0.05", f"resolution: {'[' * 2000}", r"m\.yaml:2: it is nested more than 100 levels deep"),
        ("resolution: 0.05", f"resolution: {BOMB}", r"m\.yaml:\d+: its aliases stand for too many values"),
        ("[-1.5, 2.0, 0.0]", "[-1.5, 2.0]", r"m\.yaml:3: origin: .* is not \[x, y, yaw\]"),
        ("negate: 0", "negate: 2", r"m\.yaml:4: negate: 2 is neither 0 nor 1"),
        ("occupied_thresh: 0.65", "occupied_thresh: 0.1", r"m\.yaml:5: occupied_thresh: thresholds of 0\.196 and 0\.1"),
        ("free_thresh: 0.196", "free_thresh: .nan", r"m\.yaml:6: free_thresh: nan is no number"),
        ("negate: 0", "negate: 0\nmode: blue", r"m\.yaml:5: mode: 'blue' is no mode; there are: trinary, scale, raw"),
        ("image: m.pgm", "image: 3", r"m\.yaml:1: image: 3 is no text"),
        ("negate: 0", "negate: [0", r"m\.yaml:5: "),
        (PLAIN, "- a list", r"m\.yaml:1: a map file is a list of keys and values"),
        (PLAIN, "\x00", r"m\.yaml:1: the character U\+0000"),
    ],
)
def test_what_is_wrong_in_the_yaml_file_is_told_with_its_line(tmp_path: Path, old: str, new: str, where: str) -> None:
    with pytest.raises(InvalidMap, match=where):
        read_map(written(tmp_path, b"P5 1 1 255\n\x00", PLAIN.replace(old, new)))


@pytest.mark.parametrize(
    ("picture", "where"),
    [
        (b"P5\n2 x\n255\n", r"m\.pgm:2: a PGM's width, height and largest value are numbers, not 'x'"),
        (b"P5\n# only a comment", r"m\.pgm:2: .* not ''"),
        (b"P5 0 1 255\n", "0 x 1 cells with values to 255 cannot be"),
        (b"P5 2 2 255\n\x00\x00\x00", "it promises 2 x 2 cells and holds 3"),
        (b"P2 2 1 255\n7 x", "a PGM in text holds numbers only"),
        (b"no picture at all", r"m\.pgm: no picture"),
        (b"P5 " + b"9" * 5000 + b" 1 255\n", "are numbers, not '999"),
        (b"P2 1 1 255\n" + b"9" * 30, "holds numbers only, to its largest value"),
        (b"P6 9000 9000 255\n", "9000 x 9000 cells are more than 50000000"),
        (b"P6 12000 12000 255\n", "12000 x 12000 cells are more than 50000000"),
        (b"P6 90000 90000 255\n", "could be decompression bomb"),
    ],
)
def test_what_is_wrong_in_the_picture_is_told(tmp_path: Path, picture: bytes, where: str) -> None:
    with pytest.raises(InvalidMap, match=where):
        read_map(written(tmp_path, picture))


def test_a_picture_that_is_not_there_is_the_operating_systems_error(tmp_path: Path) -> None:
    (tmp_path / "m.yaml").write_text(PLAIN)
    with pytest.raises(FileNotFoundError, match=r"m\.pgm"):
        read_map(tmp_path / "m.yaml")


def test_without_pillow_a_png_is_refused_with_the_remedy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "PIL", None)
    with pytest.raises(
        ImportError, match=r"only PGM pictures are read without Pillow: pip install 'robactor\[images\]'"
    ):
        read_map(written(tmp_path, b"\x89PNG"))
    with pytest.raises(ImportError, match="or write a pgm"):
        write_map(Occupancy(np.zeros((1, 1), dtype=np.int8), 1.0), tmp_path / "x", image_format="png")


@pytest.mark.parametrize(
    ("words", "why"),
    [
        ({"occupied": 0.1}, "thresholds of 0.196 and 0.1"),
        ({"image_format": "jpg"}, "pgm or png, not 'jpg'"),
        ({"mode": "scale", "image_format": "pgm"}, "unknown cells are transparent"),
    ],
)
def test_what_cannot_be_written_is_refused(tmp_path: Path, words: dict[str, object], why: str) -> None:
    with pytest.raises(ValueError, match=why):
        write_map(Occupancy(np.zeros((1, 1), dtype=np.int8), 1.0), tmp_path / "x", **words)  # type: ignore[arg-type]


def test_the_map_of_a_world_survives_its_file_cell_by_cell(tmp_path: Path) -> None:
    grid = Grid.from_scene(get_world("warehouse"))
    data = grid.to_occupancy().reshape(grid.height, grid.width)
    back = read_map(write_map(Occupancy(data, grid.resolution, grid.origin_x, grid.origin_y), tmp_path / "w")).grid()
    assert np.array_equal(back.occupied, grid.occupied)
    assert back.bounds == pytest.approx(grid.bounds)


@pytest.mark.parametrize("yaw", [math.pi / 2, -math.pi / 2, math.pi, 0.3, -2.0])
def test_a_map_turned_by_a_yaw_shows_each_wall_where_it_is(tmp_path: Path, yaw: float) -> None:
    """As nav2 has it: the picture's lower left corner is at the origin, and the picture is turned about it."""
    picture = np.full((40, 60), 254, dtype=np.uint8)
    picture[10, 5:50] = picture[25:38, 20] = 0
    Image.fromarray(picture).save(tmp_path / "m.png")
    (tmp_path / "m.yaml").write_text(
        PLAIN.replace("m.pgm", "m.png").replace("[-1.5, 2.0, 0.0]", f"[-1.5, 2.0, {yaw!r}]")
    )
    grid = read_map(tmp_path / "m.yaml").grid()
    c, s = math.cos(yaw), math.sin(yaw)
    for row, column in np.ndindex(40, 60):
        i, j = 0.05 * (column + 0.5), 0.05 * (39 - row + 0.5)
        cell = grid.cell(-1.5 + c * i - s * j, 2.0 + s * i + c * j)
        assert cell is not None
        if picture[row, column] == 0:
            assert grid.occupied[cell]
        elif (
            (picture[max(row - 2, 0) : row + 3, max(column - 2, 0) : column + 3] == 254).all()
            and 2 < row < 37
            and 2 < column < 57
        ):
            assert not grid.occupied[cell]
