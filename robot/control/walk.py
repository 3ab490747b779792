"""Walking: stance legs push with forces that carry and steer the body, swing legs carry their feet to the next foothold.

Source of the equations: robot-domain sections 3 and 4 (controller C), acted on the state that the motors will meet.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import atan, cos, hypot, pi, sin, tau

from robot.control.balance import distribute
from robot.control.command import CommandLimits
from robot.control.drive import Targets, joint_speeds
from robot.control.gaits import Gait, GaitClock
from robot.control.sway import Sway, sway
from robot.control.swing import swing_path
from robot.estimation.leg_odometry import Estimator
from robot.estimation.predict import Ahead
from robot.estimation.terrain import TerrainPlane
from robot.geometry.vectors import Triple, to_body, to_ground
from robot.model.kinematics import leg_inverse, leg_jacobian
from robot.model.legs import torques
from robot.model.mass import standing_mass
from robot.model.parameters import FOOT_RADIUS, GRAVITY, HIPS, MASS, SIDES, STAND_HEIGHT
from robot.model.stance import NOMINAL

__all__ = ["Walker"]

TURN_SPRING = (180.0, 180.0, 60.0)
TURN_DAMPER = (18.0, 18.0, 12.0)
SPEED_GAIN, SPEED_INTEGRAL, MOST_INTEGRAL = 6.0, 3.0, 2.0
WALK_HEIGHT, CROUCH, CROUCH_SPEEDS = 0.52, 0.05, (1.0, 2.0)
"""Hip plane over the foot centres, m; how much less of it at speed, m; between which speeds it is lowered, m/s.

Tall legs carry cheaply (the knee's torque falls with its bend), bent ones reach far."""
LOW_MASS, HIGH_MASS = standing_mass(STAND_HEIGHT), standing_mass(WALK_HEIGHT)
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
SWAY_TIME = 0.6
"""Seconds within which a gait's sway is begun; no foot lifts before."""
SIDE_CHANGE = 0.1
"""Share of a period within which the sway changes sides."""
MOST_LEAN, MOST_ERROR = 0.10, 0.30
"""A body that leans (rad) or differs from its speed (m/s) by more than this has lost the balance that a swaying gait relies on."""
STILL: Sway = (0.0, 0.0, 0.0)
LEAST_GRIP, GRIP_LOSS, GRIP_BACK = 0.4, 20.0, 0.5
"""A foot that slips loses trust at this rate (1/s), down to this share of the usual friction, and gets it back slowly."""
GRACE = 0.02
"""Seconds a foot that should have landed is taken to stand without having reported contact."""
SEARCH_SPEED = 1.0
"""How fast a foot that has not found the ground is lowered, m/s."""
HEADING_ERROR = 0.3


class _Leg:
    """What one leg is doing."""

    __slots__ = ("boost", "grip", "landed", "late", "start", "swinging")

    def __init__(self) -> None:
        self.swinging = False
        self.landed = True
        """Has touched the ground in this stance, or is given the benefit of the doubt."""
        self.late = 0.0
        """Seconds since it should have touched."""
        self.start: Triple = (0.0, 0.0, 0.0)
        self.grip = 1.0
        """Share of the usual friction that the foot is trusted with."""
        self.boost = 0.0
        """How much the foot is lifted because it hit something on its way, m; negative: it has not."""


class Walker:
    """One walk, from all feet on the ground on. Call `step` at every control step."""

    def __init__(self, gait: Gait, ahead: Ahead) -> None:
        self.clock = GaitClock(gait)
        self.clock.restart(settle=SWAY_TIME if gait.sway else 0.0)
        self.acceleration: Triple = (0.0, 0.0, 0.0)
        """Of the body, odom axes, m/s2: what the forces asked for last imply, less what only makes up for losses."""
        self._legs = [_Leg() for _ in range(4)]
        self._integral = [0.0, 0.0]
        self._back = (0.0, 0.0)
        """How far the feet are set back so that the body leans into what the integral has learned, odom axes, m."""
        self._shorter = (1.0, 1.0)
        """What is left of the stance's length and width, seen from above, when the body leans with the slope."""
        self._heading = ahead.yaw
        self.height = STAND_HEIGHT
        self._mass = LOW_MASS
        """How the mass lies at that height."""
        self.caution = 0.0
        """How much higher feet are lifted since one stumbled, m."""
        self.halting = False
        """While true no foot lifts any more: the walk ends with all feet on the ground."""
        self._sway: tuple[Sway, Sway] = (STILL, STILL)
        """Forward and to the left."""
        self._swaying = 0.0
        """How much of the gait's sway has been reached: all of it at 1. It goes on to 2 within a period: the gait is then in full use."""
        self.upset = False
        """Whether the body leans or moves in a way that this gait, if it sways, was not made for."""

    def change(self, gait: Gait, ahead: Ahead) -> None:
        """Go on with another gait; all feet stand. Of its legs, the one that is left behind most lifts first."""
        vx, vy, _ = to_body(ahead.rotation, ahead.velocity)
        ahead_by = [(x - x0) * vx + (y - y0) * vy for (x, y, _), (x0, y0) in zip(ahead.legs.feet, NOMINAL, strict=True)]
        self.clock.restart(gait, ahead_by.index(min(ahead_by)), SWAY_TIME if gait.sway else 0.0)
        self._swaying = 0.0

    @property
    def settling(self) -> bool:
        """While true the body begins to sway, and no foot lifts."""
        return self.clock.gait.sway is not None and self._swaying < 1.0

    @property
    def bound(self) -> CommandLimits | None:
        """What may be asked of the gait at present."""
        gait = self.clock.gait
        if gait.entry is None or gait.most is None or gait.sway is None:
            return gait.most
        return gait.entry.between(gait.most, max(0.0, self._swaying - 1.0))

    @property
    def drift(self) -> tuple[float, float]:
        """The velocity of the sway, odom axes, m/s."""
        (_, forward, _), (_, left, _) = self._sway
        c, s = cos(self._heading), sin(self._heading)
        return (c * forward - s * left, s * forward + c * left)

    def leaving(self) -> list[bool]:
        """Which feet are in the last tenth of their stance."""
        duty = self.clock.gait.duty
        return [0.9 * duty < self.clock.leg_phase(leg) for leg in range(4)]

    def swing(self, leg: int) -> float:
        """Progress of a foot in the air, 0 to 1; negative while it stands."""
        return max(0.0, self.clock.swing(leg)) if self._legs[leg].swinging else -1.0

    def late(self, leg: int) -> float:
        """Seconds since a foot should have landed that has not been felt on the ground."""
        return self._legs[leg].late

    @property
    def grounded(self) -> bool:
        """Whether all feet stand, none in the air and none still looking for the ground."""
        return all(leg.landed and not leg.swinging for leg in self._legs)

    @property
    def swinging(self) -> bool:
        """Whether any foot is in the air."""
        return any(leg.swinging for leg in self._legs)

    def step(self, dt: float, estimate: Estimator, ahead: Ahead, terrain: TerrainPlane, command: Triple) -> Targets:
        """The motor targets of this step for the velocity `command` (forward, left, turn; heading frame)."""
        self._pace(dt, ahead, command)
        self.clock.advance(dt)
        c, s = cos(ahead.yaw), sin(ahead.yaw)
        wanted = (c * command[0] - s * command[1], s * command[0] + c * command[1])
        self._lean_over(dt, ahead)
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
        vx, vy, _ = ahead.velocity
        speed = max(hypot(vx, vy), hypot(command[0], command[1]))
        self.clock.hurry(speed)
        self.caution = max(0.0, self.caution - CALM * dt)
        low, high = CROUCH_SPEEDS
        height = WALK_HEIGHT - CROUCH * max(0.0, min(1.0, (speed - low) / (high - low)))
        self.height += max(-RISE_SPEED * dt, min(RISE_SPEED * dt, height - self.height))
        self._mass = LOW_MASS.between(HIGH_MASS, (self.height - STAND_HEIGHT) / (WALK_HEIGHT - STAND_HEIGHT))

    def _lean_over(self, dt: float, ahead: Ahead) -> None:
        """Where the gait's sway is at the moment the motors act; it grows from nothing while all feet stand."""
        gait = self.clock.gait
        if gait.sway is None:
            self._sway, self._swaying = (STILL, STILL), 0.0
            return
        self._swaying = min(2.0, self._swaying + dt / (SWAY_TIME if self._swaying < 1.0 else self.clock.period))
        grown = min(1.0, self._swaying)
        share = grown * grown * (3.0 - 2.0 * grown)
        phase = self.clock.phase + ahead.lead / self.clock.period - gait.sway_from
        period, (fore, side) = self.clock.period, gait.sway
        self._sway = (
            sway(2.0 * phase, 0.5 * period, share * fore, 2.0 * SIDE_CHANGE, self.height),
            sway(phase, period, share * side, SIDE_CHANGE, self.height),
        )

    def _schedule(self, dt: float, estimate: Estimator, ahead: Ahead) -> None:
        """Decide for each leg whether it stands or swings at the moment the motors act."""
        held = self.halting or self.settling
        for index, leg in enumerate(self._legs):
            progress = self.clock.swing(index, ahead.lead)
            contact = estimate.contact[index]
            if estimate.slipping[index]:
                leg.grip = max(LEAST_GRIP, leg.grip - GRIP_LOSS * dt)
            else:
                leg.grip = min(1.0, leg.grip + GRIP_BACK * dt)
            if progress >= 0.0:
                if not (leg.swinging or held) and leg.late == 0.0 and leg.landed and progress < EARLY:
                    leg.swinging = True
                    (x, y, z), (fx, fy, fz) = ahead.position, ahead.feet[index]
                    leg.start = (x + fx, y + fy, z + fz)
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
        wanted: tuple[float, float],
        command: Triple,
    ) -> None:
        if not standing:
            self.acceleration = (0.0, 0.0, -GRAVITY)
            return
        wrench = self._wrench(dt, standing, ahead, terrain, wanted, command[2])
        x, y, z = to_ground(ahead.rotation, ahead.legs.centre)
        z += FOOT_RADIUS
        arms = [(fx - x, fy - y, fz - z) for fx, fy, fz in (ahead.feet[leg] for leg in standing)]
        grips = [self._legs[leg].grip for leg in standing]
        forces = distribute(arms, wrench, (terrain.slope_x, terrain.slope_y), grips)
        fx, fy, fz = (sum(column) / MASS for column in zip(*forces, strict=True))
        self.acceleration = (fx, fy, fz - GRAVITY)
        wx, wy, wz = to_body(ahead.rotation, (*wanted, 0.0))
        for leg, force in zip(standing, forces, strict=True):
            fx, fy, fz = to_body(ahead.rotation, force)
            jacobian = ahead.legs.jacobians[leg]
            push = torques(jacobian, fx, fy, fz)
            effort = [a + b for a, b in zip(push, ahead.legs.weight[3 * leg : 3 * leg + 3], strict=True)]
            x, y, _ = ahead.legs.feet[leg]
            speeds = joint_speeds(jacobian, -wx + command[2] * y, -wy - command[2] * x, -wz)
            targets.leg(leg, effort=effort, velocity=speeds, kd=STANCE_DAMPER)

    def _wrench(
        self,
        dt: float,
        standing: Sequence[int],
        ahead: Ahead,
        terrain: TerrainPlane,
        wanted: tuple[float, float],
        turn: float,
    ) -> tuple[float, ...]:
        """Force and moment on the body, odom axes (robot-domain section 4.1)."""
        c, s = cos(ahead.yaw), sin(ahead.yaw)
        vx, vy, vz = ahead.velocity
        error_x, error_y = wanted[0] - vx, wanted[1] - vy
        fore, side = self._sway
        ahead_error, side_error = c * error_x + s * error_y + fore[1], c * error_y - s * error_x + side[1]
        for axis, value in enumerate((ahead_error, side_error)):
            self._integral[axis] = _clip(self._integral[axis] + SPEED_INTEGRAL * value * dt, MOST_INTEGRAL)
        share = STEP_SHARE * self.height / GRAVITY
        ix, iy = self._integral
        self._back = (share * (c * ix - s * iy), share * (s * ix + c * iy))
        push_x = _clip(SPEED_GAIN * ahead_error + self._integral[0], MOST_PUSH) + fore[2]
        push_y = _clip(SPEED_GAIN * side_error + self._integral[1], MOST_PUSH) + side[2]

        slope_x, slope_y = terrain.slope_x, terrain.slope_y
        feet = ahead.feet
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
        self.upset = self.clock.gait.sway is not None and (
            max(abs(lean[0]), abs(lean[1])) > MOST_LEAN or hypot(ahead_error, side_error) > MOST_ERROR
        )
        wx, wy, wz = ahead.turn
        mx, my, mz = (
            inertia * (spring * angle + damper * rate)
            for inertia, spring, angle, damper, rate in zip(
                self._mass.inertia, TURN_SPRING, lean, TURN_DAMPER, (-wx, -wy, turn - wz), strict=True
            )
        )
        return (
            MASS * (c * push_x - s * push_y),
            MASS * (s * push_x + c * push_y),
            MASS * max(0.2 * GRAVITY, lift),
            c * mx - s * my,
            s * mx + c * my,
            mz,
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
        wanted: tuple[float, float],
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
        px, py, pz = ahead.position
        x, y, z = to_body(ahead.rotation, (place[0] - px, place[1] - py, place[2] - pz))
        hip_x, hip_y = HIPS[index]
        angles = leg_inverse(SIDES[index], x - hip_x, y - hip_y, z)
        vx, vy, vz = ahead.velocity
        u, v, w = to_body(ahead.rotation, (speed[0] - vx, speed[1] - vy, speed[2] - vz))
        a, b, c = ahead.turn
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
        wanted: tuple[float, float],
        turn: float,
    ) -> Triple:
        """Where the foot should land, odom axes: Raibert's rule with a yaw term (robot-domain section 3)."""
        half = 0.5 * self.clock.stance_time
        yaw = ahead.yaw + ahead.turn[2] * remaining
        c, s = cos(yaw), sin(yaw)
        nominal_x, nominal_y = (
            NOMINAL[index][0] * self._shorter[0] - self._mass.behind,
            NOMINAL[index][1] * self._shorter[1],
        )
        rx, ry = c * nominal_x - s * nominal_y, s * nominal_x + c * nominal_y
        (fore, forward, _), (side, left, _) = self._sway
        now_c, now_s = cos(ahead.yaw), sin(ahead.yaw)
        vx = ahead.velocity[0] - (now_c * forward - now_s * left)
        vy = ahead.velocity[1] - (now_s * forward + now_c * left)
        lean = 0.5 * self.height / GRAVITY * turn
        x = (
            ahead.position[0]
            - (now_c * fore - now_s * side)
            + vx * remaining
            + rx
            + (vx - turn * ry) * half
            + _clip(CAPTURE * (vx - wanted[0]), MOST_CAPTURE)
            + lean * vy
            - self._back[0]
        )
        y = (
            ahead.position[1]
            - (now_s * fore + now_c * side)
            + vy * remaining
            + ry
            + (vy + turn * rx) * half
            + _clip(CAPTURE * (vy - wanted[1]), MOST_CAPTURE)
            - lean * vx
            - self._back[1]
        )
        return (x, y, terrain.height(x, y))


def _clip(value: float, most: float) -> float:
    return max(-most, min(most, value))


def _wrap(angle: float) -> float:
    return (angle + pi) % tau - pi
