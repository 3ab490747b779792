"""Unit quaternions (w, x, y, z) as tuples of floats. Slerp: Shoemake, "Animating rotation with quaternion curves" (1985)."""

from __future__ import annotations

from math import acos, asin, atan2, copysign, cos, hypot, pi, sin
from typing import TypeAlias

Triple: TypeAlias = tuple[float, float, float]
"""x, y, z."""
Quad: TypeAlias = tuple[float, float, float, float]
"""A quaternion (w, x, y, z)."""

NEARLY_ALIGNED = 1.0 - 1e-9
"""Above this cosine of the half angle, slerp divides by next to nothing; a straight line is exact to rounding."""
NEARLY_UPRIGHT = 1.0 - 1e-12
"""Above this sine of the pitch, roll and yaw turn about the same axis."""


def product(a: Quad, b: Quad) -> Quad:
    """First the rotation `b`, then `a`."""
    aw, ax, ay, az = a
    bw, bx, by, bz = b
    return (
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    )


def unit(q: Quad) -> Quad:
    """The same direction at length 1."""
    w, x, y, z = q
    scale = 1.0 / hypot(w, x, y, z)
    return (w * scale, x * scale, y * scale, z * scale)


def rotated(q: Quad, p: Triple) -> Triple:
    """The vector `p` rotated: p + 2 w (v x p) + 2 v x (v x p)."""
    w, x, y, z = q
    px, py, pz = p
    cx, cy, cz = 2.0 * (y * pz - z * py), 2.0 * (z * px - x * pz), 2.0 * (x * py - y * px)
    return (px + w * cx + y * cz - z * cy, py + w * cy + z * cx - x * cz, pz + w * cz + x * cy - y * cx)


def between(a: Quad, b: Quad, share: float) -> Quad:
    """The rotation that lies `share` (0..1) of the way from `a` to `b`, at constant angular speed, the short way round."""
    aw, ax, ay, az = a
    bw, bx, by, bz = b
    cosine = aw * bw + ax * bx + ay * by + az * bz
    sign = 1.0
    if cosine < 0.0:  # both q and -q are the same rotation: take the nearer one
        cosine, sign = -cosine, -1.0
    if cosine > NEARLY_ALIGNED:
        first, second = 1.0 - share, sign * share
    else:
        angle = acos(cosine)
        first, second = sin((1.0 - share) * angle) / sin(angle), sign * sin(share * angle) / sin(angle)
    return unit(
        (first * aw + second * bw, first * ax + second * bx, first * ay + second * by, first * az + second * bz)
    )


def rotation_vector(q: Quad) -> Triple:
    """The axis of the rotation, times its angle, rad: the short way round."""
    w, x, y, z = q if q[0] >= 0.0 else (-q[0], -q[1], -q[2], -q[3])
    length = hypot(x, y, z)
    scale = 2.0 * atan2(length, w) / length if length else 2.0
    return (scale * x, scale * y, scale * z)


def of_rpy(roll: float, pitch: float, yaw: float) -> Quad:
    """Fixed axes: first roll about x, then pitch about y, then yaw about z, rad."""
    cr, sr, cp, sp, cy, sy = (
        cos(roll / 2),
        sin(roll / 2),
        cos(pitch / 2),
        sin(pitch / 2),
        cos(yaw / 2),
        sin(yaw / 2),
    )
    return (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )


def rpy_of(q: Quad) -> Triple:
    """Roll, pitch and yaw, rad, as `of_rpy` takes them; with the nose straight up or down, roll is 0."""
    w, x, y, z = q
    sine = 2.0 * (w * y - x * z)
    if abs(sine) >= NEARLY_UPRIGHT:
        return (0.0, copysign(pi / 2, sine), -copysign(2.0, sine) * atan2(x, w))
    roll = atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    yaw = atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return (roll, asin(sine), yaw)
