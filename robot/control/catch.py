"""Catching a walk: a robot in motion is brought to rest by steps, whatever walked it before and however that ended.

What is known at the first step is one sample of IMU and joints: the standing feet tell the speed, how far they are behind tells the phase of the
stride, and the body is taken for level. From there on the robot walks at zero speed until it has come to rest. Equations:
docs/concepts/control.md#safe-stop.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot, inf
from typing import Final

import numpy as np

from robot.control.gaits import gaits_of
from robot.control.walk import WalkController
from robot.estimation.leg_odometry import Estimator
from robot.estimation.predict import PredictedState
from robot.estimation.terrain import TerrainPlane
from robot.geometry.vectors import Triple
from robot.hardware.body import ImuSample, JointSample, MotorTargets
from robot.model.actuators import MOTOR_DELAY
from robot.model.legs import LEVEL, foot_velocities, leg_state
from robot.model.parameters import GRAVITY
from robot.model.robot import SPOT, RobotModel

SLOW: Final = 0.25
"""A body slower than this (m/s) is at rest for a stop: sitting down from here on needs no step."""
STEADY: Final = 0.1
"""Seconds that it lasts at least: so much of the stride shows whether the speed was one."""
LONGEST: Final = 2.0
"""Seconds after which it is given up: feet that slip may show a speed for ever."""
FEET: Final = 3
"""So many feet stand before the robot may sit down."""
STOOD: Final = 0.08
"""Seconds for which they have to stand: a body that tips over the two of a pair looks slow for a moment, too."""
FASTEST: Final = 2.0
"""Bound of the speed that the standing feet tell, m/s: more is a foot that slips."""
DOUBT: Final = 0.1
"""Standard deviation of the speed that the feet tell at first, m/s: they have been dragged along since the last targets."""
FIRST: Final = 1e-4
"""Time since a sample that nobody took, s: the estimate is begun with the first one."""


class Settling:
    """The end of a walk that is to sit down: when it is slow, no foot lifts any more, until they have all come down and stood for a moment."""

    def __init__(self) -> None:
        self._stood = 0.0

    def step(self, dt: float, walker: WalkController, slow: bool, contact: Sequence[bool]) -> bool:
        """Whether the robot may sit down, `dt` seconds after the last call; `slow` says that the body is slower than `SLOW`. One that gets faster steps on."""
        stands = sum(contact) >= FEET
        walker.halting = slow and (walker.halting or stands)
        self._stood = self._stood + dt if walker.halting and stands else 0.0
        return self._stood > STOOD


class Catch:
    """Walks to rest. `step` at each control step until `over`; then the robot stands still on at least three feet, or will not come to rest.

    Invariants: `over` once true stays so; no object that another controller holds is changed after it was handed in.
    """

    def __init__(self, estimate: Estimator, terrain: TerrainPlane, walker: WalkController) -> None:
        self._estimate, self._terrain, self._walker = estimate, terrain, walker
        self._settling = Settling()
        self._time = 0.0
        self.over = False

    @classmethod
    def begin(cls, imu: ImuSample, joints: JointSample, model: RobotModel = SPOT) -> Catch | None:
        """For a robot of which nothing but these samples is known; None if it is at rest, or has no foot on the ground that could tell."""
        vx, vy = ground_speed(joints, model)
        if hypot(vx, vy) < SLOW:
            return None
        estimate, terrain = Estimator(model), TerrainPlane()
        estimate.update(FIRST, ImuSample(imu.gyro, np.array((0.0, 0.0, GRAVITY))), joints)
        estimate.moving((vx, vy, 0.0), DOUBT)
        terrain.update(inf, estimate.contacts)
        ahead = PredictedState(estimate, joints, MOTOR_DELAY, (0.0, 0.0, 0.0))
        walker = WalkController(gaits_of(model)["trot"], ahead)
        walker.join(estimate, ahead)
        return cls(estimate, terrain, walker)

    def step(self, dt: float, imu: ImuSample, joints: JointSample) -> MotorTargets:
        """The motor targets of this step, `dt` seconds after the last."""
        self._time += dt
        estimate, walker = self._estimate, self._walker
        estimate.update(dt, imu, joints, walker.leaving())
        self._terrain.update(dt, estimate.contacts)
        vx, vy, _ = estimate.velocity
        settled = self._settling.step(dt, walker, self._time > STEADY and hypot(vx, vy) < SLOW, estimate.contact)
        self.over = self.over or settled or self._time > LONGEST
        ahead = PredictedState(estimate, joints, MOTOR_DELAY + 0.5 * dt, walker.acceleration)
        return walker.step(dt, estimate, ahead, self._terrain, (0.0, 0.0, 0.0)).freeze()


def ground_speed(joints: JointSample, model: RobotModel = SPOT) -> tuple[float, float]:
    """The velocity (m/s, forward and left) of a level body over its standing feet, bounded; over all four if none is said to stand."""
    angles, speeds = joints.position.tolist(), joints.velocity.tolist()
    contact: list[bool] = joints.contact.tolist()
    standing = contact if any(contact) else [True] * 4
    moving, _ = foot_velocities(leg_state(angles, LEVEL, model), angles, speeds, (0.0, 0.0, 0.0), LEVEL)
    feet: list[Triple] = [speed for speed, stands in zip(moving, standing, strict=True) if stands]
    vx, vy = -sum(x for x, _, _ in feet) / len(feet), -sum(y for _, y, _ in feet) / len(feet)
    fast = hypot(vx, vy)
    scale = min(1.0, FASTEST / fast) if fast > 0.0 else 1.0
    return (vx * scale, vy * scale)
