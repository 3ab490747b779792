"""Coloured objects in a colour image, and where they are by its depth image: vivid pixels, grouped by color and neighborhood."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from robot.estimation.patches import patches
from robot.hardware.lens import deproject

COLORS: Final = ("red", "yellow", "green", "blue")
"""At hues of 0, 60, 120 and 240 degrees; a pixel has the color whose hue is nearest."""
VIVID: Final = 80
"""A pixel counts when its strongest channel is so much above its weakest (0..255): walls and floors stay far below."""
FEWEST: Final = 12
"""Pixels that make an object."""
SPREAD: Final = 300
"""Depths that differ by more than this from the object's median, mm, are of something behind it."""
MILLIMETRES: Final = 1000.0
"""In a metre."""

_HUES: Final = np.array([0.0, 60.0, 120.0, 240.0, 360.0])
_EDGES: Final = (_HUES[:-1] + _HUES[1:]) / 2.0


@dataclass(frozen=True, slots=True)
class Blob:
    """One coloured object in one picture."""

    color: str
    x: int
    y: int
    width: int
    height: int
    """Its bounding box: leftmost column, uppermost row, size; pixels."""
    pixels: int
    position: tuple[float, float, float]
    """Of the middle of what is seen of it, in the camera's axes (x forward), m; NaN where there is no depth."""


def find_blobs(pixels: NDArray[np.uint8], millimetres: NDArray[np.uint16]) -> list[Blob]:
    """The objects in a picture, shape (rows, columns, 3), with its depths, shape (rows, columns), 0 for none. The largest first."""
    part = _vivid_part(pixels)
    if part is None:
        return []
    colors = _color_of_each(pixels[part])
    found: list[Blob] = []
    for number, color in enumerate(COLORS):
        for patch in patches(colors == number):
            if patch.size < FEWEST:
                continue
            left, top, width, height = patch.box
            rows, columns = patch.pixels()
            x, y = left + part[1].start, top + part[0].start
            position = _position(rows + part[0].start, columns + part[1].start, millimetres)
            found.append(Blob(color, x, y, width, height, patch.size, position))
    return sorted(found, key=lambda blob: -blob.pixels)


def _vivid_part(pixels: NDArray[np.uint8]) -> tuple[slice, slice] | None:
    """The rows and columns within which all vivid pixels lie, looked for in every second one of both; None for none."""
    red, green, blue = (np.ascontiguousarray(pixels[::2, ::2, channel]) for channel in range(3))
    strongest, weakest = np.maximum(np.maximum(red, green), blue), np.minimum(np.minimum(red, green), blue)
    vivid = (strongest - weakest) >= VIVID
    rows, columns = np.flatnonzero(vivid.any(axis=1)), np.flatnonzero(vivid.any(axis=0))
    if not len(rows):
        return None
    return (
        slice(max(0, 2 * int(rows[0]) - 2), min(pixels.shape[0], 2 * int(rows[-1]) + 3)),
        slice(max(0, 2 * int(columns[0]) - 2), min(pixels.shape[1], 2 * int(columns[-1]) + 3)),
    )


def _color_of_each(pixels: NDArray[np.uint8]) -> NDArray[np.int8]:
    """The place in COLORS of each pixel's color; -1 for those that are not vivid."""
    red, green, blue = (pixels[:, :, channel].astype(np.float32) for channel in range(3))
    strongest = np.maximum(np.maximum(red, green), blue)
    span = strongest - np.minimum(np.minimum(red, green), blue)
    with np.errstate(divide="ignore", invalid="ignore"):
        hue = np.where(
            strongest == red,
            (60.0 * (green - blue) / span) % 360.0,  # formula: hue of HSV, degrees
            np.where(
                strongest == green,
                120.0 + 60.0 * (blue - red) / span,  # formula: hue of HSV
                240.0 + 60.0 * (red - green) / span,  # formula: hue of HSV
            ),
        )
    color = np.searchsorted(_EDGES, np.nan_to_num(hue)).astype(np.int8) % len(COLORS)
    return np.where(span >= VIVID, color, np.int8(-1)).astype(np.int8)


def _position(
    rows: NDArray[np.intp], columns: NDArray[np.intp], millimetres: NDArray[np.uint16]
) -> tuple[float, float, float]:
    depths = millimetres[rows, columns].astype(np.float64)
    known = depths > 0.0
    if not known.any():
        return (float("nan"), float("nan"), float("nan"))
    near = known & (np.abs(depths - np.median(depths[known])) <= SPREAD)
    return deproject(float(columns[near].mean()), float(rows[near].mean()), float(depths[near].mean()) / MILLIMETRES)
