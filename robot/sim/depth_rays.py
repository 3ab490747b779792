"""The ideal depth camera: exact distances along rays in any direction, to floor, pits and ramps and to all that stands or hangs on them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import lru_cache
from math import cos, hypot, sin

import numpy as np

from robot.geometry.vectors import Floats
from robot.scenes.scene import Box, Cylinder, Obstacle, Pit
from robot.scenes.terrain import Ramp

AT_ONCE = 8192
"""Distances that are computed at once: few calls of numpy, and what they write stays in the processor's cache."""


def sight(
    obstacles: Sequence[Obstacle],
    pits: Sequence[Pit],
    eye: Floats,
    rays: Floats,
    farthest: float,
    terrain: Sequence[Ramp] = (),
) -> Floats:
    """Length (m) of every ray from `eye`, (3,) or one a ray, (n, 3), until it meets something, inf for nothing within `farthest`.

    `rays` are unit vectors, shape (n, 3). Exact to rounding. The eyes are above the ground, and in no obstacle.
    """
    eye = eye.T  # its rows are x, y and z, whether of one eye or of many
    with np.errstate(divide="ignore", invalid="ignore"):
        met = _floor(pits, eye, rays)
        for kind, meet in ((Box, _boxes), (Cylinder, _cylinders)):
            columns = _near(_columns(tuple(obstacles), kind), eye, farthest)
            at_once = max(1, AT_ONCE // max(1, len(rays)))
            for first in range(0, len(columns), at_once):
                np.fmin(met, meet(columns[first : first + at_once], eye, rays).min(axis=0), out=met)
        for piece in terrain:
            np.fmin(met, _ramp(piece, eye, rays), out=met)
    met[met > farthest] = np.inf
    return met


@lru_cache(maxsize=64)
def _columns(obstacles: tuple[Obstacle, ...], kind: type[Obstacle]) -> Floats:
    """The obstacles of a kind, one a row: x, y, how far it reaches from there, underside, top, then what else the kind has."""
    rows = [
        (one.x, one.y, hypot(one.length, one.width) / 2, one.bottom, one.height, cos(one.yaw), sin(one.yaw), one.length / 2, one.width / 2)
        if isinstance(one, Box)
        else (one.x, one.y, one.radius, one.bottom, one.height)
        for one in obstacles
        if isinstance(one, kind)
    ]  # fmt: skip
    return np.array(rows, dtype=np.float64)


def _near(columns: Floats, eye: Floats, farthest: float) -> Floats:
    """Those of which a part is near enough to be seen."""
    if not len(columns):
        return columns
    x, y, reach = (column[:, None] for column in columns.T[:3])
    near: Floats = columns[(np.hypot(x - eye[0], y - eye[1]) - reach).min(axis=1) < farthest]
    return near


def _floor(pits: Sequence[Pit], eye: Floats, rays: Floats) -> Floats:
    met = np.where(rays[:, 2] < 0.0, -eye[2] / rays[:, 2], np.inf)
    for pit in pits:
        with np.errstate(invalid="ignore"):
            x, y = eye[0] + met * rays[:, 0] - pit.x, eye[1] + met * rays[:, 1] - pit.y
        inside = np.flatnonzero((np.abs(x) < pit.length / 2) & (np.abs(y) < pit.width / 2))
        if len(inside):
            into = rays[inside]
            above = eye[:, inside] if eye.ndim > 1 else eye
            wall_x = (np.copysign(pit.length / 2, into[:, 0]) + pit.x - above[0]) / into[:, 0]
            wall_y = (np.copysign(pit.width / 2, into[:, 1]) + pit.y - above[1]) / into[:, 1]
            met[inside] = np.fmin(np.fmin(wall_x, wall_y), -(above[2] + pit.depth) / into[:, 2])
    return met


def _boxes(columns: Floats, eye: Floats, rays: Floats) -> Floats:
    """How far each ray is from each box, a row for each box."""
    x, y, _, bottom, top, c, s, half_length, half_width = (column[:, None] for column in columns.T)
    dx, dy, (ux, uy, uz) = eye[0] - x, eye[1] - y, rays.T
    start = (c * dx + s * dy, c * dy - s * dx, eye[2] - (bottom + top) / 2)
    along = (c * ux + s * uy, c * uy - s * ux, uz)
    return _between_faces(start, along, (half_length, half_width, (top - bottom) / 2))


def _ramp(ramp: Ramp, eye: Floats, rays: Floats) -> Floats:
    middle, half = ramp.box
    c, s, level, up = cos(ramp.yaw), sin(ramp.yaw), cos(ramp.rise), sin(ramp.rise)
    # own axes as rows: along the slope, across it, and out of it
    axes = np.array([(level * c, level * s, up), (-s, c, 0.0), (-up * c, -up * s, level)])
    return _between_faces(axes @ (eye.T - np.array(middle)).T, axes @ rays.T, half)


def _between_faces(start: Iterable[Floats], along: Iterable[Floats], halves: Iterable[Floats | float]) -> Floats:
    """The slab method in a box's own axes. A ray along two faces gives both as infinitely far, on different sides only if it runs between
    them; one in the very plane of a face, NaN for that one, meets nothing.
    """
    enter, leave = np.array(-np.inf), np.array(np.inf)
    for p, u, h in zip(start, along, halves, strict=True):
        inverse = 1.0 / u
        one, other = (-h - p) * inverse, (h - p) * inverse
        enter, leave = np.fmax(enter, np.fmin(one, other)), np.fmin(leave, np.fmax(one, other))
    return np.where((leave >= enter) & (enter >= 0.0), enter, np.inf)


def _cylinders(columns: Floats, eye: Floats, rays: Floats) -> Floats:
    """How far each ray is from each cylinder, a row for each cylinder."""
    x, y, radius, bottom, top = (column[:, None] for column in columns.T)
    dx, dy, (ux, uy, uz) = eye[0] - x, eye[1] - y, rays.T
    flat = ux**2 + uy**2
    along = dx * ux + dy * uy
    under = along**2 - flat * (dx * dx + dy * dy - radius**2)
    root = np.sqrt(np.maximum(under, 0.0))
    one, other = (bottom - eye[2]) / uz, (top - eye[2]) / uz
    enter = np.fmax((-along - root) / flat, np.fmin(one, other))
    leave = np.fmin((-along + root) / flat, np.fmax(one, other))
    return np.where((under > 0.0) & (leave >= enter) & (enter >= 0.0), enter, np.inf)
