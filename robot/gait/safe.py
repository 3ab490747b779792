"""The safe stop: from whatever the legs are doing to sitting, with nothing but joint samples. No IMU, no gait, no estimate.

It belongs to whoever commands the motors, for the moment when its commander falls silent.

A robot that walks is first caught: standing feet tell its speed (what they move backwards at), feet in the air make one last step
ahead of it, then all feet brake at a bounded rate while the body sinks.
"""

from __future__ import annotations

from math import cos, hypot, pi

import numpy as np

from robot.gait.balance import distribute
from robot.gait.drive import Targets
from robot.gait.figures import FOOT_RADIUS, GRAVITY, HIPS, MASS, SIDES, SIT_HEIGHT
from robot.gait.kinematics import leg_inverse
from robot.gait.limbs import LEVEL, Limbs, Triple, foot_velocities, limbs, torques
from robot.gait.stance import NOMINAL
from robot.world.body import JointSample, MotorTargets

__all__ = ["SafeStop"]

SIT_TIME = 1.0
"""Seconds from the first step to the sitting pose."""
FIND_TIME = 0.15
"""Seconds in which feet in the air reach for the ground the others stand on."""
LAST_STEP = 0.20
"""How far ahead of their places they land, per speed, s."""
BRAKE = 4.0
"""How hard the feet slow the body down, m/s2."""
FASTEST = 2.0
CARRY = 1.0
SPRING, DAMPER = 100.0, 6.0
REST_SPRING, REST_DAMPER = 60.0, 6.0
RELAX_TIME = 0.2
"""Seconds over which the legs stop carrying, once the pose is reached: the skid then carries the body."""


class SafeStop:
    """Sits the robot down within 1.2 s of the first step, then holds the pose softly. One object per stop.

    Works from standing, from any moment of a walk, and from sitting. The body ends at about 0.17 m.
    """

    def __init__(self) -> None:
        self._time = 0.0
        self._start: list[Triple] | None = None
        self._stood = [True] * 4
        self._height = SIT_HEIGHT
        self._speed = (0.0, 0.0)

    @property
    def done(self) -> bool:
        """Whether the robot sits."""
        return self._time >= SIT_TIME + RELAX_TIME

    def step(self, dt: float, joints: JointSample) -> MotorTargets:
        """The motor targets of this step, `dt` seconds after the last."""
        angles = joints.position.tolist()
        legs = limbs(angles, LEVEL)
        standing = joints.contact.tolist()
        if self._start is None:
            self._start, self._stood = legs.feet, standing if any(standing) else [True] * 4
            self._height = max(SIT_HEIGHT, *(-z for _, _, z in legs.feet))
            moving, _ = foot_velocities(legs, angles, joints.velocity.tolist(), (0.0, 0.0, 0.0), LEVEL)
            self._speed = _backwards([speed for speed, stands in zip(moving, self._stood, strict=True) if stands])
        else:
            self._time += dt
        relaxed = min(1.0, max(0.0, (self._time - SIT_TIME) / RELAX_TIME))
        loads = _loads(legs, standing)
        targets = Targets()
        for leg, (x, y, z) in enumerate(self._plan()):
            hip_x, hip_y = HIPS[leg]
            reach = leg_inverse(SIDES[leg], x - hip_x, y - hip_y, z)
            push = torques(legs.jacobians[leg], *((1.0 - relaxed) * part for part in loads[leg]))
            targets.leg(
                leg,
                effort=[a + b for a, b in zip(push, legs.weight[3 * leg : 3 * leg + 3], strict=True)],
                position=reach[:3],
                kp=SPRING + (REST_SPRING - SPRING) * relaxed,
                kd=DAMPER + (REST_DAMPER - DAMPER) * relaxed,
            )
        return targets.freeze()

    def _plan(self) -> list[Triple]:
        """Where the feet should be now, body frame."""
        now = self._time
        share = 0.5 * (1.0 - cos(pi * min(1.0, now / SIT_TIME)))
        found = min(1.0, now / FIND_TIME)
        height = self._height + (SIT_HEIGHT - self._height) * share
        vx, vy = self._speed
        fast = hypot(vx, vy)
        braking = min(max(0.0, now - FIND_TIME), fast / BRAKE)
        gone = fast * braking - 0.5 * BRAKE * braking * braking
        back_x, back_y = (gone * vx / fast, gone * vy / fast) if fast > 0.0 else (0.0, 0.0)
        feet: list[Triple] = []
        for (x, y, z), (goal_x, goal_y), stood in zip(self._start or [], NOMINAL, self._stood, strict=True):
            if stood:
                at_x, at_y = x - vx * min(now, FIND_TIME), y - vy * min(now, FIND_TIME)
            else:
                at_x = x + (goal_x + LAST_STEP * vx - x) * found
                at_y = y + (goal_y + LAST_STEP * vy - y) * found
            at_x, at_y = at_x - back_x, at_y - back_y
            low = -height if z <= -height else z + (-height - z) * found
            feet.append((at_x + (goal_x - at_x) * share, at_y + (goal_y - at_y) * share, low))
        return feet


def _loads(legs: Limbs, standing: list[bool]) -> list[list[float]]:
    """What each foot should push so that the standing ones carry a level body without tilting it."""
    down = [leg for leg in range(4) if standing[leg]]
    loads = [[0.0, 0.0, 0.0] for _ in range(4)]
    if down:
        cx, cy, cz = legs.centre
        arms = [(x - cx, y - cy, z - cz - FOOT_RADIUS) for x, y, z in (legs.feet[leg] for leg in down)]
        carry = CARRY * min(1.0, len(down) / 2) * MASS * GRAVITY
        for leg, force in zip(down, distribute(arms, np.array((0.0, 0.0, carry, 0.0, 0.0, 0.0))).tolist(), strict=True):
            loads[leg] = force
    return loads


def _backwards(speeds: list[Triple]) -> tuple[float, float]:
    """The body's velocity over feet that move at `speeds` as seen from it, bounded."""
    vx, vy = -sum(x for x, _, _ in speeds) / len(speeds), -sum(y for _, y, _ in speeds) / len(speeds)
    fast = hypot(vx, vy)
    scale = min(1.0, FASTEST / fast) if fast > 0.0 else 1.0
    return (vx * scale, vy * scale)
