"""The floor: concrete in one-metre slabs, and what is painted on it. All of it is filtered over the pixel's width.

Paint comes in layers of bars. A bar is a straight piece of paint, `length` long and `width` wide around its middle.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import atan2, cos, hypot, pi, sin

import numpy as np
from numpy.typing import NDArray

from robot.geometry.planar import Pose2, placed
from robot.picture import palette
from robot.picture.recording import Recording
from robot.picture.solids import Colour, Floats
from robot.picture.tracer import CHUNK
from robot.scenes.scene import Scene

Points = Sequence[tuple[float, float]]
JOINT_WIDTH = 0.012


@dataclass(frozen=True, slots=True, eq=False)
class Layer:
    """Bars of one colour: rows x, y, yaw, length, width; round ones have half discs of their width for ends."""

    colour: Colour
    bars: NDArray[np.float64]
    opacity: float = 1.0
    rounded: bool = False


def paint(layers: Sequence[Layer], x: Floats, y: Floats, blur: Floats) -> Floats:
    """The floor's colour at points, shape (3, n), n a multiple of CHUNK; `blur` is the width of a pixel on the floor, m."""
    colour = _concrete(x, y, blur)
    low_x, high_x, low_y, high_y = (f(v.reshape(-1, CHUNK), axis=1) for v in (x, y) for f in (np.min, np.max))
    widest = blur.reshape(-1, CHUNK).max(axis=1)
    for layer in layers:
        cover = np.zeros((x.size // CHUNK, CHUNK), dtype=np.float32)
        for bx, by, yaw, length, width in layer.bars.tolist():
            reach = hypot(length, width) / 2.0 + (width / 2.0 if layer.rounded else 0.0) + widest
            near = (bx > low_x - reach) & (bx < high_x + reach) & (by > low_y - reach) & (by < high_y + reach)
            chunks = np.flatnonzero(near)
            if chunks.size:
                px, py, pixel = (v.reshape(-1, CHUNK)[chunks] for v in (x, y, blur))
                part = _bar(px - np.float32(bx), py - np.float32(by), pixel, yaw, length, width, layer.rounded)
                cover[chunks] = np.maximum(cover[chunks], part)
        share = cover.ravel() * np.float32(layer.opacity)
        colour += share * (np.array(layer.colour, dtype=np.float32)[:, None] - colour)
    return colour


def _bar(x: Floats, y: Floats, blur: Floats, yaw: float, length: float, width: float, rounded: bool) -> Floats:
    c, s = np.float32(cos(yaw)), np.float32(sin(yaw))
    along, across = np.abs(c * x + s * y), np.abs(c * y - s * x)
    if rounded:
        off = np.hypot(np.maximum(along - np.float32(length / 2.0), np.float32(0.0)), across)
        return _within(off, width, blur)
    return _within(along, length, blur) * _within(across, width, blur)


def _within(off: Floats, width: float, blur: Floats) -> Floats:
    """The share of the pixel [off - blur/2, off + blur/2] that lies within a band of `width` around zero."""
    high = np.minimum(off + blur / 2, np.float32(width / 2.0))
    low = np.maximum(off - blur / 2, np.float32(-width / 2.0))
    result: Floats = np.clip((high - low) / blur, np.float32(0.0), np.float32(1.0))
    return result


def _concrete(x: Floats, y: Floats, blur: Floats) -> Floats:
    """Slabs of one metre, each of a slightly different tone."""
    column, row = np.floor(x), np.floor(y)
    tone = np.sin(column * np.float32(12.9898) + row * np.float32(78.233)) * np.float32(43758.547)
    tone = (tone - np.floor(tone) - np.float32(0.5)) * np.float32(0.06) * np.clip(0.3 / blur, 0.0, 1.0)
    cloud = np.sin(x * 0.9 + 1.7 * np.sin(y * 0.53)) * np.sin(y * 1.1 + 1.3 * np.sin(x * 0.71)) * np.float32(0.02)
    off_x = np.abs(x - np.round(x))
    off_y = np.abs(y - np.round(y))
    joint = np.maximum(_within(off_x, JOINT_WIDTH, blur), _within(off_y, JOINT_WIDTH, blur))
    base = np.array(palette.CONCRETE, dtype=np.float32)[:, None] * (1 + tone + cloud)
    result: Floats = (base + joint * (np.array(palette.LINE, dtype=np.float32)[:, None] - base)).astype(np.float32)
    return result


# -- what is painted ------------------------------------------------------------------------------------------------------


def floor_layers(recording: Recording) -> list[Layer]:
    """Dock, patrol, planned path, and the trail walked so far, from the bottom to the top."""
    scene = recording.scene
    return [*_dock(scene.dock), *_patrol(scene), *_plan(recording.path), *_trail(recording)]


def _bars(rows: Iterable[tuple[float, float, float, float, float]]) -> NDArray[np.float64]:
    return np.array(list(rows), dtype=np.float64).reshape(-1, 5)


def _line(points: Points, width: float) -> NDArray[np.float64]:
    return _bars(
        ((ax + bx) / 2.0, (ay + by) / 2.0, atan2(by - ay, bx - ax), hypot(bx - ax, by - ay), width)
        for (ax, ay), (bx, by) in pairwise(points)
    )


def _placed(pose: Pose2, rows: Iterable[tuple[float, float, float, float, float]]) -> NDArray[np.float64]:
    """Bars given in the frame of `pose`."""
    return _bars((*placed(pose, x, y), yaw + pose.yaw, length, width) for x, y, yaw, length, width in rows)


def _dock(dock: Pose2) -> list[Layer]:
    """A green pad within a frame of hazard stripes, with a flash on it; the robot's outline fits inside."""
    length, width, stripe = 1.5, 0.9, 0.1
    edges = [(0.0, side * width / 2.0, 0.0, length + stripe, stripe) for side in (-1, 1)]
    edges += [(side * length / 2.0, 0.0, pi / 2.0, width + stripe, stripe) for side in (-1, 1)]
    stripes = [
        (x, side * width / 2.0, 0.0, 0.1, stripe) for side in (-1, 1) for x in np.arange(-0.7, 0.75, 0.2).tolist()
    ]
    stripes += [
        (side * length / 2.0, y, pi / 2.0, 0.1, stripe) for side in (-1, 1) for y in np.arange(-0.4, 0.45, 0.2).tolist()
    ]
    flash = ((0.26, 0.08), (-0.03, -0.06), (0.03, 0.06), (-0.26, -0.08))
    return [
        Layer(palette.CHARGE, _placed(dock, [(0.0, 0.0, 0.0, length - stripe, width - stripe)]), opacity=0.4),
        Layer(palette.HAZARD, _placed(dock, edges)),
        Layer(palette.BLACK, _placed(dock, stripes)),
        Layer(palette.WHITE, _placed(dock, (tuple(bar) for bar in _line(flash, 0.06).tolist()))),
    ]


def _patrol(scene: Scene) -> list[Layer]:
    """A ring at every waypoint, with a notch that shows the heading."""
    turns = np.linspace(0.0, 2.0 * pi, 33).tolist()
    rings = [_line([(p.x + 0.28 * cos(a), p.y + 0.28 * sin(a)) for a in turns], 0.045) for p in scene.patrol]
    notches = [_placed(p, [(0.36, 0.0, 0.0, 0.18, 0.045)]) for p in scene.patrol]
    return [Layer(palette.WHITE, np.vstack((_bars(()), *rings, *notches)), opacity=0.9, rounded=True)]


def _plan(path: Points) -> list[Layer]:
    """A blue band with white chevrons that point the way."""
    chevrons: list[tuple[float, float, float, float, float]] = []
    for x, y, yaw in _every(path, 0.45, 0.3):
        for side in (-1, 1):
            turn = yaw + side * 0.75
            chevrons.append((x - 0.045 * cos(turn), y - 0.045 * sin(turn), turn, 0.11, 0.028))
    return [
        Layer(palette.PATH, _line(path, 0.16), opacity=0.85, rounded=True),
        Layer(palette.WHITE, _bars(chevrons), opacity=0.9, rounded=True),
    ]


def _trail(recording: Recording) -> list[Layer]:
    """A thin line where the body went, and a mark wherever a foot came down."""
    line = [(x, y) for x, y, _ in _every(recording.trail, 0.15, 0.0)]
    prints = _bars((x, y, 0.0, 0.0, 0.062) for x, y in recording.footprints)
    return [
        Layer(palette.PRINT, prints, opacity=0.55, rounded=True),
        Layer(palette.TRAIL, _line(line, 0.035), opacity=0.9, rounded=True),
    ]


def _every(points: Points, spacing: float, first: float) -> list[tuple[float, float, float]]:
    """Points at equal spacing along a line, with the line's direction there."""
    found: list[tuple[float, float, float]] = []
    left = first
    for (ax, ay), (bx, by) in pairwise(points):
        length = hypot(bx - ax, by - ay)
        while left <= length and length > 0.0:
            share = left / length
            found.append((ax + share * (bx - ax), ay + share * (by - ay), atan2(by - ay, bx - ax)))
            left += spacing
        left -= length
    return found
