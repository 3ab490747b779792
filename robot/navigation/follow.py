"""Walking along a path: from a pose to a velocity command that keeps the whole body clear of things.

A pursuit of a point ahead on the path proposes a command. The command is tried out: the body is moved along it on
paper, and when its outline would come too near to anything, the best of a fan of other commands is taken instead (the
dynamic window of Fox, Burgard and Thrun, 1997, with a rectangle instead of a disc).

Of the commands u = (vx, vy, wz) that keep clear, the one of least price is taken, with its end pose after 1.2 s:

    price = way + 1.5 (missing / comfort)^2 + 0.05 |u - wish| + 0.05 |u - last|      |.|: sum of magnitudes
    way   = path left + 0.8 distance from the path + 0.3 |bearing of the path|       along a path
          = distance from the pose + 0.4 |turn that is left|                         towards a pose

where `missing` is what the least clearance on the way lacks to the clearance required, which stands for comfort in a narrow place. Through
a gap the end pose is that after 0.6 s. The numbers are those of `FollowerConfig`; symbols and sources: docs/concepts/control.md#following-a-path.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from robot.geometry.angles import wrap
from robot.geometry.planar import ZERO_TWIST, Pose2, Twist2, seen_from
from robot.geometry.vectors import Floats, wrap_all
from robot.navigation.follow_config import FollowerConfig
from robot.navigation.limits import Limits, Tolerance
from robot.navigation.local_field import LocalField
from robot.navigation.rollout import GLIMPSE, HORIZON, clearances, fan_of, rollout
from robot.planning.path import Path


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

    command: Twist2
    phase: Phase
    remaining: float
    """Along the path, m."""
    clearance: float
    """From the body's outline now, m."""
    off_path: float
    """m."""


class Follower:
    """Follows one path at a time. Give it a path with `follow`, then call `step` at the control rate."""

    def __init__(
        self, limits: Limits | None = None, tolerance: Tolerance | None = None, config: FollowerConfig | None = None
    ) -> None:
        self.limits = limits or Limits()
        self.config = config or FollowerConfig()
        self.tolerance = tolerance or Tolerance()
        self.path: Path | None = None
        self._goal = Pose2(0.0, 0.0)
        self._along = 0.0
        self._poses: Floats | None = None
        self._passed = 0
        self._turning = False
        self._avoiding = False
        self._last = ZERO_TWIST
        self._fan = fan_of(self.config, self.limits)

    def set_limits(self, limits: Limits) -> None:
        """Command within other limits from the next step on."""
        if limits == self.limits:
            return
        self.limits = limits
        self._fan = fan_of(self.config, limits)

    def __repr__(self) -> str:
        return f"Follower({self.path!r}, {self._along:.2f} m done)"

    def follow(self, path: Path, goal: Pose2, around: LocalField | None = None) -> None:
        """Take up a path; `goal` gives the heading at its end. A gap being threaded is finished if `around` leaves it open."""
        self.path = path.spaced(self.config.spacing)
        self._goal = goal
        self._along = 0.0
        if self._poses is not None:
            rest = self._poses[self._passed :].T
            if around is None or float(around.body_clearance(*rest).min()) < self.config.squeeze:
                self._poses = None

    def drop_poses(self) -> None:
        """Give up the poses of `follow_poses`."""
        self._poses = None

    def follow_poses(self, poses: Floats) -> None:
        """Go through these poses (n, 3) next, heading and all, then on along the path."""
        self._poses, self._passed = poses, 0

    @property
    def threading(self) -> bool:
        """Whether poses of `follow_poses` are still ahead."""
        return self._poses is not None

    @property
    def along(self) -> float:
        """How far along the path the robot has come, m."""
        return self._along

    def narrowest(self, around: LocalField, reach: float) -> tuple[float, float, float]:
        """Where the next `reach` metres are narrowest for a body that slides along them: (clearance, x, y); inf when there is no stretch."""
        points = self.ahead(reach)
        if len(points) < 3:
            return math.inf, 0.0, 0.0
        slope = points[2:] - points[:-2]
        yaw = np.arctan2(slope[:, 1], slope[:, 0])
        clear = around.body_clearance(points[1:-1, 0], points[1:-1, 1], yaw)
        worst = int(clear.argmin())
        return float(clear[worst]), float(points[1 + worst, 0]), float(points[1 + worst, 1])

    def is_tight(self, pose: Pose2, around: LocalField) -> bool:
        """Whether the next stretch is too narrow to rely on following the path with the body's middle."""
        config = self.config
        if self.narrowest(around, config.offered_over)[0] < config.tight:
            return True
        room = float(around.clearance(np.array([pose.x]), np.array([pose.y]))[0])
        assert self.path is not None
        x, y = self.path.at(self._along + config.tight_look)
        turn = abs(wrap(math.atan2(y - pose.y, x - pose.x) - pose.yaw))
        return turn > config.tight_turn and room < around.footprint.circumscribed + config.tight

    def halt(self) -> None:
        """Forget the path and the speed: the next command is a stop."""
        self.path, self._poses, self._last, self._turning = None, None, ZERO_TWIST, False

    def halt_speed(self) -> None:
        """Keep the path, but start again from rest."""
        self._last = ZERO_TWIST

    def take_up(self, velocity: Twist2) -> None:
        """Go on from the speed the body has, instead of from rest."""
        self._last = self.limits.clip(velocity.vx, velocity.vy, velocity.wz)

    def is_clear(self, command: Twist2, pose: Pose2, around: LocalField) -> bool:
        """Whether the body can follow a constant command for the horizon without coming near to anything."""
        tried = np.array([[command.vx, command.vy, command.wz]])
        return bool(clearances(pose, tried, around, HORIZON).min() >= self.config.touch)

    def ahead(self, reach: float) -> Floats:
        """Points (n, 2) of the path from here to `reach` metres ahead."""
        assert self.path is not None
        return self.path.points[self._stretch(reach)]

    def _stretch(self, reach: float) -> slice:
        """Which points those are."""
        assert self.path is not None
        low, high = np.searchsorted(self.path.arc, (self._along, self._along + reach))
        return slice(int(low), max(int(high), int(low) + 1))

    def step(self, pose: Pose2, around: LocalField, dt: float) -> Step:
        """The command for the next `dt` seconds; `around`: the distances near the pose."""
        assert self.path is not None, "call follow(path, goal) first"
        config = self.config
        search = (self._along - config.search_back, self._along + config.search_ahead)
        self._along, off = self.path.project(pose.x, pose.y, *search)
        clearance = around.clearance_at(pose)
        remaining = max(self.path.length - self._along, 0.0)
        to_goal = math.hypot(self._goal.x - pose.x, self._goal.y - pose.y)
        near = to_goal < config.approach and remaining < 2 * config.approach
        turn_left = wrap(self._goal.yaw - pose.yaw)
        if near and to_goal <= self.tolerance.position and abs(turn_left) <= self.tolerance.yaw:
            self._last = ZERO_TWIST
            return Step(ZERO_TWIST, Phase.ARRIVED, to_goal, clearance, off)
        aim = self._next_pose(pose) or (self._goal if near else None)
        if self._poses is not None and aim is not None:
            pace = min(self.limits.pace(clearance - config.touch), config.threading_speed)
            wish, phase = self._toward(pose, aim, pace), Phase.THREADING
        elif near:
            wish, phase = self._toward(pose, self._goal, config.approach_speed), Phase.APPROACHING
        else:
            wish, phase = self._pursue(pose, clearance)
        command, phase = self._avoid_collision(wish, phase, pose, around, clearance, aim)
        self._avoiding = phase == Phase.AVOIDING
        command = self.limits.ramp(command, self._last, dt)
        self._last = command
        return Step(command, phase, max(remaining, to_goal), clearance, off)

    # --- what it would like -----------------------------------------------------------------------------------------

    def _pursue(self, pose: Pose2, clearance: float) -> tuple[Twist2, Phase]:
        """Head for a point ahead on the path: turn on the spot when it lies far to the side."""
        assert self.path is not None
        config, speed = self.config, abs(self._last.vx)
        x, y = self.path.at(self._along + config.lookahead + config.lookahead_time * speed)
        bearing = wrap(math.atan2(y - pose.y, x - pose.x) - pose.yaw)
        self._turning = abs(bearing) > (config.turn_until if self._turning else config.turn_from)
        wz = config.turn_gain * bearing
        if self._turning:
            return self.limits.clip(0.0, 0.0, wz), Phase.TURNING
        foot_x, foot_y = self.path.at(self._along)
        left = -math.sin(pose.yaw) * (foot_x - pose.x) + math.cos(pose.yaw) * (foot_y - pose.y)
        end = math.hypot(self._goal.x - pose.x, self._goal.y - pose.y)
        # With room to spare round the goal it need not come to rest before the far side of that room.
        room = max(end + self.tolerance.position - config.usual_room, config.least_braking)
        braking = math.sqrt(2.0 * config.braking * room)
        ahead = self.limits.vx_max * max(math.cos(config.bend * bearing), config.least_share)
        vx = min(ahead, self.limits.pace(clearance - config.touch), braking)
        return self.limits.clip(vx, config.side_gain * left, wz), Phase.FOLLOWING

    def _next_pose(self, pose: Pose2) -> Pose2 | None:
        """The pose to go to next through a gap: some 25 cm (or as much turning) ahead. None, and done with them, at the last one."""
        if self._poses is None:
            return None
        config = self.config
        rest = self._poses[self._passed : self._passed + config.poses_searched]
        gaps = np.hypot(rest[:, 0] - pose.x, rest[:, 1] - pose.y) + config.yaw_length * np.abs(
            rest[:, 2] - _near(pose.yaw, rest[:, 2])
        )
        self._passed += int(gaps.argmin())
        rest = self._poses[self._passed :]
        if len(rest) <= 2:
            self._poses = None
            return None
        steps = np.hypot(*np.diff(rest[:, :2], axis=0).T) + config.yaw_length * np.abs(np.diff(rest[:, 2]))
        ahead = int(np.searchsorted(np.cumsum(steps), config.pose_ahead)) + 1
        x, y, yaw = (float(v) for v in rest[min(ahead, len(rest) - 1)])
        return Pose2(x, y, yaw)

    def _toward(self, pose: Pose2, aim: Pose2, speed: float) -> Twist2:
        """Straight to a pose nearby, sideways and backward if need be, while turning to its heading."""
        ahead, left = seen_from(pose, aim.x, aim.y)
        gain = self.config.approach_gain if self._poses is None else self.config.threading_gain
        scale = min(gain, speed / max(math.hypot(ahead, left), self.config.no_way))
        # All three axes shrink together, or a clipped one would bend the way to the pose.
        shrink = max(
            1.0,
            ahead * scale / self.limits.vx_max,
            ahead * scale / min(self.limits.vx_min, -self.config.no_speed),
            abs(left) * scale / max(self.limits.vy_max, self.config.no_speed),
        )
        turn = self.config.yaw_gain * gain * wrap(aim.yaw - pose.yaw)
        return self.limits.clip(ahead * scale / shrink, left * scale / shrink, turn)

    # --- what it may ------------------------------------------------------------------------------------------------

    def _avoid_collision(
        self, wish: Twist2, phase: Phase, pose: Pose2, around: LocalField, clearance: float, aim: Pose2 | None
    ) -> tuple[Twist2, Phase]:
        """The wish itself if it keeps clear, else the best command of the fan; a stop when there is none."""
        config, tried = self.config, np.array([[wish.vx, wish.vy, wish.wz]])
        threading = phase == Phase.THREADING
        touch = config.touch if aim is None else config.squeeze
        if aim is None:
            comfort = self._required_clearance(around)
        elif threading:
            comfort = touch + config.ease
        else:
            comfort = min(config.comfort, clearance + config.ease)
        # Once off the wish, take it up again only when it is clearly good: no flutter between it and the fan.
        instants = GLIMPSE if threading else HORIZON
        slack = config.flutter if self._avoiding and not threading else 0.0
        if float(clearances(pose, tried, around, instants).min()) >= comfort + slack:
            return wish, phase
        fan = np.concatenate([tried, *(share * tried for share in config.slower), self._fan])
        x, y, yaw = rollout(pose, fan, instants)
        clear = clearances(pose, fan, around, instants)
        least, final = clear.min(axis=1), clear[:, len(instants) - 1]
        # Already too near: any command that leads away is allowed.
        allowed = (least >= touch) | ((least >= clearance - config.rounding) & (final > clearance + config.rounding))
        allowed[0] &= bool(least[0] >= touch)
        if not allowed.any():
            if not around.movers:
                return ZERO_TWIST, Phase.BLOCKED
            # Something comes and every command ends near it: standing still is not safe, so go where most room is left,
            # but into nothing that stands.
            standing = clear[:, : len(instants)].min(axis=1)
            room = np.where(standing >= min(touch, clearance - config.rounding), least, -np.inf)
            return self.limits.clip(*(float(v) for v in fan[int(room.argmax())])), Phase.EVADING
        price = self._score(x[:, -1], y[:, -1], yaw[:, -1], aim)
        price += config.closeness_price * (np.maximum(comfort - least, 0.0) / comfort) ** 2
        last = self._last
        price += config.change_price * np.abs(fan - tried).sum(axis=1)
        price += config.change_price * np.abs(fan - np.array([last.vx, last.vy, last.wz])).sum(axis=1)
        price[~allowed] = np.inf
        best = int(price.argmin())
        chosen = self.limits.clip(*(float(v) for v in fan[best]))
        if chosen == ZERO_TWIST:
            return ZERO_TWIST, Phase.BLOCKED
        return chosen, phase if best == 0 else Phase.AVOIDING

    def _required_clearance(self, around: LocalField) -> float:
        """Clearance required of a command, m: the least that a body has which slides along the path ahead, less `insistence`,
        within [`touch` + `ease`, `comfort`].

        Never more than the path itself offers, or a narrow passage could not be entered.
        """
        config = self.config
        points = self.ahead(config.offered_over)
        if len(points) < 2:
            return config.comfort
        along = np.diff(points, axis=0)
        yaw = np.arctan2(along[:, 1], along[:, 0])
        offered = float(around.body_clearance(points[:-1, 0], points[:-1, 1], yaw).min())
        return min(max(offered - config.insistence, config.ease + config.touch), config.comfort)

    def _score(self, x: Floats, y: Floats, yaw: Floats, aim: Pose2 | None) -> Floats:
        """What it costs to end up at each pose: distance from the aim or, without one, path left and distance from it."""
        config = self.config
        if aim is not None:
            turn = np.abs(wrap_all(aim.yaw - yaw))
            return np.asarray(np.hypot(aim.x - x, aim.y - y) + config.yaw_length * turn, dtype=np.float64)
        assert self.path is not None
        stretch = self._stretch(config.price_over)
        points, arc = self.path.points[stretch], self.path.arc[stretch]
        gaps = np.hypot(points[:, 0] - x[:, None], points[:, 1] - y[:, None])
        nearest = gaps.argmin(axis=1)
        farther = np.searchsorted(arc, arc[nearest] + config.price_ahead)
        target = points[np.minimum(farther, len(points) - 1)]
        bearing = np.arctan2(target[:, 1] - y, target[:, 0] - x) - yaw
        turn = np.abs(wrap_all(bearing))
        left = arc[-1] - arc[nearest]
        return np.asarray(
            left + config.off_price * gaps[np.arange(len(x)), nearest] + config.turn_price * turn, dtype=np.float64
        )


def _near(angle: float, angles: Floats) -> Floats:
    """`angle` plus the whole turns that bring it nearest to each of the angles."""
    return np.asarray(angle + 2 * math.pi * np.round((angles - angle) / (2 * math.pi)), dtype=np.float64)
