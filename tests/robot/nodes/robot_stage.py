"""The robot as scenarios want it: the whole of it on the kinematic body, and places in front of it."""

from __future__ import annotations

from math import cos, sin
from typing import TYPE_CHECKING

from actors.interfaces.geometry_msgs.msg import PoseStamped
from robot import Robot
from robot.geometry.messages import pose_stamped
from robot.geometry.planar import Pose2
from robot.scenes.worlds import get_world

if TYPE_CHECKING:
    from actors import Child, Supervisor

__all__ = ["ahead", "robot", "whole", "without"]


def robot(world: str = "empty", *, percent: float = 90.0, seed: int = 1) -> Supervisor:
    """Without a mission: it lies where the world has it begin, and waits to be asked."""
    return Robot(world, body="kinematic", battery=percent, seed=seed).tree


def whole() -> Supervisor:
    """With its mission, and with an arm: every node that the robot can have."""
    return Robot(body="kinematic", mission="patrol", seed=1, arm=True).tree


def without(tree: Supervisor, *names: str) -> Supervisor:
    """The tree but for some of its nodes."""
    children: list[Child | Supervisor] = [child for child in tree.children if child.name not in names]  # type: ignore[misc]
    return tree.replace(children=children)


def ahead(world: str, metres: float) -> PoseStamped:
    """The place so far in front of where the robot begins."""
    start = get_world(world).start
    there = Pose2(start.x + metres * cos(start.yaw), start.y + metres * sin(start.yaw), start.yaw)
    return pose_stamped(there, PoseStamped().header.stamp)
