"""The picture of a stage: a lamp with soft shadows, light from the sky and the floor, a floor that mirrors a little."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robot.picture import palette
from robot.picture.camera import Camera
from robot.picture.floor import Layer, paint
from robot.picture.solids import Floats, Solid
from robot.picture.tracer import CHUNK, FLOOR, NOTHING, Hits, lit, nearest, openness
from robot.png import Image

TILE = 16
"""A chunk of rays is a tile of 16 x 16 pixels."""
SAMPLES = (
    (0.0625, 0.4375), (0.1875, 0.8125), (0.3125, 0.1875), (0.4375, 0.6875),
    (0.5625, 0.0625), (0.6875, 0.5625), (0.8125, 0.9375), (0.9375, 0.3125),
)  # fmt: skip
"""Where a pixel on an edge is looked at: eight places, no two in one row or column."""
EDGE = 0.035
"""Neighbouring pixels that differ by more than this in brightness (0..1) are an edge."""
BLOCK = 2048 * CHUNK
"""At most so many rays at once: keeps the memory bounded."""

LAMP = np.array((-0.42, -0.55, 0.90), dtype=np.float32) / np.linalg.norm((-0.42, -0.55, 0.90)).astype(np.float32)
LAMP_LIGHT = np.array((2.55, 2.28, 1.9), dtype=np.float32)[:, None]
SOFTNESS = 0.05
SKY_LIGHT = np.array((0.62, 0.67, 0.74), dtype=np.float32)[:, None]
FLOOR_LIGHT = np.array((0.46, 0.38, 0.29), dtype=np.float32)[:, None]
MIRROR, MIRROR_REACH = 0.4, 0.5
"""How much of Fresnel's reflection the floor's polish keeps, and the distance (m) over which 63 % of an image blurs away."""
HAZE_FROM, HAZE_OVER = 6.0, 26.0
"""Distance (m) where the air begins to be seen, and over which it takes 63 %."""


@dataclass(frozen=True, slots=True, eq=False)
class Stage:
    """All there is to see."""

    solids: Sequence[Solid]
    layers: Sequence[Layer]


def render(stage: Stage, camera: Camera) -> Image:
    """The image the camera sees, the same for the same stage. Pixels on edges are looked at eight times, others once."""
    columns, rows = -(-camera.width // TILE), -(-camera.height // TILE)
    shape = (rows * TILE, columns * TILE)
    y, x = (_tiled(grid).astype(np.float32) for grid in np.indices(shape))
    light, what = _look(stage, camera, x + np.float32(0.5), y + np.float32(0.5))
    shown = _tone(light)
    edges = _tiled(_edges(_untiled(shown.mean(axis=0), shape), _untiled(what, shape)))
    fine = np.flatnonzero(edges & (x < camera.width) & (y < camera.height))
    if fine.size:
        offsets = np.array(SAMPLES, dtype=np.float32)
        light, _ = _look(stage, camera, *((v[fine, None] + offsets[:, k]).ravel() for k, v in enumerate((x, y))))
        shown[:, fine] = _tone(light).reshape(3, -1, len(SAMPLES)).mean(axis=2)
    image = np.stack([_untiled(channel, shape) for channel in shown], axis=2)
    result: Image = (image[: camera.height, : camera.width] * 255.0 + 0.5).astype(np.uint8)
    return result


def _tiled(grid: NDArray[Any]) -> NDArray[Any]:
    """The pixels of an image, tile after tile."""
    height, width = grid.shape
    return grid.reshape(height // TILE, TILE, width // TILE, TILE).swapaxes(1, 2).ravel()


def _untiled(values: NDArray[Any], shape: tuple[int, int]) -> NDArray[Any]:
    height, width = shape
    return values.reshape(height // TILE, width // TILE, TILE, TILE).swapaxes(1, 2).reshape(shape)


def _edges(bright: Floats, what: NDArray[np.int16]) -> NDArray[np.bool_]:
    """Where solids meet something else, and where one solid's brightness jumps. The floor's paint is smooth by itself."""
    found = np.zeros(what.shape, dtype=np.bool_)
    for axis in (0, 1):
        solid = np.minimum(np.roll(what, -1, axis), what) >= 0
        jump = np.abs(np.diff(bright, axis=axis)) > EDGE
        step = (jump & (solid[:-1] if axis == 0 else solid[:, :-1])) | (np.diff(what, axis=axis) != 0)
        before, after = [slice(None)] * 2, [slice(None)] * 2
        before[axis], after[axis] = slice(None, -1), slice(1, None)
        found[tuple(before)] |= step
        found[tuple(after)] |= step
    return found


def _look(stage: Stage, camera: Camera, x: Floats, y: Floats) -> tuple[Floats, NDArray[np.int16]]:
    """Light and what is seen at image points, shapes (3, n) and (n,)."""
    count = x.size
    lacking = -count % CHUNK
    x, y = np.pad(x, (0, lacking), mode="edge"), np.pad(y, (0, lacking), mode="edge")
    light, what = np.empty((3, x.size), dtype=np.float32), np.empty(x.size, dtype=np.int16)
    eye = camera.eye[:, None].astype(np.float32)
    for start in range(0, x.size, BLOCK):
        block = slice(start, start + BLOCK)
        rays = camera.rays(x[block], y[block])
        hits = nearest(stage.solids, eye, rays)
        what[block] = hits.what
        alike = np.argsort(hits.what, kind="stable")  # chunks of one surface are compact, and few others come near them
        light[:, start + alike] = _shade(stage, hits.taken(alike), rays[:, alike], camera.pixel)
    return light[:, :count], what[:count]


def _shade(stage: Stage, hits: Hits, rays: Floats, pixel: float) -> Floats:
    shadow = lit(stage.solids, hits, LAMP, SOFTNESS)
    free = openness(stage.solids, hits)
    light = _light(stage, hits, rays, hits.along * np.float32(pixel), shadow, free)
    light = _mirrored(stage, hits, rays, light)
    away = np.clip((hits.along - HAZE_FROM) / HAZE_OVER, 0.0, 8.0)
    haze = (1.0 - np.exp(-away)).astype(np.float32)
    light += haze * (_background(rays) - light)
    return light


def _light(stage: Stage, hits: Hits, rays: Floats, width: Floats, shadow: Floats, free: Floats) -> Floats:
    """Light that leaves each point towards the eye; `width` is a pixel's width there, across the ray."""
    colour, gloss = _surface(stage, hits, rays, width)
    facing = np.maximum((hits.normals * LAMP[:, None]).sum(axis=0), 0.0) * shadow
    upward = hits.normals[2] * np.float32(0.5) + np.float32(0.5)
    ambient = (FLOOR_LIGHT + upward * (SKY_LIGHT - FLOOR_LIGHT)) * free
    light: Floats = colour * (LAMP_LIGHT * facing + ambient)
    halfway = LAMP[:, None] - rays
    halfway /= np.sqrt((halfway * halfway).sum(axis=0))
    shine = np.clip((hits.normals * halfway).sum(axis=0), 0.0, 1.0) ** 48
    light += gloss * shadow * shine * LAMP_LIGHT * np.float32(0.5)
    rim = (1.0 + (hits.normals * rays).sum(axis=0)).clip(0.0, 1.0) ** 4
    light += gloss * free * rim * SKY_LIGHT * np.float32(0.35)
    missing = hits.what == NOTHING
    light[:, missing] = _background(rays[:, missing])
    return light


def _surface(stage: Stage, hits: Hits, rays: Floats, width: Floats) -> tuple[Floats, Floats]:
    colours = np.array([*(solid.colour for solid in stage.solids), palette.WHITE, palette.WHITE], dtype=np.float32)
    glosses = np.array([*(solid.gloss for solid in stage.solids), 0.0, 0.0], dtype=np.float32)
    colour, gloss = np.ascontiguousarray(colours[hits.what].T), glosses[hits.what]
    floor = hits.what == FLOOR
    chunks = np.flatnonzero(floor.reshape(-1, CHUNK).any(axis=1))
    if chunks.size:

        def of(values: Floats) -> Floats:
            return np.where(floor, values, 0.0).astype(np.float32).reshape(-1, CHUNK)[chunks].ravel()

        steep = np.sqrt(np.maximum(-rays[2], np.float32(0.02)))
        painted = paint(
            stage.layers, of(hits.points[0]), of(hits.points[1]), np.maximum(of(width / steep), np.float32(1e-5))
        )
        mine = floor.reshape(-1, CHUNK)[chunks].ravel()
        places = (chunks[:, None] * CHUNK + np.arange(CHUNK)).ravel()[mine]
        colour[:, places] = painted[:, mine]
    return colour, gloss


def _mirrored(stage: Stage, hits: Hits, rays: Floats, light: Floats) -> Floats:
    """The floor is polished: it shows, faintly, what stands on it."""
    floor = np.flatnonzero((hits.what == FLOOR).reshape(-1, CHUNK).any(axis=1))
    if not floor.size:
        return light

    def of(values: Floats) -> Floats:
        return values.reshape(3, -1, CHUNK)[:, floor].reshape(3, -1)

    down = of(rays)
    up = down * np.array((1.0, 1.0, -1.0), dtype=np.float32)[:, None]
    up[2] = np.maximum(up[2], np.float32(1e-3))
    points = of(hits.points)
    points[2] = 1e-3
    seen = nearest(stage.solids, points, up, reach=3.0 * MIRROR_REACH)
    ones = np.ones(seen.what.shape, dtype=np.float32)
    shown = _light(stage, seen, up, seen.along, ones * np.float32(0.6), ones * np.float32(0.7))
    shown = _background(up) + np.exp(-seen.along / np.float32(MIRROR_REACH)) * (shown - _background(up))
    strength = np.float32(MIRROR) * (np.float32(0.04) + np.float32(0.96) * (1.0 - up[2]) ** 5)
    mine = (hits.what == FLOOR).reshape(-1, CHUNK)[floor].ravel()
    places = (floor[:, None] * CHUNK + np.arange(CHUNK)).ravel()[mine]
    light[:, places] += strength[mine] * (shown[:, mine] - light[:, places])
    return light


def _background(rays: Floats) -> Floats:
    """Warm haze at the horizon, a cooler light above."""
    high = np.clip(rays[2] * 1.6, 0.0, 1.0)[None, :]
    low, top = (np.array(colour, dtype=np.float32)[:, None] for colour in (palette.HAZE, palette.SKY))
    result: Floats = (low + high * (top - low)).astype(np.float32) * np.float32(1.25)
    return result


def _tone(light: Floats) -> Floats:
    """Light as a screen shows it: highlights rolled off (Narkowicz's fit of the ACES curve), then sRGB's curve; 0..1."""
    x = light * np.float32(0.56)
    filmic = np.clip((x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14), 0.0, 1.0)
    result: Floats = np.where(filmic <= 0.0031308, 12.92 * filmic, 1.055 * filmic ** (1.0 / 2.4) - 0.055).astype(
        np.float32
    )
    return result
