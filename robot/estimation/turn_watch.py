"""Whether the gyro can be believed: it has to show the turn that the standing feet show, as these do not move over the ground.

Each standing foot tells the velocity of the body, by its leg's joints and by the gyro. With a gyro that is right all feet tell the same. With one that
is wrong by e, they differ by e x the arm between them; so e is found by least squares over the feet, and over a moment of walking, as two feet show
nothing of a turn about the line between them. Equations: docs/concepts/control.md#a-wrong-gyro.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from math import exp, hypot
from typing import Final

from robot.geometry.vectors import Triple

MEMORY: Final = 0.03
"""Time constant of the least squares, s: longer than the noise of the joints' speeds, shorter than half a stride."""
POWER_MEMORY: Final = 0.1
"""Time constant over which its square is averaged, s: an error that changes its sign with every step counts as one that stays."""
UNSEEN: Final = 4.5e-4
"""Tikhonov term of the least squares, m2 s: what no foot has shown for a while is no error."""
LIMITS: Final = (0.06, 0.06, 0.15)
"""Root mean square of the error about x, y and z of odom from which on the gyro is wrong, rad/s: feet slip about z more easily."""
LASTING: Final = 0.03
"""Seconds for which that has to last: an encoder that has just frozen is found before."""
QUIET: Final = 0.05
"""A gyro that shows no more than this (rad/s) at rest may be right: its bias and 20 times its noise."""
QUIET_TIME: Final = 0.5
"""Seconds for which it has to show that."""
FEET: Final = 2
"""So many standing feet show a turn."""
APART: Final = 0.15
"""Two feet that come nearer or go apart faster than this, m/s, do not both stand: no turn changes the distance between them; chosen: four times the noise."""
SLIDING: Final = 0.1
"""For so long after that the feet tell nothing, s; chosen: a foot that slips off an edge has found the ground again."""

DOUBT: Final = 0.6
"""Share of its limit from which on an axis of a gyro that is wrong is not believed, either."""
RIGHT: Final = (False, False, False)
_NONE: Triple = (0.0, 0.0, 0.0)


class TurnWatch:
    """Call `check` at each control step with an IMU that gives samples.

    Once `wrong`, it stays so until `sits` has seen the robot sit: most wrong gyros look right again as soon as the body does not turn.
    """

    __slots__ = ("_exceeding", "_inertia", "_lever", "_power", "_quiet_for", "_sliding", "doubtful", "error")

    def __init__(self) -> None:
        self.doubtful: tuple[bool, bool, bool] = RIGHT
        """Of which axes of the gyro (body x, y, z) a wrong gyro is not believed; of x and y, which feet cannot tell apart at once, both or neither."""
        self._quiet_for = self._sliding = 0.0
        self._restart()

    @property
    def wrong(self) -> bool:
        """Whether the gyro shows another turn than the feet."""
        return any(self.doubtful)

    @property
    def differs(self) -> bool:
        """Whether the gyro shows another turn than the feet at the moment: it may soon be `wrong`."""
        return self._exceeding > 0.0

    def _restart(self) -> None:
        self.error: Triple = _NONE
        """What the gyro shows more than the feet, odom axes, rad/s."""
        self._inertia = [0.0] * 6
        """Sum of |a|^2 - a a' over the arms a of the feet: xx, yy, zz, xy, xz, yz; m2 s."""
        self._lever = [0.0] * 3
        """Sum of a x (the velocity that the foot tells), m2."""
        self._power = [0.0] * 3
        self._exceeding = 0.0

    def check(self, dt: float, feet: Sequence[tuple[Triple, Triple]], believable: bool = True) -> None:
        """Take in, of each foot that stands firmly, where it is from the body (m) and the velocity of the body that it tells (m/s), odom axes.

        Not `believable` are feet of a leg whose joints are in doubt, nor feet that slide: what they have told so far is forgotten.
        """
        self._sliding = SLIDING if _fastest_apart(feet) > APART else max(0.0, self._sliding - dt)
        if not believable or self._sliding > 0.0:
            self._restart()
            return
        keep = exp(-dt / MEMORY)
        self._inertia = [keep * part for part in self._inertia]
        self._lever = [keep * part for part in self._lever]
        if len(feet) >= FEET:
            self._add(dt, feet)
            self.error = _solve(self._inertia, self._lever)
            blend = 1.0 - exp(-dt / POWER_MEMORY)
            self._power = [p + blend * (e * e - p) for p, e in zip(self._power, self.error, strict=True)]
        self._judge(dt)

    def _judge(self, dt: float) -> None:
        """The verdict, if the error has been beyond a limit for long enough; while no feet tell, it stays where it was."""
        beyond = [power / (limit * limit) for power, limit in zip(self._power, LIMITS, strict=True)]
        self._exceeding = self._exceeding + dt if max(beyond) > 1.0 else 0.0
        if self._exceeding > LASTING:
            x, y, z = (share > DOUBT * DOUBT for share in beyond)
            tilt, yaw = x or y or self.doubtful[0], z or self.doubtful[2]
            self.doubtful = (tilt, tilt, yaw)
            self._quiet_for = 0.0

    def sits(self, dt: float, turn: Sequence[float]) -> None:
        """Take in what the gyro shows (rad/s) in a robot that sits. A wrong one gets a new chance when it has shown rest for a while."""
        self._restart()
        quiet = max(abs(part) for part in turn) < QUIET
        self._quiet_for = self._quiet_for + dt if quiet else 0.0
        if self._quiet_for >= QUIET_TIME:
            self.doubtful = RIGHT

    def _add(self, dt: float, feet: Sequence[tuple[Triple, Triple]]) -> None:
        share = 1.0 / len(feet)
        cx, cy, cz = (share * sum(foot[axis] for foot, _ in feet) for axis in range(3))
        xx, yy, zz, xy, xz, yz = self._inertia
        lx, ly, lz = self._lever
        for (fx, fy, fz), (vx, vy, vz) in feet:
            x, y, z = fx - cx, fy - cy, fz - cz
            xx, yy, zz = xx + dt * (y * y + z * z), yy + dt * (x * x + z * z), zz + dt * (x * x + y * y)
            xy, xz, yz = xy - dt * x * y, xz - dt * x * z, yz - dt * y * z
            # The body's velocity by a foot is v - e x arm: a x (e x a) is what the sums above make of e.
            lx, ly, lz = lx - dt * (y * vz - z * vy), ly - dt * (z * vx - x * vz), lz - dt * (x * vy - y * vx)
        self._inertia, self._lever = [xx, yy, zz, xy, xz, yz], [lx, ly, lz]


def _fastest_apart(feet: Sequence[tuple[Triple, Triple]]) -> float:
    """How fast the distance between two of the feet changes at most, m/s."""
    fastest = 0.0
    for (a, u), (b, v) in combinations(feet, 2):
        arm = (a[0] - b[0], a[1] - b[1], a[2] - b[2])
        along = arm[0] * (u[0] - v[0]) + arm[1] * (u[1] - v[1]) + arm[2] * (u[2] - v[2])
        fastest = max(fastest, abs(along) / hypot(*arm))
    return fastest


def _solve(inertia: Sequence[float], lever: Sequence[float]) -> Triple:
    """The error of which the feet have shown this; by the adjugate of the symmetric matrix."""
    xx, yy, zz, xy, xz, yz = inertia
    xx, yy, zz = xx + UNSEEN, yy + UNSEEN, zz + UNSEEN
    a, b, c = yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy
    d, e, f = xx * zz - xz * xz, xy * xz - xx * yz, xx * yy - xy * xy
    share = 1.0 / (xx * a + xy * b + xz * c)
    x, y, z = lever
    return (share * (a * x + b * y + c * z), share * (b * x + d * y + e * z), share * (c * x + e * y + f * z))
