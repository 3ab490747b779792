"""Small objects in the picture, and the tops of low obstacles: painted pixel by pixel where they are nearer than what is there."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from robot.geometry.vectors import Floats
from robot.hardware.lens import CY, FOCAL, HEIGHT, row_slopes
from robot.scenes.scene import Thing
from robot.sim.camera_columns import Eye, Prisms, columns_of

Bytes = NDArray[np.uint8]
Depths = NDArray[np.uint16]

SIGHT: Final = 10.0
TOP_LIGHT: Final = 1.0
SIDE_LIGHT: Final = 0.75

_SLOPES = row_slopes()


def paint_thing(pixels: Bytes, depth: Depths, thing: Thing, eye: Eye) -> None:
    """Paint its sides and, from above or below, the face that looks at the camera."""
    part = columns_of(thing.shape, eye, SIGHT)
    if part is None:
        return
    hits = Prisms((thing.shape,)).seen_from(eye, SIGHT, part)
    if not len(hits.which) or not (hits.enter < np.inf).any():
        return
    enter, leave, facing = hits.enter[0], hits.leave[0], hits.facing[0]
    low, high = thing.z - eye.z, thing.z + thing.shape.height - eye.z
    color = np.array(thing.color, dtype=np.float64)
    light = SIDE_LIGHT + (TOP_LIGHT - SIDE_LIGHT) * np.nan_to_num(facing)
    pixels, depth = pixels[:, part], depth[:, part]
    _paint_side(pixels, depth, enter, low, high, light[:, None] * color)
    if high < 0.0:
        paint_top(pixels, depth, enter, leave, high, color)
    elif low > 0.0:
        paint_top(pixels, depth, enter, leave, low, color * SIDE_LIGHT)


def paint_top(pixels: Bytes, depth: Depths, enter: Floats, leave: Floats, level: float, color: Floats) -> None:
    """A level face, `level` m over the camera (negative: below), between the depths at which each column enters and leaves it."""
    met = enter < np.inf
    if level == 0.0 or not met.any():
        return
    ends = CY - FOCAL * level / np.concatenate((enter[met], leave[met]))
    rows = _rows(float(ends.min()), float(ends.max()))
    with np.errstate(divide="ignore"):
        face = (level / _SLOPES[rows])[:, None]
    inside = (face >= enter) & (face < leave) & (face > 0.0)
    shown = np.broadcast_to(face, inside.shape)
    _put(pixels[rows], depth[rows], shown, inside, np.broadcast_to(color.astype(np.uint8), (inside.shape[1], 3)))


def _paint_side(pixels: Bytes, depth: Depths, enter: Floats, low: float, high: float, color: Floats) -> None:
    met = enter[enter < np.inf]
    ends = [CY - FOCAL * level / at for level in (low, high) for at in (float(met.min()), float(met.max()))]
    rows = _rows(min(ends), max(ends))
    with np.errstate(invalid="ignore"):  # 0 * inf, on the horizon where nothing is met: no pixel
        over = _SLOPES[rows][:, None] * enter
    inside = (over >= low) & (over <= high) & (enter < np.inf)
    _put(pixels[rows], depth[rows], np.broadcast_to(enter, inside.shape), inside, color.astype(np.uint8))


def _rows(first: float, last: float) -> slice:
    return slice(max(0, int(first) - 1), min(HEIGHT, int(last) + 2))


def _put(pixels: Bytes, depth: Depths, shown: Floats, inside: NDArray[np.bool_], color: Bytes) -> None:
    """Write where it is inside and nearer than what is there. Depths are stored in mm less one."""
    row, column = np.nonzero(inside)
    millimetres = np.rint(shown[row, column] * 1000.0) - 1.0
    nearer = (millimetres < depth[row, column]) & (millimetres < SIGHT * 1000.0)
    row, column = row[nearer], column[nearer]
    depth[row, column] = millimetres[nearer].astype(np.uint16)
    pixels[row, column] = color[column]
