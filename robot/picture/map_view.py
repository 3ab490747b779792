"""The floor from above: the map the robot navigates on, what really stands there, its plan, its trail, and what its LiDAR sees."""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, pi, sin

import numpy as np

from robot.geometry.planar import Pose2
from robot.model.footprint import Footprint
from robot.picture.axis import Axis
from robot.picture.canvas import Canvas, Ink, Points
from robot.picture.palette import srgb
from robot.picture.recording import Recording
from robot.png import Image
from robot.scenes.scene import Box, Obstacle

__all__ = ["draw_map"]

PAPER, INK, FAINT = srgb("fbf8f2"), srgb("2b2a28"), srgb("ddd5c6")
FREE, OCCUPIED, OUTLINE = srgb("f2ede2"), srgb("b9ae9c"), srgb("6d6558")
PLAN, TRAIL, BODY, RETURN = srgb("1767b8"), srgb("e0682a"), srgb("f5b30a"), srgb("c22f4e")
DOCK, GOAL = srgb("2a8f5c"), srgb("7a6fb0")
MARGIN, LEGEND = 48.0, 210.0


def draw_map(recording: Recording, width: int, height: int) -> Image:
    """The map to scale, numbered in metres, with a legend on its right."""
    return _Map(recording, width, height).draw()


class _Map:
    """A drawing of one recording: the scale and the sheet."""

    def __init__(self, recording: Recording, width: int, height: int) -> None:
        self._recording = recording
        self._canvas = Canvas(width, height, PAPER)
        x0, y0, x1, y1 = recording.grid.bounds
        room_x, room_y = max(width - 2.0 * MARGIN - LEGEND, 32.0), max(height - 2.0 * MARGIN, 32.0)
        self._scale = min(room_x / (x1 - x0), room_y / (y1 - y0))
        left = MARGIN + (room_x - self._scale * (x1 - x0)) / 2.0
        low = height - MARGIN - (room_y - self._scale * (y1 - y0)) / 2.0
        step = next(step for step in (1.0, 2.0, 5.0, 10.0, 50.0) if step * self._scale > 32.0 or step == 50.0)
        self._x = Axis(x0, x1, left, left + self._scale * (x1 - x0), step)
        self._y = Axis(y0, y1, low, low - self._scale * (y1 - y0), step)

    def draw(self) -> Image:
        self._ground()
        for obstacle in self._recording.scene.obstacles:
            self._closed(self._outline(obstacle), OUTLINE, 1.2)
        self._canvas.line(self._pixels(self._recording.path), PLAN, 5.0, 0.65)
        self._places()
        self._canvas.line(self._pixels(self._recording.trail), TRAIL, 2.5)
        for x, y in self._pixels(self._recording.returns):
            self._canvas.disc(x, y, 2.2, RETURN, 0.9)
        self._robot()
        self._legend()
        return self._canvas.image

    def _ground(self) -> None:
        canvas, grid = self._canvas, self._recording.grid
        left, right, top, low = self._x.start, self._x.end, self._y.end, self._y.start
        canvas.rectangle(left, top, right, low, FREE)
        for x, number in self._x.ticks():
            canvas.line([(x, top), (x, low)], FAINT, 1.0)
            canvas.text(x, low + 22.0, number, INK, align="middle")
        for y, number in self._y.ticks():
            canvas.line([(left, y), (right, y)], FAINT, 1.0)
            canvas.text(left - 10.0, y + 5.0, number, INK, align="right")
        canvas.raster(left, top, self._scale * grid.resolution, np.flipud(grid.occupied), OCCUPIED)

    def _places(self) -> None:
        scene = self._recording.scene
        self._canvas.polygon(self._pixels(_rectangle(scene.dock, 1.2, 0.7)), DOCK, 0.35)
        self._closed(self._pixels(_rectangle(scene.dock, 1.2, 0.7)), DOCK, 1.5)
        for number, pose in enumerate(scene.patrol, start=1):
            ring = [(pose.x + 0.2 * cos(a), pose.y + 0.2 * sin(a)) for a in np.linspace(0.0, 2.0 * pi, 25).tolist()]
            nose = [(pose.x + r * cos(pose.yaw), pose.y + r * sin(pose.yaw)) for r in (0.2, 0.42)]
            self._canvas.line(self._pixels(ring), GOAL, 1.8)
            self._canvas.line(self._pixels(nose), GOAL, 1.8)
            ((x, y),) = self._pixels([(pose.x, pose.y)])
            self._canvas.text(x, y + 4.5, str(number), GOAL, 9.0, align="middle")

    def _robot(self) -> None:
        pose, size = self._recording.pose, Footprint()
        corners = self._pixels(_rectangle(pose, size.length, size.width))
        self._canvas.polygon(corners, BODY, 0.9)
        self._closed(corners, INK, 1.5)
        tip = Pose2(pose.x + 0.42 * cos(pose.yaw), pose.y + 0.42 * sin(pose.yaw), pose.yaw)
        wings = [(tip.x - 0.27 * cos(tip.yaw + turn), tip.y - 0.27 * sin(tip.yaw + turn)) for turn in (-0.6, 0.6)]
        nose = [wings[0], (tip.x, tip.y), wings[1]]
        self._canvas.line(self._pixels(nose), INK, 2.0)

    def _legend(self) -> None:
        canvas, recording = self._canvas, self._recording
        x, y = self._x.end + 34.0, self._y.end + 14.0
        for number, text in enumerate(
            (
                recording.scene.name,
                f"{recording.backend} body",
                f"at {recording.time:.2f} s",
                "1 square: " + f"{self._x.step:g} m",
            )
        ):
            canvas.text(x, y + 24.0 * number, text, INK, 14.0 if number == 0 else 11.0)
        y += 24.0 * 4 + 16.0
        names: Sequence[tuple[str, Ink]] = (
            ("robot", BODY), ("plan", PLAN), ("trail walked", TRAIL), ("lidar returns", RETURN),
            ("patrol", GOAL), ("dock", DOCK), ("map: occupied", OCCUPIED),
        )  # fmt: skip
        for number, (name, ink) in enumerate(names):
            canvas.rectangle(x, y + 26.0 * number - 10.0, x + 18.0, y + 26.0 * number + 1.0, ink)
            canvas.text(x + 28.0, y + 26.0 * number, name, INK)

    def _pixels(self, points: Points) -> list[tuple[float, float]]:
        return [(self._x.pixel(x), self._y.pixel(y)) for x, y in points]

    def _closed(self, pixels: Points, ink: Ink, thick: float) -> None:
        self._canvas.line([*pixels, pixels[0]], ink, thick)

    def _outline(self, obstacle: Obstacle) -> list[tuple[float, float]]:
        if isinstance(obstacle, Box):
            return self._pixels(
                _rectangle(Pose2(obstacle.x, obstacle.y, obstacle.yaw), obstacle.length, obstacle.width)
            )
        turns = np.linspace(0.0, 2.0 * pi, 24, endpoint=False).tolist()
        return self._pixels(
            [(obstacle.x + obstacle.radius * cos(a), obstacle.y + obstacle.radius * sin(a)) for a in turns]
        )


def _rectangle(pose: Pose2, length: float, width: float) -> list[tuple[float, float]]:
    c, s = cos(pose.yaw), sin(pose.yaw)
    return [
        (pose.x + c * along - s * across, pose.y + s * along + c * across)
        for along, across in (
            (length / 2, width / 2),
            (-length / 2, width / 2),
            (-length / 2, -width / 2),
            (length / 2, -width / 2),
        )
    ]
