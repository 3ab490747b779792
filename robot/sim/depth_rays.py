"""The ideal depth camera: exact distances along rays in any direction, to floor, pits and ramps and to all that stands or hangs on them."""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, hypot, sin

import numpy as np

from robot.geometry.planar import turned_back
from robot.geometry.vectors import Floats
from robot.scenes.scene import Box, Cylinder, Obstacle, Pit
from robot.scenes.terrain import Ramp


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
        for one in obstacles:
            if np.min(np.hypot(one.x - eye[0], one.y - eye[1])) - _reach(one) < farthest:
                np.fmin(met, _box(one, eye, rays) if isinstance(one, Box) else _cylinder(one, eye, rays), out=met)
        for piece in terrain:
            np.fmin(met, _ramp(piece, eye, rays), out=met)
    met[met > farthest] = np.inf
    return met


def _reach(obstacle: Obstacle) -> float:
    return obstacle.radius if isinstance(obstacle, Cylinder) else hypot(obstacle.length, obstacle.width) / 2


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


def _box(box: Box, eye: Floats, rays: Floats) -> Floats:
    start = (*turned_back(box.yaw, eye[0] - box.x, eye[1] - box.y), eye[2] - (box.bottom + box.height) / 2)
    along = (*turned_back(box.yaw, rays[:, 0], rays[:, 1]), rays[:, 2])
    return _between_faces(start, along, (box.length / 2, box.width / 2, (box.height - box.bottom) / 2))


def _ramp(ramp: Ramp, eye: Floats, rays: Floats) -> Floats:
    middle, half = ramp.box
    c, s, level, up = cos(ramp.yaw), sin(ramp.yaw), cos(ramp.rise), sin(ramp.rise)
    # own axes as rows: along the slope, across it, and out of it
    axes = np.array([(level * c, level * s, up), (-s, c, 0.0), (-up * c, -up * s, level)])
    return _between_faces(axes @ (eye.T - np.array(middle)).T, axes @ rays.T, half)


def _between_faces(
    start: Sequence[float] | Floats, along: Sequence[Floats] | Floats, halves: Sequence[float]
) -> Floats:
    """The slab method in a box's own axes. A ray along two faces gives both as infinitely far, on different sides only if it runs between
    them; one in the very plane of a face, NaN for that one, meets nothing.
    """
    enter, leave = np.full(len(along[0]), -np.inf), np.full(len(along[0]), np.inf)
    for p, u, h in zip(start, along, halves, strict=True):
        inverse = 1.0 / u
        one, other = (-h - p) * inverse, (h - p) * inverse
        np.fmax(enter, np.fmin(one, other), out=enter)
        np.fmin(leave, np.fmax(one, other), out=leave)
    return np.where((leave >= enter) & (enter >= 0.0), enter, np.inf)


def _cylinder(cylinder: Cylinder, eye: Floats, rays: Floats) -> Floats:
    dx, dy = eye[0] - cylinder.x, eye[1] - cylinder.y
    flat = rays[:, 0] ** 2 + rays[:, 1] ** 2
    along = dx * rays[:, 0] + dy * rays[:, 1]
    under = along**2 - flat * (dx * dx + dy * dy - cylinder.radius**2)
    root = np.sqrt(np.maximum(under, 0.0))
    level = np.sort(np.stack([(edge - eye[2]) / rays[:, 2] for edge in (cylinder.bottom, cylinder.height)]), axis=0)
    enter = np.fmax((-along - root) / flat, level[0])
    leave = np.fmin((-along + root) / flat, level[1])
    return np.where((under > 0.0) & (leave >= enter) & (enter >= 0.0), enter, np.inf)
