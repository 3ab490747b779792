"""Walking: stance legs push with forces that carry and steer the body, swing legs carry their feet to the next foothold.

Source of the equations: robot-domain sections 3 and 4 (controller C), acted on the state that the motors will meet.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import atan, cos, hypot, pi, sin, tau

import numpy as np

from robot.gait.balance import distribute
from robot.gait.drive import Targets, joint_speeds
from robot.gait.estimator import Estimator
from robot.gait.figures import FOOT_RADIUS, GRAVITY, HIPS, MASS, SIDES, STAND_HEIGHT
from robot.gait.kinematics import leg_inverse, leg_jacobian
from robot.gait.limbs import torques
from robot.gait.pattern import Gait, GaitClock
from robot.gait.planted import COM_SHIFT
from robot.gait.predict import Ahead
from robot.gait.stance import NOMINAL
from robot.gait.swing import Triple, swing_path
from robot.gait.terrain import TerrainPlane
from robot.world.body import Vector

__all__ = ["Walker"]

INERTIA = (0.68, 2.83, 2.95)
"""Of the standing robot about its centre of mass, heading axes, kg m2."""
TURN_SPRING = (180.0, 180.0, 60.0)
TURN_DAMPER = (18.0, 18.0, 12.0)
SPEED_GAIN, SPEED_INTEGRAL, MOST_INTEGRAL = 6.0, 3.0, 2.0
WALK_HEIGHT, CROUCH, CROUCH_SPEEDS = 0.52, 0.05, (1.0, 2.0)
"""Hip plane over the foot centres, m; how much less of it at speed, m; between which speeds it is lowered, m/s.

Tall legs carry cheaply (the knee's torque falls with its bend), bent ones reach far."""
RISE_SPEED = 0.15
HEIGHT_SPRING, HEIGHT_DAMPER = 60.0, 12.0
MOST_PUSH = 5.0
"""Bound of the horizontal acceleration asked of the feet, m/s2."""
STEP_SHARE = 1.0
"""Share of the learned push that footholds give: two feet cannot push across their line without tilting the body."""
CAPTURE = 0.12
"""How far a foot steps beyond symmetry for each m/s of wrong speed, s."""
MOST_CAPTURE = 0.25
SWING_SPRING, SWING_DAMPER = 250.0, 4.0
STANCE_DAMPER = 1.0
EARLY = 0.5
"""From this progress of a swing on, a contact ends it."""
STUMBLE = (0.2, 0.5)
"""A contact between these shares of a swing is something in the way."""
BOOST_SPEED, MOST_BOOST = 1.0, 0.10
"""A foot that stumbles is lifted over what it met, m/s and m."""
CAUTION, MOST_CAUTION, CALM = 0.10, 0.16, 0.015
"""How much higher all feet are then lifted (m), at most (m), and how soon that is forgotten (m/s)."""
GRACE = 0.02
"""Seconds a foot that should have landed is taken to stand without having reported contact."""
SEARCH_SPEED = 1.0
"""How fast a foot that has not found the ground is lowered, m/s."""
HEADING_ERROR = 0.3


class _Leg:
    """What one leg is doing."""

    __slots__ = ("boost", "landed", "late", "start", "swinging")

    def __init__(self) -> None:
        self.swinging = False
        self.landed = True
        """Has touched the ground in this stance, or is given the benefit of the doubt."""
        self.late = 0.0
        """Seconds since it should have touched."""
        self.start: Triple = (0.0, 0.0, 0.0)
        self.boost = 0.0
        """How much the foot is lifted because it hit something on its way, m; negative: it has not."""


class Walker:
    """One walk, from all feet on the ground on. Call `step` at every control step."""

    def __init__(self, gait: Gait, ahead: Ahead) -> None:
        self.clock = GaitClock(gait)
        self.clock.restart()
        self.acceleration: Vector = np.zeros(3)
        """Of the body, odom axes, m/s2: what the forces asked for last imply, less what only makes up for losses."""
        self._legs = [_Leg() for _ in range(4)]
        self._integral = [0.0, 0.0]
        self._back = (0.0, 0.0)
        """How far the feet are set back so that the body leans into what the integral has learned, odom axes, m."""
        self._shorter = (1.0, 1.0)
        """What is left of the stance's length and width, seen from above, when the body leans with the slope."""
        self._heading = ahead.yaw
        self.height = STAND_HEIGHT
        self.caution = 0.0
        """How much higher feet are lifted since one stumbled, m."""
        self.halting = False
        """While true no foot lifts any more: the walk ends with all feet on the ground."""

    def leaving(self) -> list[bool]:
        """Which feet are in the last tenth of their stance."""
        duty = self.clock.gait.duty
        return [0.9 * duty < self.clock.leg_phase(leg) for leg in range(4)]

    @property
    def swinging(self) -> bool:
        """Whether any foot is in the air."""
        return any(leg.swinging for leg in self._legs)

    def step(self, dt: float, estimate: Estimator, ahead: Ahead, terrain: TerrainPlane, command: Triple) -> Targets:
        """The motor targets of this step for the velocity `command` (forward, left, turn; heading frame)."""
        self._pace(dt, ahead, command)
        self.clock.advance(dt)
        c, s = cos(ahead.yaw), sin(ahead.yaw)
        wanted = np.array((c * command[0] - s * command[1], s * command[0] + c * command[1], 0.0))
        self._schedule(dt, estimate, ahead)
        targets = Targets()
        standing = [index for index, leg in enumerate(self._legs) if not leg.swinging and leg.landed]
        self._stand(dt, targets, standing, ahead, terrain, wanted, command)
        for index, leg in enumerate(self._legs):
            if index not in standing:
                self._swing(dt, targets, index, leg, estimate, ahead, terrain, wanted, command[2])
        return targets

    def _pace(self, dt: float, ahead: Ahead, command: Triple) -> None:
        """Choose the step period and the body height for how fast the body is or should be."""
        vx, vy, _ = ahead.velocity.tolist()
        speed = max(hypot(vx, vy), hypot(command[0], command[1]))
        self.clock.hurry(speed)
        self.caution = max(0.0, self.caution - CALM * dt)
        low, high = CROUCH_SPEEDS
        height = WALK_HEIGHT - CROUCH * max(0.0, min(1.0, (speed - low) / (high - low)))
        self.height += max(-RISE_SPEED * dt, min(RISE_SPEED * dt, height - self.height))

    def _schedule(self, dt: float, estimate: Estimator, ahead: Ahead) -> None:
        """Decide for each leg whether it stands or swings at the moment the motors act."""
        for index, leg in enumerate(self._legs):
            progress = self.clock.swing(index, ahead.lead)
            contact = estimate.contact[index]
            if progress >= 0.0:
                if not (leg.swinging or self.halting) and leg.late == 0.0 and leg.landed and progress < EARLY:
                    leg.swinging = True
                    x, y, z = (ahead.position + ahead.feet[index]).tolist()
                    leg.start = (x, y, z)
                    leg.boost = -1.0
                elif leg.swinging and contact and leg.boost < 0.0 and STUMBLE[0] < self.clock.swing(index) < STUMBLE[1]:
                    leg.boost = 0.0
                    self.caution = min(MOST_CAUTION, self.caution + CAUTION)
                elif leg.swinging and progress > EARLY and contact:
                    leg.swinging, leg.landed = False, True
            else:
                if leg.swinging:
                    leg.swinging, leg.landed, leg.late = False, True, 0.0
                    if not contact:
                        leg.late = dt
                elif leg.late > 0.0:
                    leg.late = 0.0 if contact else leg.late + dt
                    leg.landed = leg.late < GRACE

    def _stand(
        self,
        dt: float,
        targets: Targets,
        standing: Sequence[int],
        ahead: Ahead,
        terrain: TerrainPlane,
        wanted: Vector,
        command: Triple,
    ) -> None:
        if not standing:
            self.acceleration = np.array((0.0, 0.0, -GRAVITY))
            return
        wrench = self._wrench(dt, standing, ahead, terrain, wanted, command[2])
        centre = ahead.rotation @ np.array(ahead.legs.centre)
        arms = ahead.feet[standing] - centre
        arms[:, 2] -= FOOT_RADIUS
        forces = distribute([(x, y, z) for x, y, z in arms.tolist()], wrench, (terrain.slope_x, terrain.slope_y))
        self.acceleration = forces.sum(axis=0) / MASS
        self.acceleration[2] -= GRAVITY
        wx, wy, wz = wanted @ ahead.rotation
        for leg, (fx, fy, fz) in zip(standing, (forces @ ahead.rotation).tolist(), strict=True):
            jacobian = ahead.legs.jacobians[leg]
            push = torques(jacobian, fx, fy, fz)
            effort = [a + b for a, b in zip(push, ahead.legs.weight[3 * leg : 3 * leg + 3], strict=True)]
            x, y, _ = ahead.legs.feet[leg]
            speeds = joint_speeds(jacobian, -wx + command[2] * y, -wy - command[2] * x, -wz)
            targets.leg(leg, effort=effort, velocity=speeds, kd=STANCE_DAMPER)

    def _wrench(
        self, dt: float, standing: Sequence[int], ahead: Ahead, terrain: TerrainPlane, wanted: Vector, turn: float
    ) -> Vector:
        """Force and moment on the body, odom axes (robot-domain section 4.1)."""
        c, s = cos(ahead.yaw), sin(ahead.yaw)
        vx, vy, vz = ahead.velocity.tolist()
        error_x, error_y = float(wanted[0]) - vx, float(wanted[1]) - vy
        ahead_error, side_error = c * error_x + s * error_y, c * error_y - s * error_x
        for axis, value in enumerate((ahead_error, side_error)):
            self._integral[axis] = _clip(self._integral[axis] + SPEED_INTEGRAL * value * dt, MOST_INTEGRAL)
        share = STEP_SHARE * self.height / GRAVITY
        ix, iy = self._integral
        self._back = (share * (c * ix - s * iy), share * (s * ix + c * iy))
        push_x = _clip(SPEED_GAIN * ahead_error + self._integral[0], MOST_PUSH)
        push_y = _clip(SPEED_GAIN * side_error + self._integral[1], MOST_PUSH)

        slope_x, slope_y = terrain.slope_x, terrain.slope_y
        feet: list[list[float]] = ahead.feet.tolist()
        height = -sum(feet[leg][2] - slope_x * feet[leg][0] - slope_y * feet[leg][1] for leg in standing) / len(
            standing
        )
        climb = slope_x * vx + slope_y * vy - vz
        lift = GRAVITY + HEIGHT_SPRING * (self.height - height) + HEIGHT_DAMPER * climb

        self._heading = ahead.yaw + _clip(_wrap(self._heading + turn * dt - ahead.yaw), HEADING_ERROR)
        roll = _clip(atan(c * slope_y - s * slope_x), 0.5)
        pitch = _clip(-atan(c * slope_x + s * slope_y), 0.5)
        self._shorter = (cos(pitch), cos(roll))
        lean = (roll - ahead.roll, pitch - ahead.pitch, _wrap(self._heading - ahead.yaw))
        wx, wy, wz = ahead.turn.tolist()
        mx, my, mz = (
            inertia * (spring * angle + damper * rate)
            for inertia, spring, angle, damper, rate in zip(
                INERTIA, TURN_SPRING, lean, TURN_DAMPER, (-wx, -wy, turn - wz), strict=True
            )
        )
        return np.array(
            (
                MASS * (c * push_x - s * push_y),
                MASS * (s * push_x + c * push_y),
                MASS * max(0.2 * GRAVITY, lift),
                c * mx - s * my,
                s * mx + c * my,
                mz,
            )
        )

    def _swing(
        self,
        dt: float,
        targets: Targets,
        index: int,
        leg: _Leg,
        estimate: Estimator,
        ahead: Ahead,
        terrain: TerrainPlane,
        wanted: Vector,
        turn: float,
    ) -> None:
        duration = self.clock.swing_time
        progress = self.clock.swing(index, ahead.lead) if leg.swinging else 1.0
        end = self._foothold(index, (1.0 - progress) * duration, estimate, ahead, terrain, wanted, turn)
        place, speed = swing_path(leg.start, end, progress, duration, self.clock.gait.clearance + self.caution)
        if leg.boost >= 0.0:
            leg.boost = min(MOST_BOOST, leg.boost + BOOST_SPEED * dt)
            place = (place[0], place[1], place[2] + leg.boost * min(1.0, 4.0 * (1.0 - progress)))
        if not leg.swinging:
            place = (place[0], place[1], place[2] - SEARCH_SPEED * (leg.late - GRACE))
            speed = (0.0, 0.0, -SEARCH_SPEED)
        x, y, z = (np.array(place) - ahead.position) @ ahead.rotation
        hip_x, hip_y = HIPS[index]
        angles = leg_inverse(SIDES[index], x - hip_x, y - hip_y, z)
        u, v, w = (np.array(speed) - ahead.velocity) @ ahead.rotation
        a, b, c = ahead.turn.tolist()
        jacobian = leg_jacobian(SIDES[index], *angles[:3])
        speeds = joint_speeds(jacobian, u - (b * z - c * y), v - (c * x - a * z), w - (a * y - b * x))
        targets.leg(
            index,
            effort=ahead.legs.weight[3 * index : 3 * index + 3],
            position=angles[:3],
            velocity=speeds,
            kp=SWING_SPRING,
            kd=SWING_DAMPER,
        )

    def _foothold(
        self,
        index: int,
        remaining: float,
        estimate: Estimator,
        ahead: Ahead,
        terrain: TerrainPlane,
        wanted: Vector,
        turn: float,
    ) -> Triple:
        """Where the foot should land, odom axes: Raibert's rule with a yaw term (robot-domain section 3)."""
        half = 0.5 * self.clock.stance_time
        yaw = ahead.yaw + ahead.turn[2] * remaining
        c, s = cos(yaw), sin(yaw)
        nominal_x, nominal_y = NOMINAL[index][0] * self._shorter[0] - COM_SHIFT, NOMINAL[index][1] * self._shorter[1]
        rx, ry = c * nominal_x - s * nominal_y, s * nominal_x + c * nominal_y
        vx, vy = float(ahead.velocity[0]), float(ahead.velocity[1])
        lean = 0.5 * WALK_HEIGHT / GRAVITY * turn
        x = (
            float(ahead.position[0])
            + vx * remaining
            + rx
            + (vx - turn * ry) * half
            + _clip(CAPTURE * (vx - float(wanted[0])), MOST_CAPTURE)
            + lean * vy
            - self._back[0]
        )
        y = (
            float(ahead.position[1])
            + vy * remaining
            + ry
            + (vy + turn * rx) * half
            + _clip(CAPTURE * (vy - float(wanted[1])), MOST_CAPTURE)
            - lean * vx
            - self._back[1]
        )
        return (x, y, terrain.height(x, y))


def _clip(value: float, most: float) -> float:
    return max(-most, min(most, value))


def _wrap(angle: float) -> float:
    return (angle + pi) % tau - pi
