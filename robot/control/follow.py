"""Walking along a path: from a pose to a velocity command that keeps the whole body clear of things.

A pursuit of a point ahead on the path proposes a command. The command is tried out: the body is moved along it on
paper, and when its outline would come too near to anything, the best of a fan of other commands is taken instead (the
dynamic window idea of Fox, Burgard and Thrun, 1997, with a rectangle instead of a disc).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

import numpy as np

from robot.estimation.surroundings import Surroundings
from robot.geometry.angles import wrap
from robot.geometry.planar import Pose2
from robot.geometry.vectors import Floats
from robot.planning.path import Path

__all__ = ["Command", "Follower", "Limits", "Phase", "Step", "Tolerance"]


@dataclass(frozen=True, slots=True)
class Command:
    """A velocity in body axes: m/s, m/s, rad/s."""

    vx: float = 0.0
    vy: float = 0.0
    wz: float = 0.0


STOP: Final = Command()


@dataclass(frozen=True, slots=True)
class Limits:
    """What may be commanded. Speeds rise no faster than the accelerations say; braking is never delayed."""

    vx_min: float = -0.3
    vx_max: float = 0.8
    vy_max: float = 0.3
    wz_max: float = 1.0
    acceleration: float = 1.0
    """m/s2, for vx and vy."""
    turn_acceleration: float = 3.0
    """rad/s2."""
    creep: float = 0.3
    """Forward speed where the body nearly touches something, m/s."""
    eagerness: float = 2.0
    """How much faster it may walk per meter of room around the body, 1/s."""

    def clip(self, vx: float, vy: float, wz: float) -> Command:
        """The nearest command within the limits."""
        return Command(
            min(max(vx, self.vx_min), self.vx_max),
            min(max(vy, -self.vy_max), self.vy_max),
            min(max(wz, -self.wz_max), self.wz_max),
        )

    def pace(self, clearance: float) -> float:
        """The fastest walk, m/s, with so much room around the body, m."""
        return min(self.creep + self.eagerness * max(clearance - _TOUCH, 0.0), self.vx_max)

    def ramp(self, wanted: Command, last: Command, dt: float) -> Command:
        """`wanted`, but no faster than `last` plus what the accelerations allow in `dt` seconds."""
        step, turn = self.acceleration * dt, self.turn_acceleration * dt
        return Command(
            _rise(wanted.vx, last.vx, step), _rise(wanted.vy, last.vy, step), _rise(wanted.wz, last.wz, turn)
        )


def _rise(wanted: float, last: float, step: float) -> float:
    """Limit only the growth of the magnitude; a change of sign starts from zero."""
    if wanted * last < 0.0:
        last = 0.0
    bound = abs(last) + step
    return min(max(wanted, -bound), bound)


@dataclass(frozen=True, slots=True)
class Tolerance:
    """How near counts as there: metres and radians, by the robot's own estimate."""

    position: float = 0.06
    yaw: float = 0.04


class Phase(StrEnum):
    """What a step is doing."""

    TURNING = "turning"
    """On the spot, towards the path."""
    FOLLOWING = "following"
    THREADING = "threading"
    """From pose to pose through a narrow place."""
    AVOIDING = "avoiding"
    """Not as the path wants it: that would come too near to something."""
    EVADING = "evading"
    """Out of the way of something that comes."""
    APPROACHING = "approaching"
    """The last steps to the goal, sideways and backward as need be."""
    ARRIVED = "arrived"
    BLOCKED = "blocked"


@dataclass(frozen=True, slots=True)
class Step:
    """One control step: the command, what it is doing, how far is left, and how near the body is to anything."""

    command: Command
    phase: Phase
    remaining: float
    """Along the path, m."""
    clearance: float
    """From the body's outline now, m."""
    off_path: float
    """m."""


_COMFORT = 0.32
"""While the body keeps this clear of everything, the pursuit is taken as it is, m."""
_TOUCH = 0.06
"""No command may bring the outline nearer than this, m."""
_HORIZON: Floats = np.linspace(0.15, 1.2, 8)
"""Instants at which a command is tried out, s: long enough to stop from full speed."""
_GLIMPSE: Floats = np.linspace(0.1, 0.6, 6)
"""The same while threading, s: from pose to pose the command changes too soon to look farther."""
_THREADING = 0.9
"""Faster than this it could not stop within that glimpse, m/s."""
_FORESIGHT: Floats = np.concatenate([_HORIZON, [1.5, 1.8, 2.1, 2.5]])
"""Instants at which it is tried out against what moves, s: long enough to get out of the way."""
_SQUEEZE = 0.03
"""The same while threading a gap or taking the last steps to a goal: both were checked beforehand, m."""
_TIGHT = 0.12
"""Sliding along the path nearer than this to something calls for a plan of the body's heading too, m."""
_APPROACH = 0.45
"""Within this distance of the goal the robot steps sideways and backward as needed, m."""


class Follower:
    """Follows one path at a time. Give it a path with `follow`, then call `step` at the control rate."""

    def __init__(self, limits: Limits | None = None, tolerance: Tolerance | None = None) -> None:
        self.limits = limits or Limits()
        self.tolerance = tolerance or Tolerance()
        self.path: Path | None = None
        self._goal = Pose2(0.0, 0.0)
        self._along = 0.0
        self._poses: Floats | None = None
        self._passed = 0
        self._turning = False
        self._avoiding = False
        self._last = STOP
        self._fan = _fan(self.limits)

    def __repr__(self) -> str:
        return f"Follower({self.path!r}, {self._along:.2f} m done)"

    def follow(self, path: Path, goal: Pose2, around: Surroundings | None = None) -> None:
        """Take up a path; `goal` gives the heading at its end. A gap being threaded is finished if `around` leaves it open."""
        self.path = path.spaced(0.05)
        self._goal = goal
        self._along = 0.0
        if self._poses is not None:
            rest = self._poses[self._passed :].T
            if around is None or float(around.body_clearance(*rest).min()) < _SQUEEZE:
                self._poses = None

    def unthread(self) -> None:
        """Give up the poses of `thread`."""
        self._poses = None

    def thread(self, poses: Floats) -> None:
        """Go through these poses (n, 3) next, heading and all, then on along the path."""
        self._poses, self._passed = poses, 0

    @property
    def threading(self) -> bool:
        """Whether poses of `thread` are still ahead."""
        return self._poses is not None

    @property
    def along(self) -> float:
        """How far along the path the robot has come, m."""
        return self._along

    def narrowest(self, around: Surroundings, reach: float = 1.2) -> tuple[float, float, float]:
        """Where the next `reach` metres are narrowest for a body that slides along them: (clearance, x, y); inf when there is no stretch."""
        points = self.ahead(reach)
        if len(points) < 3:
            return math.inf, 0.0, 0.0
        slope = points[2:] - points[:-2]
        yaw = np.arctan2(slope[:, 1], slope[:, 0])
        clear = around.body_clearance(points[1:-1, 0], points[1:-1, 1], yaw)
        worst = int(clear.argmin())
        return float(clear[worst]), float(points[1 + worst, 0]), float(points[1 + worst, 1])

    def is_tight(self, pose: Pose2, around: Surroundings) -> bool:
        """Whether the next stretch is too narrow to rely on following the path with the body's middle."""
        if self.narrowest(around)[0] < _TIGHT:
            return True
        room = float(around.clearance(np.array([pose.x]), np.array([pose.y]))[0])
        assert self.path is not None
        x, y = self.path.at(self._along + 0.4)
        turn = abs(wrap(math.atan2(y - pose.y, x - pose.x) - pose.yaw))
        return turn > 0.6 and room < around.footprint.circumscribed + _TIGHT

    def halt(self) -> None:
        """Forget the path and the speed: the next command is a stop."""
        self.path, self._poses, self._last, self._turning = None, None, STOP, False

    def halt_speed(self) -> None:
        """Keep the path, but start again from rest."""
        self._last = STOP

    def take_up(self, velocity: Command) -> None:
        """Go on from the speed the body has, instead of from rest."""
        self._last = self.limits.clip(velocity.vx, velocity.vy, velocity.wz)

    def is_clear(self, command: Command, pose: Pose2, around: Surroundings) -> bool:
        """Whether the body can follow a constant command for the horizon without coming near to anything."""
        tried = np.array([[command.vx, command.vy, command.wz]])
        return bool(_clearances(pose, tried, around, _HORIZON).min() >= _TOUCH)

    def ahead(self, reach: float) -> Floats:
        """Points (n, 2) of the path from here to `reach` metres ahead."""
        assert self.path is not None
        low, high = np.searchsorted(self.path.arc, (self._along, self._along + reach))
        return self.path.points[low : max(int(high), int(low) + 1)]

    def step(self, pose: Pose2, around: Surroundings, dt: float) -> Step:
        """The command for the next `dt` seconds. `around` must be centered on the pose."""
        assert self.path is not None, "call follow(path, goal) first"
        self._along, off = self.path.project(pose.x, pose.y, self._along - 0.1, self._along + 1.0)
        clearance = float(around.body_clearance(*(np.array([v]) for v in (pose.x, pose.y, pose.yaw)))[0])
        remaining = max(self.path.length - self._along, 0.0)
        to_goal = math.hypot(self._goal.x - pose.x, self._goal.y - pose.y)
        near = to_goal < _APPROACH and remaining < 2 * _APPROACH
        turn_left = wrap(self._goal.yaw - pose.yaw)
        if near and to_goal <= self.tolerance.position and abs(turn_left) <= self.tolerance.yaw:
            self._last = STOP
            return Step(STOP, Phase.ARRIVED, to_goal, clearance, off)
        aim = self._next_pose(pose) or (self._goal if near else None)
        if self._poses is not None and aim is not None:
            wish, phase = self._toward(pose, aim, min(self.limits.pace(clearance), _THREADING)), Phase.THREADING
        elif near:
            wish, phase = self._toward(pose, self._goal, 0.35), Phase.APPROACHING
        else:
            wish, phase = self._pursue(pose, clearance)
        command, phase = self._checked(wish, phase, pose, around, clearance, aim)
        self._avoiding = phase == Phase.AVOIDING
        command = self.limits.ramp(command, self._last, dt)
        self._last = command
        return Step(command, phase, max(remaining, to_goal), clearance, off)

    # --- what it would like -----------------------------------------------------------------------------------------

    def _pursue(self, pose: Pose2, clearance: float) -> tuple[Command, Phase]:
        """Head for a point ahead on the path: turn on the spot when it lies far to the side."""
        assert self.path is not None
        speed = abs(self._last.vx)
        x, y = self.path.at(self._along + 0.35 + 0.5 * speed)
        bearing = wrap(math.atan2(y - pose.y, x - pose.x) - pose.yaw)
        self._turning = abs(bearing) > (0.2 if self._turning else 0.7)
        wz = 1.8 * bearing
        if self._turning:
            return self.limits.clip(0.0, 0.0, wz), Phase.TURNING
        foot_x, foot_y = self.path.at(self._along)
        left = -math.sin(pose.yaw) * (foot_x - pose.x) + math.cos(pose.yaw) * (foot_y - pose.y)
        end = math.hypot(self._goal.x - pose.x, self._goal.y - pose.y)
        # With room to spare round the goal it need not come to rest before the far side of that room.
        braking = math.sqrt(2.0 * 0.4 * max(end + self.tolerance.position - 0.21, 0.02))
        vx = min(self.limits.vx_max * max(math.cos(1.4 * bearing), 0.2), self.limits.pace(clearance), braking)
        return self.limits.clip(vx, 0.8 * left, wz), Phase.FOLLOWING

    def _next_pose(self, pose: Pose2) -> Pose2 | None:
        """The pose to thread toward: some 25 cm (or as much turning) ahead. None, and done with them, at the last one."""
        if self._poses is None:
            return None
        rest = self._poses[self._passed : self._passed + 8]
        gaps = np.hypot(rest[:, 0] - pose.x, rest[:, 1] - pose.y) + 0.4 * np.abs(
            rest[:, 2] - _near(pose.yaw, rest[:, 2])
        )
        self._passed += int(gaps.argmin())
        rest = self._poses[self._passed :]
        if len(rest) <= 2:
            self._poses = None
            return None
        steps = np.hypot(*np.diff(rest[:, :2], axis=0).T) + 0.4 * np.abs(np.diff(rest[:, 2]))
        ahead = int(np.searchsorted(np.cumsum(steps), 0.25)) + 1
        x, y, yaw = (float(v) for v in rest[min(ahead, len(rest) - 1)])
        return Pose2(x, y, yaw)

    def _toward(self, pose: Pose2, aim: Pose2, speed: float) -> Command:
        """Straight to a pose nearby, sideways and backward if need be, while turning to its heading."""
        dx, dy = aim.x - pose.x, aim.y - pose.y
        c, s = math.cos(pose.yaw), math.sin(pose.yaw)
        ahead, left = c * dx + s * dy, c * dy - s * dx
        gain = 1.2 if self._poses is None else 3.0
        scale = min(gain, speed / max(math.hypot(ahead, left), 1e-6))
        # All three axes shrink together, or a clipped one would bend the way to the pose.
        shrink = max(
            1.0,
            ahead * scale / self.limits.vx_max,
            ahead * scale / min(self.limits.vx_min, -1e-3),
            abs(left) * scale / max(self.limits.vy_max, 1e-3),
        )
        turn = 1.25 * gain * wrap(aim.yaw - pose.yaw)
        return self.limits.clip(ahead * scale / shrink, left * scale / shrink, turn)

    # --- what it may ------------------------------------------------------------------------------------------------

    def _checked(
        self, wish: Command, phase: Phase, pose: Pose2, around: Surroundings, clearance: float, aim: Pose2 | None
    ) -> tuple[Command, Phase]:
        """The wish itself if it keeps clear, else the best command of the fan; a stop when there is none."""
        tried = np.array([[wish.vx, wish.vy, wish.wz]])
        threading = phase == Phase.THREADING
        touch = _TOUCH if aim is None else _SQUEEZE
        comfort = (
            self._offered(around) if aim is None else touch + 0.02 if threading else min(_COMFORT, clearance + 0.02)
        )
        # Once off the wish, take it up again only when it is clearly good: no flutter between it and the fan.
        instants = _GLIMPSE if threading else _HORIZON
        slack = 0.03 if self._avoiding and not threading else 0.0
        if float(_clearances(pose, tried, around, instants).min()) >= comfort + slack:
            return wish, phase
        fan = np.concatenate([tried, 0.6 * tried, 0.3 * tried, self._fan])
        x, y, yaw = _rollout(pose, fan, instants)
        clear = _clearances(pose, fan, around, instants)
        least, final = clear.min(axis=1), clear[:, len(instants) - 1]
        # Already too near: any command that leads away is allowed.
        allowed = (least >= touch) | ((least >= clearance - 0.01) & (final > clearance + 0.01))
        allowed[0] &= bool(least[0] >= touch)
        if not allowed.any():
            if not around.movers.moving:
                return STOP, Phase.BLOCKED
            # Something comes and every command ends near it: standing still is not safe, so go where most room is left,
            # but into nothing that stands.
            standing = clear[:, : len(instants)].min(axis=1)
            room = np.where(standing >= min(touch, clearance - 0.01), least, -np.inf)
            return self.limits.clip(*(float(v) for v in fan[int(room.argmax())])), Phase.EVADING
        price = self._price(x[:, -1], y[:, -1], yaw[:, -1], aim)
        price += 1.5 * (np.maximum(comfort - least, 0.0) / comfort) ** 2
        last = self._last
        price += 0.05 * np.abs(fan - tried).sum(axis=1)
        price += 0.05 * np.abs(fan - np.array([last.vx, last.vy, last.wz])).sum(axis=1)
        price[~allowed] = np.inf
        best = int(price.argmin())
        chosen = self.limits.clip(*(float(v) for v in fan[best]))
        if chosen == STOP:
            return STOP, Phase.BLOCKED
        return chosen, phase if best == 0 else Phase.AVOIDING

    def _offered(self, around: Surroundings) -> float:
        """The clearance (m) to insist on: a little less than the body has when it slides along the path as drawn.

        In the open that is the full comfort. In a narrow passage nothing better is to be had, and insisting would stop
        there.
        """
        points = self.ahead(1.2)
        if len(points) < 2:
            return _COMFORT
        along = np.diff(points, axis=0)
        yaw = np.arctan2(along[:, 1], along[:, 0])
        offered = float(around.body_clearance(points[:-1, 0], points[:-1, 1], yaw).min())
        return min(max(offered - 0.04, 0.02 + _TOUCH), _COMFORT)

    def _price(self, x: Floats, y: Floats, yaw: Floats, aim: Pose2 | None) -> Floats:
        """What it costs to end up at each pose: distance from the aim or, without one, path left and distance from it."""
        if aim is not None:
            turn = np.abs((aim.yaw - yaw + math.pi) % (2 * math.pi) - math.pi)
            return np.asarray(np.hypot(aim.x - x, aim.y - y) + 0.4 * turn, dtype=np.float64)
        assert self.path is not None
        points = self.ahead(1.6)
        gaps = np.hypot(points[:, 0] - x[:, None], points[:, 1] - y[:, None])
        nearest = gaps.argmin(axis=1)
        target = points[np.minimum(nearest + 10, len(points) - 1)]
        bearing = np.arctan2(target[:, 1] - y, target[:, 0] - x) - yaw
        turn = np.abs((bearing + math.pi) % (2 * math.pi) - math.pi)
        left = 0.05 * (len(points) - 1 - nearest)
        return np.asarray(left + 0.8 * gaps[np.arange(len(x)), nearest] + 0.3 * turn, dtype=np.float64)


def _near(angle: float, angles: Floats) -> Floats:
    """`angle` plus the whole turns that bring it nearest to each of the angles."""
    return np.asarray(angle + 2 * math.pi * np.round((angles - angle) / (2 * math.pi)), dtype=np.float64)


def _fan(limits: Limits) -> Floats:
    """The commands to choose from, shape (n, 3)."""
    shares = np.array([0.15, 0.3, 0.5, 0.7, 1.0])
    forward = np.concatenate([[limits.vx_min, limits.vx_min / 2, 0.0], limits.vx_max * shares])
    sideways = np.array([-limits.vy_max, -limits.vy_max / 2, 0.0, limits.vy_max / 2, limits.vy_max])
    turns = np.linspace(-limits.wz_max, limits.wz_max, 9)
    vx, vy, wz = np.meshgrid(forward, sideways, turns, indexing="ij")
    return np.column_stack([vx.ravel(), vy.ravel(), wz.ravel()])


def _clearances(pose: Pose2, commands: Floats, around: Surroundings, instants: Floats) -> Floats:
    """Distance (m) from the body to anything along every command, shape (commands, n): to what stands, then to what moves."""
    standing = around.body_clearance(*_rollout(pose, commands, instants))
    if not around.movers.moving:
        return standing
    return np.concatenate([standing, around.mover_clearance(*_rollout(pose, commands, _FORESIGHT), _FORESIGHT)], axis=1)


def _rollout(pose: Pose2, commands: Floats, instants: Floats) -> tuple[Floats, Floats, Floats]:
    """Where constant commands lead: x, y, yaw, each of shape (commands, instants). Exact arcs."""
    vx, vy, wz = (commands[:, k : k + 1] for k in range(3))
    turned = wz * instants
    # sin(a)/a and (1 - cos(a))/a, through sinc so that they hold at a = 0.
    along = np.sinc(turned / math.pi)
    across = np.sinc(turned / (2 * math.pi)) * np.sin(turned / 2)
    dx = (vx * along - vy * across) * instants
    dy = (vx * across + vy * along) * instants
    c, s = math.cos(pose.yaw), math.sin(pose.yaw)
    return pose.x + c * dx - s * dy, pose.y + s * dx + c * dy, pose.yaw + turned
