"""The distribution of a body wrench over the standing feet: weighted least squares, then each force into its friction cone.

With the wrench w = [F; M] and A = [1 ... 1; hat(r1) ... hat(rn)] of the arms ri, the forces f minimise

    (A f - w)' W (A f - w) + EFFORT f' f            W = diag(IMPORTANCE)

See docs/concepts/control.md#force-distribution, with sources.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot, sqrt

from robot.geometry.vectors import Triple

IMPORTANCE = (1.0, 1.0, 9.0, 100.0, 100.0, 16.0)
"""Diagonal of W: force x, y, z (N) and moment x, y, z (N m). Moments in roll and pitch count 100 times a horizontal force."""
EFFORT = 1e-3
"""Weight of the forces themselves: it makes the problem regular where two feet leave a moment free."""
LEAST, MOST = 10.0, 600.0
"""Bounds of a standing foot's vertical force under the reference body, N."""
FRICTION = 0.6
"""Half-width of the friction cone on level ground: force along the ground per force into it."""
STEEP_FRICTION = 0.3
"""How much wider the cone is on a slope, per rise: a steep slope is taken for a rough one."""

_SLACK = tuple(EFFORT / weight for weight in IMPORTANCE)


def distribute(
    arms: Sequence[Triple],
    wrench: Sequence[float],
    slope: tuple[float, float] = (0.0, 0.0),
    friction_shares: Sequence[float] = (1.0,) * 4,
    share: float = 1.0,
) -> list[Triple]:
    """Ground forces at contact points `arms` (from the centre of mass) that best give `wrench` (force, moment about it; six numbers).

    Regularised least squares; if some feet would have to pull, once more with the others alone. Then each force is bounded along the ground's
    normal and to the friction cone around it. Axes: any, z vertical; `slope` is the ground's rise per metre along x and y; `friction_shares` are
    the shares of the usual friction that the feet may use; `share` is the robot's mass over the reference body's, for whose feet the bounds are. Units N and m.
    """
    steepness = hypot(*slope)
    length = sqrt(1.0 + steepness * steepness)
    up = (-slope[0] / length, -slope[1] / length, 1.0 / length)
    friction = FRICTION + STEEP_FRICTION * steepness
    forces = _without_bounds(arms, wrench)
    pulled = [x * up[0] + y * up[1] + z * up[2] < 0.0 for x, y, z in forces]
    pushing = [arm for arm, pulls in zip(arms, pulled, strict=True) if not pulls]
    if 1 < len(pushing) < len(arms):
        again = iter(_without_bounds(pushing, wrench))
        forces = [force if pulls else next(again) for force, pulls in zip(forces, pulled, strict=True)]
    return [
        _into_friction_cone(force, up, friction * grip, share)
        for force, grip in zip(forces, friction_shares, strict=False)
    ]


def _without_bounds(arms: Sequence[Triple], wrench: Sequence[float]) -> list[Triple]:
    """The forces that best give the wrench, whatever the ground can give."""
    fx, fy, fz, mx, my, mz = _dual_solution(arms, wrench)
    return [(fx + my * z - mz * y, fy + mz * x - mx * z, fz + mx * y - my * x) for x, y, z in arms]


def _dual_solution(arms: Sequence[Triple], wrench: Sequence[float]) -> list[float]:
    """The multipliers u of the dual problem: forces f = A' u with (A A' + EFFORT W^-1) u = wrench. Six unknowns for any number of
    feet, and A A' is known in closed form. Solved by Cholesky's method: the matrix is symmetric and positive definite.
    """
    sx = sy = sz = xx = yy = zz = xy = xz = yz = 0.0
    for x, y, z in arms:
        sx, sy, sz = sx + x, sy + y, sz + z
        xx, yy, zz = xx + x * x, yy + y * y, zz + z * z
        xy, xz, yz = xy + x * y, xz + x * z, yz + y * z
    count = float(len(arms))
    a, b, c, d, e, f = _SLACK
    rows = (
        (count + a,),
        (0.0, count + b),
        (0.0, 0.0, count + c),
        (0.0, -sz, sy, yy + zz + d),
        (sz, 0.0, -sx, -xy, xx + zz + e),
        (-sy, sx, 0.0, -xz, -yz, xx + yy + f),
    )
    return solve_definite(rows, wrench)


def solve_definite(rows: Sequence[Sequence[float]], right: Sequence[float]) -> list[float]:
    """The solution of a symmetric positive definite system; `rows` hold its lower triangle. Cholesky, in plain floats: for so few
    unknowns a call of a linear algebra library costs more than the arithmetic.
    """
    lower: list[list[float]] = []
    half: list[float] = []
    for i, row in enumerate(rows):
        made: list[float] = []
        for j, value in enumerate(row[:-1]):
            other = lower[j]
            for k in range(j):
                value -= made[k] * other[k]
            made.append(value / other[j])
        pivot = row[i]
        value = right[i]
        for k, entry in enumerate(made):
            pivot -= entry * entry
            value -= entry * half[k]
        root = sqrt(pivot)
        made.append(root)
        lower.append(made)
        half.append(value / root)
    for i in range(len(half) - 1, -1, -1):
        value = half[i]
        for k in range(i + 1, len(half)):
            value -= lower[k][i] * half[k]
        half[i] = value / lower[i][i]
    return half


def _into_friction_cone(force: Triple, up: Triple, friction: float, share: float) -> Triple:
    """The force with its normal part within `LEAST` and `MOST`, and the rest scaled down into the friction cone around `up`."""
    x, y, z = force
    ux, uy, uz = up
    pressing = x * ux + y * uy + z * uz
    x, y, z = x - pressing * ux, y - pressing * uy, z - pressing * uz
    pressing = max(share * LEAST, min(share * MOST, pressing))
    sideways = sqrt(x * x + y * y + z * z)
    scale = min(1.0, friction * pressing / sideways) if sideways > 0.0 else 1.0
    return (x * scale + pressing * ux, y * scale + pressing * uy, z * scale + pressing * uz)
