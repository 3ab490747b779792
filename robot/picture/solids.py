"""What the renderer can draw: boxes and cylinders with rounded edges. A ball and a capsule are such boxes, rounded all the way.

Points and directions are arrays whose first axis is x, y, z. Distances are exact, metres, negative inside.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from robot.geometry.vectors import Vector

Floats = NDArray[np.floating[Any]]
"""float32 wherever there is one for every ray."""
Colour = tuple[float, float, float]

MARCH_STEPS = 16
TOUCHED = 2e-4
"""A ray this near to a surface has met it, m: far below a pixel."""


@dataclass(frozen=True, slots=True, eq=False)
class Solid:
    """A convex body: a box of half sizes `half` along its own axes, or a cylinder around its own z, its edges rounded off."""

    centre: Vector
    axes: Vector
    """Own axes as columns, orthonormal, shape (3, 3)."""
    half: Vector
    """Half sizes with the rounding, m; a cylinder's radius stands in the first two."""
    rounding: float
    colour: Colour
    """Linear light reflected, 0..1 each."""
    gloss: float = 0.0
    cylinder: bool = False

    @property
    def radius(self) -> float:
        """Of a ball around the centre that holds the solid, m."""
        return float(np.hypot(self.half[0], self.half[2]) if self.cylinder else np.linalg.norm(self.half))

    def local(self, points: Floats) -> Floats:
        """World points, shape (3, n), in own axes."""
        return self.axes.T.astype(np.float32) @ (points - self.centre[:, None].astype(np.float32))

    def turned(self, directions: Floats) -> Floats:
        """World directions in own axes."""
        return self.axes.T.astype(np.float32) @ directions


def box(
    centre: Vector,
    axes: Vector,
    size: tuple[float, float, float],
    colour: Colour,
    rounding: float = 0.0,
    gloss: float = 0.0,
) -> Solid:
    """A box of full side lengths `size`."""
    return Solid(centre, axes, np.array(size) / 2.0, rounding, colour, gloss)


def ball(centre: Vector, radius: float, colour: Colour, gloss: float = 0.0) -> Solid:
    return Solid(centre, np.eye(3), np.full(3, radius), radius, colour, gloss)


def capsule(start: Vector, end: Vector, radius: float, colour: Colour, gloss: float = 0.0) -> Solid:
    """All points within `radius` of the line from `start` to `end`."""
    length = float(np.linalg.norm(end - start))
    half = np.array((radius, radius, length / 2.0 + radius))
    return Solid((start + end) / 2.0, _axes_along(end - start), half, radius, colour, gloss)


def stick(
    start: Vector, end: Vector, radius: float, colour: Colour, rounding: float = 0.0, gloss: float = 0.0
) -> Solid:
    """A cylinder around the line from `start` to `end`."""
    half = np.array((radius, radius, float(np.linalg.norm(end - start)) / 2.0))
    return Solid((start + end) / 2.0, _axes_along(end - start), half, rounding, colour, gloss, cylinder=True)


def _axes_along(direction: Vector) -> Vector:
    """Axes whose z is `direction`; the world's for no direction at all."""
    length = float(np.linalg.norm(direction))
    if length < 1e-9:
        return np.eye(3)
    z: Vector = direction / length
    aside = np.eye(3)[int(np.argmin(np.abs(z)))]
    x = np.asarray(np.cross(z, aside), dtype=np.float64)
    x = x / float(np.linalg.norm(x))
    y: Vector = np.cross(z, x)
    return np.column_stack((x, y, z))


def distance(solid: Solid, points: Floats) -> Floats:
    """From own points, shape (3, n), to the surface."""
    return _rounded(_beyond(solid, points)) - np.float32(solid.rounding)


def _beyond(solid: Solid, points: Floats) -> list[Floats]:
    """How far own points lie beyond the faces of the unrounded core: three rows for a box, two for a cylinder."""
    core = (solid.half - solid.rounding).astype(np.float32)
    if solid.cylinder:
        return [np.hypot(points[0], points[1]) - core[0], np.abs(points[2]) - core[2]]
    return [np.abs(points[axis]) - core[axis] for axis in range(3)]


def _rounded(beyond: list[Floats]) -> Floats:
    """Distance from the core. Written out row by row: numpy reduces short first axes slowly, and this is where the time goes."""
    zero = np.float32(0.0)
    deepest, squared = beyond[0], np.square(np.maximum(beyond[0], zero))
    for row in beyond[1:]:
        deepest = np.maximum(deepest, row)
        squared += np.square(np.maximum(row, zero))
    result: Floats = np.sqrt(squared, out=squared)
    result += np.minimum(deepest, zero)
    return result


def normal(solid: Solid, points: Floats) -> Floats:
    """Outward unit normals, in world axes, at own points (3, n) on or near the surface."""
    beyond = np.stack(_beyond(solid, points))
    outside = np.maximum(beyond, np.float32(0.0))
    flat = ~(outside > 0.0).any(axis=0)
    outside[:, flat] = beyond[:, flat] == beyond[:, flat].max(axis=0)
    if solid.cylinder:
        across = np.maximum(np.hypot(points[0], points[1]), np.float32(1e-9))
        own = np.stack(
            (outside[0] * points[0] / across, outside[0] * points[1] / across, outside[1] * np.sign(points[2]))
        )
    else:
        own = outside * np.sign(points)
    own /= np.maximum(np.sqrt((own * own).sum(axis=0)), np.float32(1e-9))
    result: Floats = solid.axes.astype(np.float32) @ own
    return result


def slab(half: Floats, origins: Floats, rays: Floats) -> tuple[Floats, Floats]:
    """Where own rays enter and leave the box of half sizes `half`, (3, 1) or one for each; they miss it where the first is larger."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        inverse = np.float32(1.0) / rays
        span = np.abs(inverse) * half
        middle = -origins * inverse
        low, high = middle - span, middle + span
    return np.fmax(np.fmax(low[0], low[1]), low[2]), np.fmin(np.fmin(high[0], high[1]), high[2])


def enter(solid: Solid, origins: Floats, rays: Floats, limit: Floats) -> Floats:
    """Where rays, given in own axes with origins (3, n) or (3, 1), first meet the surface; inf for a miss or beyond `limit`.

    Along a ray the distance to a convex solid is a convex function of the way: the secant through two points reaches zero no
    later than the distance does, so it never steps through the surface, and a distance that grows never falls again.
    """
    near, far = slab(solid.half[:, None].astype(np.float32), origins, rays)
    np.maximum(near, np.float32(0.0), out=near)
    met = (near <= far) & (near < limit)
    result = np.full(near.shape, np.inf, dtype=np.float32)
    if solid.rounding == 0.0 and not solid.cylinder:
        result[met] = near[met]
        return result
    which = np.flatnonzero(met)
    start = np.broadcast_to(origins, rays.shape)[:, which]
    ray, at, end = rays[:, which], near[which], far[which]
    last, step = np.full(at.shape, np.inf, dtype=np.float32), np.ones_like(at)
    for _ in range(MARCH_STEPS):
        if not which.size:
            break
        gap = distance(solid, start + ray * at)
        touched = gap < TOUCHED
        result[which[touched]] = at[touched]
        step = np.where(np.isinf(last), gap, gap * step / np.maximum(last - gap, np.float32(1e-9)))
        going = ~touched & (at <= end) & (gap < last)
        which, start, ray, end = which[going], start[:, going], ray[:, going], end[going]
        at, step, last = (at + step)[going], step[going], gap[going]
    return result
