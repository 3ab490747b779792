"""Maps as files, in the formats of nav2's map_server: a YAML file that tells how large a cell is and how to read the picture that it names.

Pictures are PGM (P5 and P2), and with Pillow whatever that opens, such as PNG. The picture's upper row is the map's farthest in y.
"""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any, Literal, TypeAlias, cast, get_args
from warnings import catch_warnings, simplefilter

import numpy as np
from numpy.typing import NDArray

from actors.yaml_bounds import load_yaml, safe_loader
from robot.geometry.planar import turned, turned_back
from robot.geometry.vectors import Floats
from robot.planning.grid import FREE, OCCUPIED, UNKNOWN, Grid

Mode: TypeAlias = Literal["trinary", "scale", "raw"]
"""How the shades of a picture are meant: as free, occupied or unknown; as a probability between; or as the cells' values themselves."""

OCCUPIED_ABOVE = 0.65
"""Occupancy above which a cell is occupied: the default of nav2's map_saver_cli."""
FREE_BELOW = 0.196
"""Occupancy below which a cell is free. nav2's map_saver_cli writes 0.25, by which the shade of its own unknown cells reads as free."""

MOST_CELLS = 50_000_000
"""Of a picture that Pillow decodes, which takes 32 bytes for each meanwhile: half a kilometre by half a kilometre at 7 cm."""
DIGITS = 9
"""Of a number in a greymap."""
SMALLEST, LARGEST = 1e-3, 100.0
"""Sides of a cell that a map can have, m."""
_WITHIN = 0.35
"""How far from a cell's middle a map that is turned is looked at, cells: nothing as wide as a cell is missed."""
_ROUNDING = 1e-9
_UNSURE = 99
"""The rank of an unknown place among places of 2 v, v being their per cent: worse than one of 49 %, better than one of 50 %."""

LUMA = np.array([0.212656, 0.715158, 0.072186])
"""What red, green and blue count in the shade of a picture, by ITU-R BT.709."""

_WHITE, _GREY, _BLACK = 254, 205, 0
"""Shades of free, unknown and occupied cells that map_server's savers have always written."""


class InvalidMap(ValueError):
    """A map file that cannot be read; the message begins with the file, and the line where there is one."""


@dataclass(frozen=True, eq=False)
class Occupancy:
    """A map as nav_msgs/OccupancyGrid has it: per cent occupied, -1 for unknown; row 0 is the lowest y."""

    data: NDArray[np.int8]
    """Shape (height, width)."""
    resolution: float
    """Side of a cell, m."""
    origin_x: float = 0.0
    """Of the outer corner of cell (0, 0), m."""
    origin_y: float = 0.0

    def grid(self) -> Grid:
        """The map for planning: unknown cells count as obstacles, as do those of 65 % and more."""
        height, width = self.data.shape
        return Grid.from_occupancy(self.data, width, height, self.resolution, self.origin_x, self.origin_y)


@dataclass(frozen=True, slots=True)
class _Picture:
    shade: Floats
    """0 (black) to 1 (white), row 0 on top; of colours their luma."""
    alpha: Floats | None
    """0 (transparent) to 1, if it has that."""


# --- reading --------------------------------------------------------------------------------------------------------


def read_map(path: str | os.PathLike[str]) -> Occupancy:
    """The map of a YAML file. Raises `InvalidMap`, `OSError`, and `ImportError` for a picture that needs Pillow."""
    file = Path(path)
    said = _Said(file)
    mode = said.text("mode", "trinary")
    if mode not in get_args(Mode):
        raise said.wrong("mode", f"{mode!r} is no mode; there are: {', '.join(get_args(Mode))}")
    resolution = said.number("resolution")
    if not SMALLEST <= resolution <= LARGEST:
        raise said.wrong("resolution", f"{resolution:g} m a cell: give a number from {SMALLEST:g} to {LARGEST:g}")
    x, y, yaw = said.origin()
    occupied, free = said.number("occupied_thresh"), said.number("free_thresh")
    if not 0.0 <= free <= occupied <= 1.0:
        raise said.wrong(
            "occupied_thresh", f"thresholds of {free:g} and {occupied:g}: give 0 <= free_thresh <= occupied_thresh <= 1"
        )
    picture = _read_picture(file.parent / Path(said.text("image")).expanduser())
    data = _cells(picture, mode, said.negate(), occupied, free)
    return _turned(np.ascontiguousarray(data[::-1]), resolution, x, y, yaw)


def _turned(data: NDArray[np.int8], resolution: float, x: float, y: float, yaw: float) -> Occupancy:
    """The map whose rows run along its own x axis, turned by `yaw` (rad) about its corner, in cells whose rows run along x.

    A cell is what the worst of nine places in it is; what lies outside of the picture is unknown.
    """
    if yaw == 0.0:
        return Occupancy(data, resolution, x, y)
    height, width = data.shape
    corners = [turned(yaw, right, up) for right in (0, width) for up in (0, height)]
    low = [math.floor(min(axis) + _ROUNDING) for axis in zip(*corners, strict=True)]
    columns, rows = (
        math.ceil(max(axis) - _ROUNDING) - least for axis, least in zip(zip(*corners, strict=True), low, strict=True)
    )
    ranks = np.where(data == UNKNOWN, _UNSURE, 2 * data.astype(np.int16))
    filled = np.zeros((rows, columns), dtype=np.int16)
    for right in (-_WITHIN, 0.0, _WITHIN):
        for up in (-_WITHIN, 0.0, _WITHIN):
            i = np.arange(float(columns)) + (low[0] + 0.5 + right)
            j = np.arange(float(rows))[:, None] + (low[1] + 0.5 + up)
            column, row = (np.floor(part).astype(np.intp) for part in turned_back(yaw, i, j))
            inside = (column >= 0) & (column < width) & (row >= 0) & (row < height)
            found = ranks[np.clip(row, 0, height - 1), np.clip(column, 0, width - 1)]
            np.maximum(filled, np.where(inside, found, _UNSURE), out=filled)
    cells = np.where(filled == _UNSURE, UNKNOWN, filled // 2).astype(np.int8)
    return Occupancy(cells, resolution, x + low[0] * resolution, y + low[1] * resolution)


def _cells(picture: _Picture, mode: str, negate: bool, occupied: float, free: float) -> NDArray[np.int8]:
    """The values of the cells, row 0 on top, as map_server of ROS 2 Lyrical has them: it computes in single precision."""
    shade = picture.shade.astype(np.float32)
    if mode == "raw":
        value = np.round(shade * 255)
        return np.where(value <= OCCUPIED, value, UNKNOWN).astype(np.int8)
    taken = shade if negate else np.float32(1.0) - shade
    low, high = np.float32(free), np.float32(occupied)
    between = np.full(taken.shape, float(UNKNOWN))
    if mode == "scale" and high > low:
        between = np.floor(np.float32(100) * ((taken - low) / (high - low)) + np.float32(0.5))
    cells = np.where(taken <= low, FREE, np.where(taken >= high, OCCUPIED, between))
    if picture.alpha is not None:
        cells = np.where(picture.alpha < 1.0, UNKNOWN, cells)
    return cells.astype(np.int8)


class _Said:
    """What a YAML file says, with the lines where it does."""

    def __init__(self, file: Path) -> None:
        yaml: Any = import_module("yaml")  # it has no types
        self._file = file
        self._lines: dict[str, int] = {}
        try:
            text = file.read_text(encoding="utf-8")
            values, root = load_yaml(text), yaml.compose(text, Loader=safe_loader())
        except yaml.MarkedYAMLError as error:
            line = error.problem_mark.line + 1 if error.problem_mark is not None else 1
            raise InvalidMap(f"{file}:{line}: {error.problem}") from None
        except UnicodeDecodeError as error:
            raise InvalidMap(f"{file}: {error}") from None
        if not isinstance(values, dict) or not isinstance(root, yaml.MappingNode):
            raise InvalidMap(f"{file}:1: a map file is a list of keys and values, such as resolution: 0.05")
        self._values: dict[Any, Any] = values
        for key, _ in root.value:
            self._lines[str(key.value)] = key.start_mark.line + 1

    def wrong(self, key: str, what: str) -> InvalidMap:
        return InvalidMap(f"{self._file}:{self._lines.get(key, 1)}: {key}: {what}")

    def text(self, key: str, default: str | None = None) -> str:
        value = self._value(key, default)
        if not isinstance(value, str) or not value:
            raise self.wrong(key, f"{value!r} is no text")
        return value

    def number(self, key: str) -> float:
        return self._finite(key, self._value(key))

    def negate(self) -> bool:
        """A flag, which older files write as 0 or 1."""
        value = self._value("negate")
        if value not in (0, 1):  # False and True are these, too
            raise self.wrong("negate", f"{value!r} is neither 0 nor 1")
        return bool(value)

    def origin(self) -> tuple[float, float, float]:
        """x and y of the lower left corner, and the yaw of the map about it."""
        value = self._value("origin")
        parts = cast("list[object]", value if isinstance(value, list) else [])
        if len(parts) != 3:
            raise self.wrong("origin", f"{value!r} is not [x, y, yaw]")
        x, y, yaw = (self._finite("origin", one) for one in parts)
        return x, y, yaw

    def _value(self, key: str, default: str | None = None) -> Any:
        value = self._values.get(key, default)
        if value is None:
            raise InvalidMap(f"{self._file}: {key} is missing")
        return value

    def _finite(self, key: str, value: Any) -> float:
        """Also of text such as 1e-5, which is no number in YAML 1.1 but is in the C++ reader's."""
        try:
            number = math.nan if isinstance(value, bool | list | dict) else float(value)
        except ValueError:
            number = math.nan
        if not math.isfinite(number):
            raise self.wrong(key, f"{value!r} is no number")
        return number


def _read_picture(path: Path) -> _Picture:
    """Raises `InvalidMap` for what is no picture, `ImportError` for one that needs Pillow, `OSError`."""
    data = path.read_bytes()
    if data[:2] in (b"P5", b"P2"):
        return _Picture(_read_pgm(path, data), None)
    try:
        from PIL import Image, UnidentifiedImageError
    except ImportError as error:
        raise ImportError(
            f"{path}: only PGM pictures are read without Pillow: pip install 'robactor[images]'"
        ) from error
    try:
        with catch_warnings():
            simplefilter("ignore", Image.DecompressionBombWarning)  # there is an error for it, below
            image = Image.open(path)
        with image as opened:
            if opened.width * opened.height > MOST_CELLS:  # before they are decoded
                raise InvalidMap(f"{path}: {opened.width} x {opened.height} cells are more than {MOST_CELLS}")
            has_alpha = "A" in opened.getbands() or "transparency" in opened.info
            channels = np.asarray(opened.convert("RGBA"), dtype=np.float64) / 255
    except InvalidMap:
        raise
    except (UnidentifiedImageError, SyntaxError, ValueError, OSError, Image.DecompressionBombError) as error:
        raise InvalidMap(f"{path}: no picture: {error}") from None
    grey = np.rint(channels[..., :3] @ LUMA * 255) / 255
    return _Picture(grey, channels[..., 3] if has_alpha else None)


def _read_pgm(path: Path, data: bytes) -> Floats:
    """The shades of a portable greymap, in bytes or in text."""
    at, header = 2, list[int]()
    while len(header) < 3:
        word, at = _word(data, at)
        if not word.isdigit() or len(word) > DIGITS:
            line = data.count(b"\n", 0, at) + 1
            raise InvalidMap(
                f"{path}:{line}: a PGM's width, height and largest value are numbers, not {word.decode('latin-1')!r:.60}"
            )
        header.append(int(word))
    width, height, largest = header
    if not (width > 0 and height > 0 and 0 < largest < 65536):
        raise InvalidMap(f"{path}: a PGM of {width} x {height} cells with values to {largest} cannot be")
    if data[:2] == b"P5":
        kind = np.dtype(np.uint8 if largest < 256 else ">u2")
        body = data[at + 1 : at + 1 + width * height * kind.itemsize]
        values = np.frombuffer(body[: len(body) // kind.itemsize * kind.itemsize], dtype=kind)
    else:
        words = b"\n".join(line.partition(b"#")[0] for line in data[at:].splitlines()).split()
        if not all(word.isdigit() and len(word) <= DIGITS for word in words[: width * height]):
            raise InvalidMap(f"{path}: a PGM in text holds numbers only, to its largest value")
        values = np.array([int(word) for word in words[: width * height]], dtype=np.int64)
    if values.size != width * height:
        raise InvalidMap(f"{path}: it promises {width} x {height} cells and holds {values.size}")
    return values.reshape(height, width).astype(np.float64) / largest


def _word(data: bytes, at: int) -> tuple[bytes, int]:
    """The next word of a header from `at` on, comments left out, and where it ends."""
    while at < len(data) and (data[at : at + 1].isspace() or data[at : at + 1] == b"#"):
        if data[at : at + 1] == b"#":
            end = data.find(b"\n", at)
            at = len(data) if end < 0 else end
        else:
            at += 1
    end = at
    while end < len(data) and not data[end : end + 1].isspace():
        end += 1
    return data[at:end], end


# --- writing --------------------------------------------------------------------------------------------------------


def write_map(
    map_: Occupancy,
    name: str | os.PathLike[str],
    *,
    mode: Mode = "trinary",
    image_format: str | None = None,
    occupied: float = OCCUPIED_ABOVE,
    free: float = FREE_BELOW,
) -> Path:
    """Write NAME.yaml and its picture NAME.pgm (in mode ``scale`` NAME.png, which can show unknown cells); returns the YAML file's path.

    Raises `ValueError` for thresholds or a format that cannot be, `ImportError` for a PNG without Pillow, `OSError`.
    """
    if not 0.0 <= free < occupied <= 1.0:
        raise ValueError(f"thresholds of {free:g} and {occupied:g}: give 0 <= free < occupied <= 1")
    image_format = image_format or ("png" if mode == "scale" else "pgm")
    if image_format not in ("pgm", "png"):
        raise ValueError(f"a map's picture is pgm or png, not {image_format!r}")
    if mode == "scale" and image_format == "pgm":
        raise ValueError("in mode scale unknown cells are transparent, and a PGM has no such thing: write a png")
    known = (map_.data >= FREE) & (map_.data <= OCCUPIED)
    shade = _shades(map_.data, known, mode, occupied, free)[::-1]
    yaml_file = Path(f"{os.fspath(name)}.yaml")
    picture = yaml_file.with_name(f"{yaml_file.stem}.{image_format}")
    if image_format == "pgm":
        height, width = shade.shape
        picture.write_bytes(b"P5\n%d %d\n255\n" % (width, height) + shade.tobytes())
    else:
        _write_png(picture, shade, known[::-1] if mode == "scale" else None)
    yaml_file.write_text(
        f"image: {picture.name}\nmode: {mode}\nresolution: {map_.resolution!r}\n"
        f"origin: [{map_.origin_x!r}, {map_.origin_y!r}, 0]\nnegate: 0\noccupied_thresh: {occupied!r}\nfree_thresh: {free!r}\n",
        encoding="utf-8",
    )
    return yaml_file


def _shades(
    data: NDArray[np.int8], known: NDArray[np.bool_], mode: Mode, occupied: float, free: float
) -> NDArray[np.uint8]:
    if mode == "raw":
        return np.where(known, data, -1).astype(np.uint8)
    if mode == "scale":
        return np.where(known, np.rint(255 * (1 - data / 100)), 127).astype(np.uint8)
    shade = np.full(data.shape, _GREY, dtype=np.uint8)
    shade[known & (data <= round(100 * free))] = _WHITE
    shade[known & (data >= round(100 * occupied))] = _BLACK
    return shade


def _write_png(path: Path, shade: NDArray[np.uint8], opaque: NDArray[np.bool_] | None) -> None:
    try:
        from PIL import Image
    except ImportError as error:
        raise ImportError(
            f"{path}: a PNG is written by Pillow: pip install 'robactor[images]'; or write a pgm"
        ) from error
    if opaque is None:
        Image.fromarray(np.ascontiguousarray(shade)).save(path)
    else:
        Image.fromarray(np.dstack((shade, shade, shade, np.where(opaque, 255, 0).astype(np.uint8)))).save(path)
