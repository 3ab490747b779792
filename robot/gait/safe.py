"""The safe stop: from whatever the legs are doing to sitting, with nothing but joint samples. No IMU, no gait, no estimate.

It belongs to whoever commands the motors, for the moment when its commander falls silent.
"""

from __future__ import annotations

from math import cos, pi

from robot.gait.drive import Targets
from robot.gait.figures import GRAVITY, HIPS, MASS, SIDES, SIT_HEIGHT
from robot.gait.kinematics import leg_inverse
from robot.gait.limbs import Triple, limbs, torques
from robot.gait.stance import NOMINAL
from robot.world.body import JointSample, MotorTargets

__all__ = ["SafeStop"]

SIT_TIME = 1.0
"""Seconds from the first step to the sitting pose."""
FIND_TIME = 0.15
"""Seconds in which feet in the air reach for the ground the others stand on."""
SPRING, DAMPER = 100.0, 6.0
REST_SPRING, REST_DAMPER = 60.0, 6.0
RELAX_TIME = 0.2
"""Seconds over which the legs stop carrying, once the pose is reached: the skid then carries the body."""
LEVEL: Triple = (0.0, 0.0, 1.0)


class SafeStop:
    """Sits the robot down within 1.2 s of the first step, then holds the pose softly. One object per stop.

    Works from standing, from any moment of a walk, and from sitting. The body ends at about 0.17 m.
    """

    def __init__(self) -> None:
        self._time = 0.0
        self._start: list[Triple] | None = None
        self._height = SIT_HEIGHT

    @property
    def done(self) -> bool:
        """Whether the robot sits."""
        return self._time >= SIT_TIME + RELAX_TIME

    def step(self, dt: float, joints: JointSample) -> MotorTargets:
        """The motor targets of this step, `dt` seconds after the last."""
        angles = joints.position.tolist()
        legs = limbs(angles, LEVEL)
        if self._start is None:
            self._start = legs.feet
            self._height = max(SIT_HEIGHT, *(-z for _, _, z in legs.feet))
        else:
            self._time += dt
        share = 0.5 * (1.0 - cos(pi * min(1.0, self._time / SIT_TIME)))
        found = min(1.0, self._time / FIND_TIME)
        height = self._height + (SIT_HEIGHT - self._height) * share
        relaxed = min(1.0, max(0.0, (self._time - SIT_TIME) / RELAX_TIME))
        standing = joints.contact.tolist()
        load = (1.0 - relaxed) * MASS * GRAVITY / max(2, sum(standing))
        spring = SPRING + (REST_SPRING - SPRING) * relaxed
        damper = DAMPER + (REST_DAMPER - DAMPER) * relaxed
        targets = Targets()
        for leg, (x, y, z) in enumerate(self._start):
            hip_x, hip_y = HIPS[leg]
            goal_x, goal_y = NOMINAL[leg]
            low = -height if z <= -height else z + (-height - z) * found
            reach = leg_inverse(SIDES[leg], x + (goal_x - x) * share - hip_x, y + (goal_y - y) * share - hip_y, low)
            push = torques(legs.jacobians[leg], 0.0, 0.0, load if standing[leg] else 0.0)
            effort = [a + b for a, b in zip(push, legs.weight[3 * leg : 3 * leg + 3], strict=True)]
            targets.leg(leg, effort=effort, position=reach[:3], kp=spring, kd=damper)
        return targets.freeze()
