"""Sitting: the legs are gathered and held softly; the skid carries the body."""

from __future__ import annotations

from math import sqrt

import numpy as np

from robot.control.drive import Targets
from robot.geometry.vectors import Vector
from robot.hardware.body import JointSample
from robot.model.kinematics import inverse
from robot.model.robot import SPOT, RobotModel
from robot.model.stance import nominal_feet

GATHER_SPEED = 1.5
"""How fast joints move to the sitting pose, rad/s."""
GATHERED = 0.35
"""Joints this close (rad) to the sitting pose may begin to rise."""
REST_TIME = 0.3
"""Seconds to lie still before rising: the attitude filter needs them after a start."""
SIT_SPRING, SIT_DAMPER = 60.0, 4.0
STRONGER = 2.0
"""By how much the springs of legs that are to rise, and are not gathered, grow in a second, of what they are: they lie under the body."""
STRONGEST = 4.0
"""So many times as strong they become."""


class Sitting:
    """Gathers the legs to the sitting pose from wherever they are at its first step."""

    def __init__(self, model: RobotModel = SPOT) -> None:
        self._spring, self._damper = SIT_SPRING * model.spring, SIT_DAMPER * model.damper
        self._pose: Vector = inverse(nominal_feet(model.sit_height, model), model).joints
        self._held: Vector | None = None
        self._lying = 0.0
        self._hindered, self._strength = False, 1.0

    def may_rise(self, joints: JointSample) -> bool:
        """Whether it has lain for long enough, and the legs are near enough to where they rise from."""
        gathered = bool(np.abs(joints.position - self._pose).max() < GATHERED)
        self._hindered = self._lying >= REST_TIME and not gathered
        return self._lying >= REST_TIME and gathered

    def step(self, dt: float, joints: JointSample, weight: list[float]) -> Targets:
        """The motor targets `dt` seconds after the last; `weight` are the torques that carry the legs, N m."""
        if self._held is None:
            self._held = joints.position.copy()
        self._lying += dt
        if self._hindered:
            self._strength = min(STRONGEST, self._strength + STRONGER * dt)
        spring, damper = self._spring * self._strength, self._damper * sqrt(self._strength)
        step = GATHER_SPEED * dt
        self._held = self._held + np.clip(self._pose - self._held, -step, step)
        held = self._held.tolist()
        targets = Targets()
        for leg in range(4):
            part = slice(3 * leg, 3 * leg + 3)
            targets.leg(leg, effort=weight[part], position=held[part], kp=spring, kd=damper)
        return targets
