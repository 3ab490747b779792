"""Feet of a body that has no forces: standing feet roll on the spot where they stand, the others swing ahead."""

from __future__ import annotations

from math import hypot

from robot.control.gaits import GaitClock, gaits_of
from robot.control.swing import swing_path
from robot.geometry.planar import Pose2, Twist2, placed, turned
from robot.geometry.vectors import Triple
from robot.model.robot import RobotModel


class Footwork:
    """The trot's pattern applied to four feet in world coordinates.

    Footholds follow the usual rule: below the hip where the body will be when the foot lands, half a stance ahead.
    """

    __slots__ = ("_active", "_clock", "_lifted", "_model", "contact", "feet", "velocity")

    def __init__(self, model: RobotModel) -> None:
        self._model = model
        self._clock = GaitClock(gaits_of(model)["trot"])
        self._active = False
        self._lifted: list[Triple] = [(0.0, 0.0, model.foot_radius)] * 4
        self.feet: list[Triple] = [(0.0, 0.0, model.foot_radius)] * 4
        """Foot centres in the world, m."""
        self.velocity: list[Triple] = [(0.0, 0.0, 0.0)] * 4
        """Of the foot centres in the world, m/s; of a standing foot what `roll` said last."""
        self.contact = [True] * 4

    @property
    def standing(self) -> bool:
        """Whether all four feet stand."""
        return all(self.contact)

    def plant(self, places: list[tuple[float, float]]) -> None:
        """All feet on the floor at these world coordinates."""
        for leg, (x, y) in enumerate(places):
            self._land(leg, x, y)
        self._active = False

    def slip(self, leg: int, x: float, y: float) -> None:
        """A standing foot was dragged to (x, y): the body went further than its leg reaches."""
        self._land(leg, x, y)

    def roll(self, leg: int, yaw: float, forward: float, left: float) -> None:
        """A standing foot's ball rolls under a leg that turns: its centre moves by so many m/s in axes turned by `yaw`."""
        self.velocity[leg] = (*turned(yaw, forward, left), 0.0)

    def advance(self, dt: float, pose: Pose2, twist: Twist2, *, stepping: bool) -> None:
        """Move the feet by `dt` seconds under a body at `pose` with `twist`; no foot lifts unless `stepping`."""
        for leg in range(4):
            if self.contact[leg]:
                (x, y, z), (vx, vy, _) = self.feet[leg], self.velocity[leg]
                self.feet[leg] = (x + vx * dt, y + vy * dt, z)
        if not self._active:
            if not stepping:
                return
            self._clock.restart()
            self._active = True
        self._clock.hurry(hypot(twist.vx, twist.vy))
        before = [self._clock.swing(leg) for leg in range(4)]
        self._clock.advance(dt)
        for leg in range(4):
            self._move(leg, before[leg], self._clock.swing(leg), pose, twist, stepping)
        self._active = stepping or not self.standing

    def _move(self, leg: int, before: float, progress: float, pose: Pose2, twist: Twist2, stepping: bool) -> None:
        if self.contact[leg]:
            if not (stepping and before < 0.0 <= progress):
                return
            self._lifted[leg] = self.feet[leg]
            self.contact[leg] = False
        if progress < 0.0:
            self._land(leg, *self._foothold(leg, 0.0, pose, twist))
            return
        duration, clearance = self._clock.swing_time, self._clock.gait.clearance
        x, y = self._foothold(leg, (1.0 - progress) * duration, pose, twist)
        self.feet[leg], self.velocity[leg] = swing_path(
            self._lifted[leg], (x, y, self._model.foot_radius), progress, duration, clearance
        )

    def _foothold(self, leg: int, ahead: float, pose: Pose2, twist: Twist2) -> tuple[float, float]:
        """Where a foot lands in `ahead` seconds: its place below the hip, half a stance of body motion further."""
        vx, vy = turned(pose.yaw + 0.5 * twist.wz * ahead, twist.vx, twist.vy)
        there = Pose2(pose.x + vx * ahead, pose.y + vy * ahead, pose.yaw + twist.wz * ahead)
        half = self._clock.stance_time / 2
        px, py = self._model.nominal[leg]
        fx, fy = px + (twist.vx - twist.wz * py) * half, py + (twist.vy + twist.wz * px) * half
        return placed(there, fx, fy)

    def _land(self, leg: int, x: float, y: float) -> None:
        self.feet[leg] = (x, y, self._model.foot_radius)
        self.velocity[leg] = (0.0, 0.0, 0.0)
        self.contact[leg] = True
