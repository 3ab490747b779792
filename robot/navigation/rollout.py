"""Commands tried out on paper: where they lead, and how near the body then comes to things."""

from __future__ import annotations

import math

import numpy as np

from robot.geometry.planar import Pose2, placed
from robot.geometry.vectors import Floats
from robot.navigation.follow_config import FollowerConfig
from robot.navigation.limits import Limits
from robot.navigation.local_field import LocalField

HORIZON: Floats = np.linspace(0.15, 1.2, 8)
"""Instants at which a command is tried out, s: long enough to stop from full speed."""
GLIMPSE: Floats = np.linspace(0.1, 0.6, 6)
"""The same while threading, s: from pose to pose the command changes too soon to look farther."""
FORESIGHT: Floats = np.concatenate([HORIZON, [1.5, 1.8, 2.1, 2.5]])
"""Instants at which it is tried out against what moves, s: long enough to get out of the way."""


def fan_of(config: FollowerConfig, limits: Limits) -> Floats:
    """The commands to choose from, shape (n, 3)."""
    shares = np.array(config.fan)
    forward = np.concatenate([[limits.vx_min, limits.vx_min / 2, 0.0], limits.vx_max * shares])
    sideways = np.array([-limits.vy_max, -limits.vy_max / 2, 0.0, limits.vy_max / 2, limits.vy_max])
    turns = np.linspace(-limits.wz_max, limits.wz_max, config.fan_turns)
    vx, vy, wz = np.meshgrid(forward, sideways, turns, indexing="ij")
    return np.column_stack([vx.ravel(), vy.ravel(), wz.ravel()])


def clearances(pose: Pose2, commands: Floats, around: LocalField, instants: Floats) -> Floats:
    """Distance (m) from the body to anything along every command, shape (commands, n): to what stands, then to what moves."""
    standing = around.body_clearance(*rollout(pose, commands, instants))
    if not around.movers:
        return standing
    return np.concatenate([standing, around.mover_clearance(*rollout(pose, commands, FORESIGHT), FORESIGHT)], axis=1)


def rollout(pose: Pose2, commands: Floats, instants: Floats) -> tuple[Floats, Floats, Floats]:
    """Where constant commands lead: x, y, yaw, each of shape (commands, instants). Exact arcs."""
    vx, vy, wz = (commands[:, k : k + 1] for k in range(3))
    turn = wz * instants
    # sin(a)/a and (1 - cos(a))/a, through sinc so that they hold at a = 0.
    along = np.sinc(turn / math.pi)
    across = np.sinc(turn / (2 * math.pi)) * np.sin(turn / 2)
    dx = (vx * along - vy * across) * instants
    dy = (vx * across + vy * along) * instants
    return *placed(pose, dx, dy), pose.yaw + turn
