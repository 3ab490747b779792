"""The PNG of `plot`: one panel for each field, over one time axis."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from robot.picture.axis import spanning
from robot.picture.canvas import Canvas
from robot.picture.palette import srgb
from robot.png import encode

__all__ = ["picture"]

PAPER, INK, FAINT, CURVE = srgb("fbf8f2"), srgb("2b2a28"), srgb("e4ddd0"), srgb("1767b8")
WIDTH: Final = 900
PANEL: Final = 240
LEFT, RIGHT, TOP, BOTTOM = 84.0, 28.0, 40.0, 40.0
FEW = 5
"""About so many numbers stand at the vertical axis."""


def picture(series: Sequence[tuple[str, Sequence[float], Sequence[float]]]) -> bytes:
    """The file's bytes. Each series has a name, times in seconds, and at least one value."""
    canvas = Canvas(WIDTH, PANEL * len(series), PAPER)
    latest = max(times[-1] for _, times, _ in series)
    across = spanning(0.0, latest, LEFT, WIDTH - RIGHT, FEW * 2)
    for number, (name, times, values) in enumerate(series):
        top = number * PANEL + TOP
        up = spanning(min(values), max(values), (number + 1) * PANEL - BOTTOM, top, FEW)
        canvas.text(LEFT, top - BOTTOM / 2, name, INK, 14.0)
        for x, mark in across.ticks():
            canvas.line([(x, up.start), (x, up.end)], FAINT, 1.0)
            canvas.text(x, up.start + BOTTOM / 2, mark, INK, align="middle")
        for y, mark in up.ticks():
            canvas.line([(across.start, y), (across.end, y)], FAINT, 1.0)
            canvas.text(LEFT - BOTTOM / 2, y, mark, INK, align="right")
        points = [(across.pixel(moment), up.pixel(value)) for moment, value in zip(times, values, strict=True)]
        canvas.line(points, CURVE)
    return encode(canvas.image)
