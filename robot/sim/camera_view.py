"""What the camera sees: colour and depth of a scene, column by column, in about 2 ms.

The picture is put together from upright strips. For each column the sides that it meets are sorted by depth, and of each only the part
above the skyline of the nearer ones is visible (all obstacles stand on the floor). What is low, or does not stand on the floor, is
painted afterwards, pixel by pixel within its bounding box.

Depth is exact, without noise; pixels without anything within `RANGE` have none.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from robot.hardware.devices import Frame
from robot.hardware.lens import CY, FOCAL, HEIGHT, WIDTH, row_slopes
from robot.scenes.scene import Scene, Thing
from robot.sim.camera_columns import Eye, Hits, Prisms
from robot.sim.camera_things import paint_thing, paint_top

Bytes = NDArray[np.uint8]

RANGE: Final = 10.0
"""Depth is measured up to here, m."""
SIGHT: Final = 60.0
"""Colour is seen up to here, m."""
FAR: Final = 65535
"""No depth, while a picture is made."""
WALL: Final = np.array([198.0, 186.0, 168.0])
SHADE: Final = 0.55
"""Brightness of a side that is met at a grazing angle."""
HAZE: Final = 18.0
"""Distance over which brightness falls to a third, m."""

BLOCK: Final = 120
"""Rows that are painted at a time: they stay in the cache, and their numbers in a byte."""

_ROWS = np.arange(HEIGHT, dtype=np.int16)[:, None]
_BYTES = np.arange(BLOCK, dtype=np.uint8)[:, None]


class View:
    """Makes the pictures of one scene. Keeps its scratch memory: one at a time."""

    def __init__(self, scene: Scene) -> None:
        self._obstacles = Prisms(scene.obstacles)
        self._heights = np.array([one.height for one in scene.obstacles])
        self._backdrop = _backdrop()
        self._mask = np.empty((BLOCK, WIDTH * 3), dtype=np.uint8)
        self._blend = np.empty((BLOCK, WIDTH * 3), dtype=np.uint8)
        self._cover = np.empty((HEIGHT, WIDTH), dtype=np.int16)

    def look(self, eye: Eye, things: Sequence[Thing] = ()) -> Frame:
        """The picture from `eye`, with these small objects in the scene."""
        memory = np.empty(
            HEIGHT * WIDTH * 5, np.uint8
        )  # one piece for both: the allocator gives it back and takes it again without the system
        flat_rgb, flat_depth = memory[: HEIGHT * WIDTH * 3], memory[HEIGHT * WIDTH * 3 :]
        rgb, depth = flat_rgb.reshape(HEIGHT, WIDTH * 3), flat_depth.view(np.uint16).reshape(HEIGHT, WIDTH)
        hits = self._obstacles.seen_from(eye, SIGHT)
        strips, feet = self._strips(hits, eye)
        self._paint(rgb, strips, feet)
        self._measure(depth, strips, eye)
        pixels = rgb.reshape(HEIGHT, WIDTH, 3)
        for place in np.flatnonzero(self._heights[hits.which] < eye.z).tolist():
            top = float(self._heights[hits.which[place]])
            paint_top(pixels, depth, hits.enter[place], hits.leave[place], top - eye.z, WALL)
        for thing in things:
            paint_thing(pixels, depth, thing, eye)
        np.add(depth, 1, out=depth)  # depths are one less until here, so that FAR becomes 0
        for array in (memory, flat_rgb, flat_depth):
            array.setflags(write=False)
        return Frame(flat_rgb, flat_depth)

    def _strips(self, hits: Hits, eye: Eye) -> tuple[list[_Strip], NDArray[np.int16]]:
        """Visible sides, nearest first, and for each column the row where the floor ends."""
        columns = np.arange(WIDTH)
        heights = self._heights[hits.which][:, None]
        depths = hits.enter.copy()
        tops = np.ceil(CY - FOCAL * (heights - eye.z) / depths).clip(0, HEIGHT)
        skyline = np.full(WIDTH, float(HEIGHT))
        feet = np.full(WIDTH, np.ceil(CY))
        strips: list[_Strip] = []
        while len(depths):
            nearest = depths.argmin(axis=0)
            depth = depths[nearest, columns]
            met = depth < np.inf
            if not met.any():
                break
            if not strips:
                feet = np.where(met, np.ceil(CY + FOCAL * eye.z / depth), feet).clip(0, HEIGHT)
            np.minimum(skyline, np.where(met, tops[nearest, columns], skyline), out=skyline)
            light = (SHADE + (1.0 - SHADE) * hits.facing[nearest, columns]) * np.exp(-depth / HAZE)
            color = (light[:, None] * WALL).astype(np.uint8)
            strips.append(_Strip(_millimetres(depth), skyline.astype(np.int16), color.ravel()))
            depths[tops >= skyline] = np.inf
        return strips, feet.astype(np.int16)

    def _paint(self, rgb: Bytes, strips: Sequence[_Strip], feet: NDArray[np.int16]) -> None:
        """Far strips first, then the floor in front of the nearest ones. Bits are chosen by masks: that is what numpy does fastest."""
        np.copyto(rgb, self._backdrop)
        if not strips:
            return
        low, full = int(feet.max()), int(strips[0].top.max())
        for strip in reversed(strips):
            self._choose(rgb, strip.color, strip.top, int(strip.top.min()), min(full, low))
        rgb[full:low] = strips[0].color  # from here down the nearest strip is in every column
        self._choose(rgb, self._backdrop, feet, int(feet.min()), low)

    def _choose(self, rgb: Bytes, color: Bytes, edge: NDArray[np.int16], high: int, low: int) -> None:
        """Give the pixels of rows high..low that lie at or below their column's `edge` the color: of its column, or its own."""
        wide = np.repeat(edge, 3)
        for first in range(high, low, BLOCK):
            rows = slice(first, min(first + BLOCK, low))
            part, count = rgb[rows], rows.stop - first
            mask, blend = self._mask[:count], self._blend[:count]
            np.greater_equal(_BYTES[:count], np.clip(wide - first, 0, 255).astype(np.uint8), out=mask.view(np.bool_))
            np.negative(mask, out=mask)
            np.bitwise_xor(part, color if color.ndim == 1 else color[rows], out=blend)
            np.bitwise_and(blend, mask, out=blend)
            np.bitwise_xor(part, blend, out=part)

    def _measure(self, depth: NDArray[np.uint16], strips: Sequence[_Strip], eye: Eye) -> None:
        """The floor's depth, or that of a side that covers it: the nearest of all that reach up to the pixel."""
        depth[:] = _floor_depths(eye.z)[:, None]
        if not strips:
            return
        full = int(strips[0].top.max())
        for strip in strips:
            high = int(strip.top.min())
            cover = self._cover[high:full]
            np.subtract(_ROWS[high:full], strip.top, out=cover)
            np.right_shift(cover, 15, out=cover)  # -1, all bits set, above the strip's top; 0 below
            covered = cover.view(np.uint16)
            np.bitwise_or(covered, strip.depth, out=covered)
            np.minimum(depth[high:full], covered, out=depth[high:full])
        np.minimum(depth[full:], strips[0].depth, out=depth[full:])


@dataclass(frozen=True, slots=True)
class _Strip:
    """One side for each column: its depth (mm less one, or FAR), the row from which on it or a nearer one is seen, its color."""

    depth: NDArray[np.uint16]
    top: NDArray[np.int16]
    """HEIGHT where nothing is met."""
    color: Bytes


def _millimetres(depths: NDArray[np.float64]) -> NDArray[np.uint16]:
    """Depths in mm less one; FAR beyond the range."""
    return np.where(depths <= RANGE, np.rint(depths * 1000.0) - 1.0, FAR).clip(0, FAR).astype(np.uint16)


def _floor_depths(height: float) -> NDArray[np.uint16]:
    """For each row, from a camera so high."""
    slopes = row_slopes()
    with np.errstate(divide="ignore"):
        depths = np.where(slopes < 0.0, -height / np.minimum(slopes, 0.0), np.inf)
    return _millimetres(np.maximum(depths, 0.001))


def _backdrop() -> Bytes:
    """Hall above, floor below: darker towards the horizon."""
    share = np.abs(row_slopes()) / row_slopes()[0]
    hall = np.array([92.0, 100.0, 112.0]) + share[:, None] * np.array([70.0, 72.0, 74.0])
    floor = np.array([74.0, 72.0, 70.0]) + share[:, None] * np.array([64.0, 62.0, 58.0])
    rows: Bytes = np.asarray(np.where(row_slopes()[:, None] > 0.0, hall, floor), dtype=np.float64).astype(np.uint8)
    backdrop: Bytes = np.ascontiguousarray(np.tile(rows, (1, WIDTH)))
    backdrop.setflags(write=False)
    return backdrop
