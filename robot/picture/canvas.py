"""A flat sheet to draw on: lines, discs, polygons and text with smooth edges.

Pixels, x to the right, y downwards; colours are sRGB bytes.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from robot.picture.strokes import TALL, strokes, width
from robot.png import Image

__all__ = ["Canvas", "Ink", "Points"]

Ink = tuple[int, int, int]
Points = Sequence[tuple[float, float]]
Window = tuple[slice, slice]
Cover = NDArray[np.float32]


class Canvas:
    """An image of so many pixels, all of them `paper` at first."""

    def __init__(self, width: int, height: int, paper: Ink) -> None:
        self.width, self.height = width, height
        self._pixels = np.empty((height, width, 3), dtype=np.float32)
        self._pixels[:] = paper

    @property
    def image(self) -> Image:
        whole: Image = np.clip(self._pixels + 0.5, 0.0, 255.0).astype(np.uint8)
        return whole

    def rectangle(self, x0: float, y0: float, x1: float, y1: float, ink: Ink, opacity: float = 1.0) -> None:
        """Fill it; edges between pixels cover them in part."""
        window = self._window(x0, y0, x1, y1)
        x, y = self._centres(window)
        across = np.clip(np.minimum(x + 0.5, x1) - np.maximum(x - 0.5, x0), 0.0, 1.0)
        down = np.clip(np.minimum(y + 0.5, y1) - np.maximum(y - 0.5, y0), 0.0, 1.0)
        self._blend(window, (across * down).astype(np.float32), ink, opacity)

    def line(self, points: Points, ink: Ink, thick: float = 1.5, opacity: float = 1.0) -> None:
        """Join the points, with round ends; one point is a disc."""
        if not points:
            return
        edge = thick / 2.0 + 1.0
        xs, ys = zip(*points, strict=True)
        whole = self._window(min(xs) - edge, min(ys) - edge, max(xs) + edge, max(ys) + edge)
        cover = np.zeros((whole[0].stop - whole[0].start, whole[1].stop - whole[1].start), dtype=np.float32)
        for a, b in zip(points, points[1:] or points, strict=False):
            part = self._window(
                min(a[0], b[0]) - edge, min(a[1], b[1]) - edge, max(a[0], b[0]) + edge, max(a[1], b[1]) + edge
            )
            x, y = self._centres(part)
            found = np.clip(thick / 2.0 + 0.5 - _distance(x, y, a, b), 0.0, min(1.0, thick)).astype(np.float32)
            mine = tuple(slice(p.start - w.start, p.stop - w.start) for p, w in zip(part, whole, strict=True))
            cover[mine] = np.maximum(cover[mine], found)
        self._blend(whole, cover, ink, opacity)

    def disc(self, x: float, y: float, radius: float, ink: Ink, opacity: float = 1.0) -> None:
        self.line([(x, y)], ink, 2.0 * radius, opacity)

    def polygon(self, points: Points, ink: Ink, opacity: float = 1.0) -> None:
        """Fill a convex polygon, its corners in either order."""
        xs, ys = zip(*points, strict=True)
        window = self._window(min(xs) - 1.0, min(ys) - 1.0, max(xs) + 1.0, max(ys) + 1.0)
        x, y = self._centres(window)
        middle_x, middle_y = sum(xs) / len(xs), sum(ys) / len(ys)
        depth = np.full(np.broadcast_shapes(x.shape, y.shape), np.inf)
        for (ax, ay), (bx, by) in zip(points, [*points[1:], points[0]], strict=True):
            normal = np.array((ay - by, bx - ax)) / max(np.hypot(bx - ax, by - ay), 1e-9)
            inward = np.sign(normal[0] * (middle_x - ax) + normal[1] * (middle_y - ay))
            depth = np.minimum(depth, inward * (normal[0] * (x - ax) + normal[1] * (y - ay)))
        self._blend(window, np.clip(depth + 0.5, 0.0, 1.0).astype(np.float32), ink, opacity)

    def text(
        self,
        x: float,
        y: float,
        text: str,
        ink: Ink,
        size: float = 11.0,
        align: Literal["left", "middle", "right"] = "left",
    ) -> None:
        """One line, its baseline at y; `size` is the height of a digit."""
        unit = size / TALL
        x -= {"left": 0.0, "middle": 0.5, "right": 1.0}[align] * width(text) * unit
        for stroke in strokes(text):
            self.line([(x + px * unit, y - py * unit) for px, py in stroke], ink, 0.14 * size)

    def raster(self, x: float, y: float, scale: float, values: NDArray[np.bool_], ink: Ink) -> None:
        """Squares of side `scale` where `values` is true; row 0 on top, the top left corner at (x, y)."""
        window = self._window(x, y, x + scale * values.shape[1], y + scale * values.shape[0])
        px, py = self._centres(window)
        columns = np.clip(((px - x) / scale).astype(np.int64), 0, values.shape[1] - 1)
        rows = np.clip(((py - y) / scale).astype(np.int64), 0, values.shape[0] - 1)
        self._blend(window, values[rows, columns].astype(np.float32), ink, 1.0)

    def _window(self, x0: float, y0: float, x1: float, y1: float) -> Window:
        """The pixels that the box touches, within the sheet."""
        left, right = (int(np.clip(v, 0, self.width)) for v in (np.floor(x0), np.ceil(x1)))
        top, bottom = (int(np.clip(v, 0, self.height)) for v in (np.floor(y0), np.ceil(y1)))
        return slice(top, bottom), slice(left, right)

    def _centres(self, window: Window) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        rows, columns = window
        x = np.arange(columns.start, columns.stop, dtype=np.float64) + 0.5
        y = np.arange(rows.start, rows.stop, dtype=np.float64) + 0.5
        return x[None, :], y[:, None]

    def _blend(self, window: Window, cover: Cover, ink: Ink, opacity: float) -> None:
        there = self._pixels[window]
        there += (cover * np.float32(opacity))[:, :, None] * (np.array(ink, dtype=np.float32) - there)


def _distance(
    x: NDArray[np.float64], y: NDArray[np.float64], a: tuple[float, float], b: tuple[float, float]
) -> NDArray[np.float64]:
    """From pixels to the line between two points."""
    ax, ay = a
    dx, dy = b[0] - ax, b[1] - ay
    share = np.clip(((x - ax) * dx + (y - ay) * dy) / max(dx * dx + dy * dy, 1e-12), 0.0, 1.0)
    result: NDArray[np.float64] = np.hypot(x - ax - share * dx, y - ay - share * dy)
    return result
