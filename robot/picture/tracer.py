"""Rays against solids: what they meet first, how much of the lamp a point sees, and how open the space around it is.

Rays come in chunks of `CHUNK` neighbours. A chunk is tested as a whole first: rays from within a ball of origins, inside a cone of
directions, can only meet a box if the ray in their middle meets the box grown by the ball and by the cone's width behind the box.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robot.picture.solids import Floats, Solid, distance, enter, normal, slab

CHUNK = 256
NOTHING, FLOOR = -2, -1
DARK = 0.004
"""A point that sees less of the lamp need not be looked at further."""
SHADOW_STEPS = 8
GOLDEN = np.float32(0.6180339887)
TAPS = (0.04, 0.12, 0.3)
TAP_WEIGHTS = (0.5, 0.42, 0.32)
"""How far above a surface the space is probed for openness, m, and how much light each probe takes when it is blocked."""
CLEAR = 2e-3
"""Shadow rays start this far off the surface, m."""

Ints = NDArray[np.int64]
Numbers = NDArray[np.int16]


@dataclass(frozen=True, slots=True, eq=False)
class Hits:
    """What rays meet first, arrays over rays."""

    along: Floats
    """Distance, inf where they meet nothing."""
    what: Numbers
    """Index into the solids, `FLOOR` or `NOTHING`."""
    points: Floats
    normals: Floats
    """(3, n); zero where nothing was met."""

    def taken(self, rays: Ints) -> Hits:
        """These rays in this order."""
        return Hits(self.along[rays], self.what[rays], self.points[:, rays], self.normals[:, rays])


def chunked(values: Floats) -> Floats:
    """An array over rays, (3, n), as (3, chunks, CHUNK)."""
    return values.reshape(3, -1, CHUNK)


class _Bundle:
    """The bounds of every chunk: a ball of origins and a cone of directions, `spread` the tangent of its half angle."""

    def __init__(self, origins: Floats, rays: Floats) -> None:
        self.centres, self.radii = _ball(origins)
        mean = chunked(rays).mean(axis=2)
        self.mean = mean / np.maximum(np.sqrt((mean * mean).sum(axis=0)), np.float32(1e-6))
        nearest_cosine = (chunked(rays) * self.mean[:, :, None]).sum(axis=0).min(axis=1)
        cosine = np.clip(nearest_cosine, np.float32(0.02), np.float32(1.0))
        self.spread = np.sqrt(1.0 - cosine * cosine) / cosine + np.float32(1e-3)

    def meeting(self, solid: Solid, margin: float = 0.0, reach: float = np.inf) -> Ints:
        """Chunks of which a ray may come within `margin` of the solid, on its first `reach` metres."""
        start = solid.local(self.centres)
        way = np.sqrt((start * start).sum(axis=0)) + self.radii + np.float32(solid.radius)
        grown = self.radii + np.float32(margin) + self.spread * np.minimum(way, np.float32(reach))
        near, far = slab(solid.half[:, None].astype(np.float32) + grown, start, solid.turned(self.mean))
        return np.flatnonzero((near <= far) & (far >= 0.0) & (near <= reach))


def _ball(points: Floats) -> tuple[Floats, Floats]:
    """Centres (3, chunks) and radii of balls around the points of every chunk."""
    if points.shape[1] == 1:
        return points, np.zeros(1, dtype=np.float32)
    grouped = chunked(points)
    low, high = grouped.min(axis=2), grouped.max(axis=2)
    half = (high - low) / np.float32(2.0)
    return low + half, np.sqrt((half * half).sum(axis=0))


def _pick(values: Floats, chunks: Ints) -> Floats:
    """The rays of these chunks, (3, n); one origin for all stays one."""
    return values if values.shape[1] == 1 else chunked(values)[:, chunks].reshape(3, -1)


def _rays_of(chunks: Ints) -> Ints:
    """The indices of these chunks' rays."""
    return (chunks[:, None] * CHUNK + np.arange(CHUNK)).ravel()


def nearest(solids: Sequence[Solid], origins: Floats, rays: Floats, reach: float = np.inf) -> Hits:
    """The first surface every ray meets within `reach` (m), the floor z = 0 included.

    Origins have shape (3, n) or (3, 1), unit rays (3, n), n a multiple of CHUNK.
    """
    count = rays.shape[1]
    with np.errstate(divide="ignore", invalid="ignore"):
        along = np.where(rays[2] < 0.0, -origins[2] / rays[2], np.float32(np.inf)).astype(np.float32)
    what = np.where(along < reach, FLOOR, NOTHING).astype(np.int16)
    np.minimum(along, np.float32(reach), out=along)
    bundle = _Bundle(origins, rays)
    middle = origins.mean(axis=1)
    near_first = sorted(range(len(solids)), key=lambda index: float(np.linalg.norm(solids[index].centre - middle)))
    by_chunk, what_by_chunk = along.reshape(-1, CHUNK), what.reshape(-1, CHUNK)
    for index in near_first:
        solid, chunks = solids[index], bundle.meeting(solids[index], reach=reach)
        if not chunks.size:
            continue
        known = by_chunk[chunks].ravel()
        met = enter(solid, solid.local(_pick(origins, chunks)), solid.turned(_pick(rays, chunks)), known)
        better = met < known
        by_chunk[chunks] = np.where(better, met, known).reshape(-1, CHUNK)
        what_by_chunk[chunks] = np.where(better.reshape(-1, CHUNK), np.int16(index), what_by_chunk[chunks])
    along[what == NOTHING] = np.inf
    points = origins + rays * np.where(what == NOTHING, np.float32(0.0), along)
    normals = np.zeros((3, count), dtype=np.float32)
    normals[2, what == FLOOR] = 1.0
    for index in sorted({int(number) for number in np.unique(what) if number >= 0}):
        mine = np.flatnonzero(what == index)
        normals[:, mine] = normal(solids[index], solids[index].local(points[:, mine]))
    return Hits(along, what, points, normals)


def lit(solids: Sequence[Solid], hits: Hits, lamp: Floats, softness: float) -> Floats:
    """How much of the lamp each point sees, 0..1. `lamp` is the direction to it, `softness` the tangent of half its width.

    A ray's distance to a convex solid, divided by the way there, has one minimum along the ray: golden section finds it. That
    quotient against the lamp's half width says how much of the lamp is hidden.
    """
    seen = np.ones(hits.points.shape[1], dtype=np.float32)
    facing = (hits.what != NOTHING) & ((hits.normals * lamp[:, None]).sum(axis=0) > 0.0)
    starts = hits.points + hits.normals * np.float32(CLEAR)
    bundle = _Bundle(starts, np.broadcast_to(lamp[:, None], starts.shape))
    for index, solid in enumerate(solids):
        margin = softness * float(solid.centre[2] + solid.radius) / float(lamp[2])  # from the floor: the longest way
        chunks = bundle.meeting(solid, margin)
        if not chunks.size:
            continue
        wanted = _rays_of(chunks)
        wanted = wanted[facing[wanted] & (hits.what[wanted] != index) & (seen[wanted] > DARK)]
        start = solid.local(starts[:, wanted])
        ray = solid.turned(np.ascontiguousarray(lamp[:, None]))
        near, far = slab((solid.half[:, None] + margin).astype(np.float32), start, ray)
        np.maximum(near, np.float32(CLEAR), out=near)
        met = near < far
        hidden = _clearance(solid, start[:, met], ray, near[met], far[met]) / np.float32(softness)
        places = wanted[met]
        seen[places] = np.minimum(seen[places], _share(np.clip(hidden, -1.0, 1.0)))
    return seen


def _clearance(solid: Solid, start: Floats, ray: Floats, near: Floats, far: Floats) -> Floats:
    """The least of distance / way over [near, far] along each ray."""

    def gap(at: Floats) -> Floats:
        return distance(solid, start + ray * at) / at

    least = np.minimum(gap(near), gap(far))
    width = (far - near) * GOLDEN
    left, right = far - width, near + width
    gap_left, gap_right = gap(left), gap(right)
    for _ in range(SHADOW_STEPS):
        lower = gap_left < gap_right
        near, far = np.where(lower, near, left), np.where(lower, right, far)
        width = (far - near) * GOLDEN
        fresh = np.where(lower, far - width, near + width)
        gap_fresh = gap(fresh)
        left, right = np.where(lower, fresh, right), np.where(lower, left, fresh)
        gap_left, gap_right = np.where(lower, gap_fresh, gap_right), np.where(lower, gap_left, gap_fresh)
    return np.minimum(least, np.minimum(gap_left, gap_right))


def _share(hidden: Floats) -> Floats:
    """The visible share of a lamp whose edge is at `hidden`: -1 all covered, 1 all free."""
    result: Floats = np.float32(0.25) * (1 + hidden) ** 2 * (2 - hidden)
    return result


def openness(solids: Sequence[Solid], hits: Hits) -> Floats:
    """How open the space before each point is, 0..1: probed along the normal against all solids near it and the floor."""
    met = hits.what != NOTHING
    heights = np.array(TAPS, dtype=np.float32)
    gaps = np.minimum(heights[:, None], hits.points[2] + heights[:, None] * hits.normals[2])
    centres, radii = _ball(hits.points)
    for index, solid in enumerate(solids):
        chunks = np.flatnonzero(distance(solid, solid.local(centres)) < radii + np.float32(2.0 * TAPS[-1]))
        rays = _rays_of(chunks)
        rays = rays[hits.what[rays] != index]  # nothing convex stands in its own way
        if not rays.size:
            continue
        start = solid.local(hits.points[:, rays])
        gap, up = distance(solid, start), solid.turned(hits.normals[:, rays])
        for tap in reversed(range(len(TAPS))):
            close = gap < np.float32(2.0 * TAPS[tap])  # others cannot come nearer than `height` within `height`
            start, up, rays, gap = start[:, close], up[:, close], rays[close], gap[close]
            reached = distance(solid, start + up * heights[tap])
            gaps[tap, rays] = np.minimum(gaps[tap, rays], reached)
    closed = np.clip(1.0 - gaps / heights[:, None], 0.0, 1.0)
    weights = np.array(TAP_WEIGHTS, dtype=np.float32)
    free = np.prod(1.0 - weights[:, None] * closed, axis=0)
    result: Floats = np.where(met, free, 1.0).astype(np.float32)
    return result
