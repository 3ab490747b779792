"""The safe stop: from whatever the legs are doing to sitting. No gait, no estimate, and if need be no IMU.

It runs where the motors are commanded, for the moment when the node that walks the robot falls silent.

A robot that walks and has an IMU is first brought to rest by steps (`robot.control.catch`). Without an IMU the joints must do: standing feet tell
its speed (what they move backwards at), feet in the air make one last step ahead of it, then all feet brake at a bounded rate while the body
sinks. Equations: docs/concepts/control.md#safe-stop.
"""

from __future__ import annotations

from math import cos, hypot, pi

from robot.control.balance import distribute
from robot.control.catch import Catch, ground_speed
from robot.control.drive import Targets
from robot.geometry.vectors import Triple
from robot.hardware.body import ImuSample, JointSample, MotorTargets
from robot.model.kinematics import leg_inverse
from robot.model.legs import LEVEL, LegState, leg_state, torques
from robot.model.parameters import GRAVITY
from robot.model.robot import SPOT, RobotModel

SIT_TIME = 1.0
"""Seconds from the first step to the sitting pose."""
FIND_TIME = 0.15
"""Seconds in which feet in the air reach for the ground the others stand on."""
LAST_STEP = 0.20
"""How far ahead of their places they land, per speed, s."""
BRAKE = 4.0
"""Deceleration of the body over its feet, m/s2; chosen: what friction of 0.4 gives."""
SEARCH = 0.3
"""How fast a foot that has still not found the ground goes on downwards, m/s."""
LONGEST = 0.58
"""Farthest that a foot of the reference body is sent below the hip plane, m: 88 % of the stretched leg."""
CARRY = 0.5
"""Share of the weight that is given as forces; the joint springs give the rest, as the body sinks."""
_NO_SPEED = 1e-9
"""What a speed is divided by at least, m/s: a body at rest has gone nowhere."""
SPRING, DAMPER = 250.0, 6.0
"""Joint gains until the robot sits, N m/rad and N m s/rad."""
REST_SPRING, REST_DAMPER = 60.0, 6.0
"""The same for a robot that sits: it holds its pose softly."""
RELAX_TIME = 0.2
"""Seconds over which the legs stop carrying, once the pose is reached: the skid then carries the body."""


class SafeStop:
    """Sits the robot down within 1.2 s of the first step, then holds the pose softly. One object per stop.

    Works from standing, from any moment of a walk, and from sitting. The body ends at about 0.17 m. A walking robot whose IMU is there takes up to
    2 s more, and does not fall at any speed that it may be told to walk at; without an IMU, or with `steps` false, that holds up to 0.7 m/s.
    """

    def __init__(
        self, model: RobotModel = SPOT, *, steps: bool = True, speed: tuple[float, float] | None = None
    ) -> None:
        """`steps`: whether it may bring a walk to rest by steps. `speed` (forward, left, m/s) is that of the body where it is known better than
        by the standing feet, as when they slide.
        """
        self._model = model
        self._steps = steps
        """Whether it may still be about to step."""
        self._catch: Catch | None = None
        self._time = 0.0
        self._anchors: list[tuple[Triple, float] | None] = []
        """Of each foot that has touched the ground since the start: where, body frame, and how far the body had gone by then."""
        self._start: list[Triple] = []
        self._height = model.sit_height
        self._known_speed, self._speed = speed, (0.0, 0.0)

    @property
    def done(self) -> bool:
        """Whether the robot sits."""
        return self._time >= SIT_TIME + RELAX_TIME

    def step(self, dt: float, joints: JointSample, imu: ImuSample | None = None) -> MotorTargets:
        """The motor targets of this step, `dt` seconds after the last; `imu` None: there is none."""
        if self._steps and imu is not None:
            self._catch = self._catch or Catch.begin(imu, joints, self._model)
            if self._catch is not None and not self._catch.over:
                return self._catch.step(dt, imu, joints)
        self._steps = False
        return self._sit(dt, joints)

    def _sit(self, dt: float, joints: JointSample) -> MotorTargets:
        """By the joints alone."""
        angles = joints.position.tolist()
        model = self._model
        legs = leg_state(angles, LEVEL, model)
        standing: list[bool] = joints.contact.tolist()
        if not self._start:
            self._begin(legs, joints, standing)
        else:
            self._time += dt
        for leg in range(4):
            if self._anchors[leg] is None and standing[leg]:
                self._anchors[leg] = (legs.feet[leg], self._gone())
        relaxed = min(1.0, max(0.0, (self._time - SIT_TIME) / RELAX_TIME))
        loads = _loads(legs, standing)
        targets = Targets()
        for leg in range(4):
            x, y, z = self._place(leg)
            hip_x, hip_y = model.hips[leg]
            reach = leg_inverse(model.sides[leg], x - hip_x, y - hip_y, z, model, model.bends[leg])
            push = torques(legs.jacobians[leg], *((1.0 - relaxed) * part for part in loads[leg]))
            targets.leg(
                leg,
                effort=[a + b for a, b in zip(push, legs.weight[3 * leg : 3 * leg + 3], strict=True)],
                position=reach[:3],
                kp=model.spring * (SPRING + (REST_SPRING - SPRING) * relaxed),
                kd=model.damper * (DAMPER + (REST_DAMPER - DAMPER) * relaxed),
            )
        return targets.freeze()

    def _begin(self, legs: LegState, joints: JointSample, standing: list[bool]) -> None:
        """Note where the feet are, which stand, and how fast the body goes over them."""
        stood = standing if any(standing) else [True] * 4
        self._start = legs.feet
        self._anchors = [(foot, 0.0) if stands else None for foot, stands in zip(legs.feet, stood, strict=True)]
        deepest = [-foot[2] for foot, stands in zip(legs.feet, stood, strict=True) if stands]
        self._height = max(self._model.sit_height, sum(deepest) / len(deepest))
        self._speed = ground_speed(joints, self._model) if self._known_speed is None else self._known_speed

    def _gone(self) -> float:
        """How far the body should have gone by now, m: on for a moment, then braked."""
        fast = hypot(*self._speed)
        braking = min(max(0.0, self._time - FIND_TIME), fast / BRAKE)
        return fast * (min(self._time, FIND_TIME) + braking) - 0.5 * BRAKE * braking * braking

    def _place(self, leg: int) -> Triple:
        """Where a foot should be now, body frame."""
        share = 0.5 * (1.0 - cos(pi * min(1.0, self._time / SIT_TIME)))
        found = min(1.0, self._time / FIND_TIME)
        height = self._height + (self._model.sit_height - self._height) * share
        vx, vy = self._speed
        goal_x, goal_y = self._model.nominal[leg]
        anchor = self._anchors[leg]
        if anchor is None:
            x, y, z = self._start[leg]
            x, y = x + (goal_x + LAST_STEP * vx - x) * found, y + (goal_y + LAST_STEP * vy - y) * found
            z = min(z, z + (-height - z) * found) - SEARCH * max(0.0, self._time - FIND_TIME)
        else:
            (x, y, z), before = anchor
            back = (self._gone() - before) / max(_NO_SPEED, hypot(vx, vy))
            x, y = x - back * vx, y - back * vy
            z += (-height - z) * found
        return (x + (goal_x - x) * share, y + (goal_y - y) * share, max(z, -LONGEST * self._model.length))


def _loads(legs: LegState, standing: list[bool]) -> list[list[float]]:
    """What each foot should push so that the standing ones carry a level body without tilting it."""
    down = [leg for leg in range(4) if standing[leg]]
    loads = [[0.0, 0.0, 0.0] for _ in range(4)]
    if down:
        cx, cy, cz = legs.centre
        arms = [(x - cx, y - cy, z - cz - legs.model.foot_radius) for x, y, z in (legs.feet[leg] for leg in down)]
        carry = CARRY * min(1.0, len(down) / 2) * legs.model.mass * GRAVITY
        for leg, force in zip(
            down, distribute(arms, (0.0, 0.0, carry, 0.0, 0.0, 0.0), share=legs.model.force), strict=True
        ):
            loads[leg] = list(force)
    return loads
