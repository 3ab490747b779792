"""Speed and height of the body over time, as line plots."""

from __future__ import annotations

from collections.abc import Sequence

from robot.picture.axis import Axis, spanning
from robot.picture.canvas import Canvas, Ink
from robot.picture.palette import srgb
from robot.picture.recording import Recording
from robot.png import Image

__all__ = ["draw_plots"]

PAPER, INK, FAINT, FRAME = srgb("fbf8f2"), srgb("2b2a28"), srgb("e4ddd0"), srgb("8a8378")
TRUE, ASKED, HEIGHT = srgb("1767b8"), srgb("e0862a"), srgb("2a8f5c")
LEFT, RIGHT, TOP, GAP, BOTTOM = 84.0, 28.0, 78.0, 74.0, 62.0


def draw_plots(recording: Recording, width: int, height: int) -> Image:
    """Two panels over one time axis: the true forward speed against the one asked for, and the body's height over the floor."""
    canvas = Canvas(width, height, PAPER)
    panel = (height - TOP - GAP - BOTTOM) / 2.0
    times = recording.times
    across = spanning(0.0, max(times), LEFT, width - RIGHT, max(2, width // 110))
    canvas.text(LEFT, 30.0, f"{recording.scene.name}, {recording.backend} body, {recording.time:.2f} s", INK, 14.0)
    speed = _scale([*recording.speeds, *recording.commands, 0.0, 0.1], TOP, panel)
    _frame(canvas, across, speed, "forward speed (m/s)")
    _curve(canvas, across, speed, times, recording.commands, ASKED)
    _curve(canvas, across, speed, times, recording.speeds, TRUE)
    _legend(canvas, width - RIGHT, TOP - 12.0, (("asked for", ASKED), ("true", TRUE)))
    body = _scale([*recording.heights, 0.0], TOP + panel + GAP, panel)
    _frame(canvas, across, body, "height of the body over the floor (m)")
    _curve(canvas, across, body, times, recording.heights, HEIGHT)
    canvas.text((LEFT + width - RIGHT) / 2.0, height - 14.0, "time (s)", INK, align="middle")
    return canvas.image


def _scale(values: Sequence[float], top: float, panel: float) -> Axis:
    return spanning(
        min(values), max(values) + 0.05 * (max(values) - min(values)), top + panel, top, max(2, int(panel // 45))
    )


def _frame(canvas: Canvas, across: Axis, up: Axis, title: str) -> None:
    for x, number in across.ticks():
        canvas.line([(x, up.start), (x, up.end)], FAINT, 1.0)
        canvas.text(x, up.start + 22.0, number, INK, align="middle")
    for y, number in up.ticks():
        canvas.line([(across.start, y), (across.end, y)], FAINT, 1.0)
        canvas.text(across.start - 12.0, y + 5.0, number, INK, align="right")
    canvas.line([(across.start, up.end), (across.start, up.start), (across.end, up.start)], FRAME, 1.5)
    canvas.text(across.start, up.end - 12.0, title, INK, 12.0)


def _curve(canvas: Canvas, across: Axis, up: Axis, times: Sequence[float], values: Sequence[float], ink: Ink) -> None:
    canvas.line([(across.pixel(t), up.pixel(v)) for t, v in zip(times, values, strict=True)], ink, 2.0)


def _legend(canvas: Canvas, right: float, y: float, entries: Sequence[tuple[str, Ink]]) -> None:
    for number, (name, ink) in enumerate(entries):
        x = right - 130.0 * (len(entries) - number)
        canvas.line([(x, y - 5.0), (x + 24.0, y - 5.0)], ink, 3.0)
        canvas.text(x + 34.0, y, name, INK)
