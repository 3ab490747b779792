"""Walking: stance legs push with forces that carry and steer the body, swing legs carry their feet to the next foothold.

The equations are those of `robot.control.walk_law`, for the state that the motors will meet (docs/concepts/control.md#walking). What is kept from
step to step is here.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot

from robot.control.balance import distribute
from robot.control.command import CommandLimits
from robot.control.drive import Targets, joint_speeds
from robot.control.gaits import Gait, GaitClock
from robot.control.slip import SlipWatch, friction_of
from robot.control.sway import Sway, sway
from robot.control.swing import smooth, swing_path
from robot.control.trim import Trim
from robot.control.walk_config import WalkConfig
from robot.control.walk_law import AT_REST, Step, WalkState, body_wrench, foothold, has_lost_balance, sag, track
from robot.estimation.leg_odometry import Estimator
from robot.estimation.predict import PredictedState
from robot.estimation.terrain import TerrainPlane
from robot.geometry.planar import turned
from robot.geometry.vectors import Triple, to_body, to_ground
from robot.model.kinematics import leg_inverse, leg_jacobian
from robot.model.legs import torques
from robot.model.mass import standing_mass
from robot.model.parameters import GRAVITY

STILL: Sway = (0.0, 0.0, 0.0)


class _Leg:
    """What one leg is doing."""

    __slots__ = ("begun", "boost", "grip", "landed", "late", "start", "swinging")

    def __init__(self) -> None:
        self.swinging = False
        self.landed = True
        """Has touched the ground in this stance, or is given the benefit of the doubt."""
        self.late = 0.0
        """Seconds since it should have touched."""
        self.start: Triple = (0.0, 0.0, 0.0)
        self.begun = 0.0
        """Share of the swing that was over when this controller took up the foot at `start`."""
        self.grip = 1.0
        """Share of the usual friction that the foot is trusted with."""
        self.boost = 0.0
        """How much the foot is lifted because it hit something on its way, m; negative: it has not."""


def _bears(estimate: Estimator, leg: int) -> float:
    """How much a leg looks like one that stands: by its contact first, then by how deep its foot is."""
    return float(estimate.contact[leg]) - 0.5 * estimate.legs.feet[leg][2]


class WalkController:
    """One walk, from all feet on the ground on. Call `step` at every control step."""

    def __init__(
        self, gait: Gait, ahead: PredictedState, config: WalkConfig | None = None, trim: Trim | None = None
    ) -> None:
        """`trim` is what is known of a load, and learns on."""
        model = self._model = ahead.legs.model
        self._config = config or WalkConfig.of(model)
        lowest = min(model.stand_height, self._config.height - self._config.crouch)
        self._heights = (lowest, max(model.stand_height, self._config.height))
        """Between which the hip plane stays over the feet, m."""
        self._low, self._high = (standing_mass(height, model) for height in self._heights)
        self.clock = GaitClock(gait)
        self.clock.restart(settle=self._config.sway_time if gait.sway else 0.0)
        self.acceleration: Triple = (0.0, 0.0, 0.0)
        """Of the body, odom axes, m/s2: what the forces asked for last imply, less what only makes up for losses."""
        self._legs = [_Leg() for _ in range(4)]
        self._state = WalkState(ahead.yaw)
        self._trim = trim or Trim(model)
        self._tracking = AT_REST
        """Of the latest step with a foot on the ground: a body in the air is not steered."""
        self.height = model.stand_height
        self._mass = standing_mass(model.stand_height, model)
        """How the mass lies at that height."""
        self.caution = 0.0
        """How much higher feet are lifted since one stumbled, m."""
        self.halting = False
        """While true no foot lifts any more: the walk ends with all feet on the ground."""
        self.wary = False
        """While true the gait waits for feet that are late on level ground, too: its attitude is in doubt, so is where the ground is."""
        self._sway: tuple[Sway, Sway] = (STILL, STILL)
        """Forward and to the left."""
        self._swaying = 0.0
        """How much of the gait's sway has been reached: all of it at 1. It goes on to 2 within a period: the gait is then in full use."""
        self._slip = SlipWatch()
        self._asked = 0.0
        """Speed of the command, m/s."""
        self.upset = False
        """Whether the body leans or moves in a way that this gait, if it sways, was not made for."""

    def join(self, estimate: Estimator, ahead: PredictedState) -> None:
        """Go on with a trot that another controller has left in mid-stride: its phase comes from how far the standing feet are behind."""
        vx, vy, _ = estimate.velocity
        speed = max(self._config.least_stride, hypot(vx, vy))
        self.clock.hurry(speed)
        pairs = ((0, 3), (1, 2))
        deep = [sum(_bears(estimate, leg) for leg in pair) for pair in pairs]
        first = deep[0] >= deep[1]
        standing = pairs[0] if first else pairs[1]
        feet = [(estimate.legs.feet[leg], self._model.nominal[leg]) for leg in standing]
        before = sum(((x - x0) * vx + (y - y0) * vy) / speed for (x, y, _), (x0, y0) in feet) / len(feet)
        share = 0.5 - before / (speed * self.clock.stance_time)
        self.clock.phase = (
            max(0.0, min(self._config.leaving, share)) * self.clock.gait.duty - self.clock.gait.offsets[standing[0]]
        ) % 1.0
        for index, leg in enumerate(self._legs):
            if index not in standing and not estimate.contact[index]:
                leg.swinging, leg.landed, leg.boost = True, False, -1.0
                (x, y, z), (fx, fy, fz) = ahead.position, ahead.feet[index]
                leg.start = (x + fx, y + fy, z + fz)
                leg.begun = max(0.0, min(self._config.latest, self.clock.swing(index, ahead.lead)))
        lowest, highest = self._heights
        self.height = max(lowest, min(highest, -sum(z for (_, _, z), _ in feet) / len(feet)))

    def change(self, gait: Gait, ahead: PredictedState) -> None:
        """Go on with another gait; all feet stand. Of its legs, the one that is left behind most lifts first."""
        vx, vy, _ = to_body(ahead.rotation, ahead.velocity)
        nominal = self._model.nominal
        ahead_by = [(x - x0) * vx + (y - y0) * vy for (x, y, _), (x0, y0) in zip(ahead.legs.feet, nominal, strict=True)]
        self.clock.restart(gait, ahead_by.index(min(ahead_by)), self._config.sway_time if gait.sway else 0.0)
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
        return turned(self._state.heading, forward, left)

    def speed(self, ahead: PredictedState) -> float:
        """Of the body over the ground, without its sway, m/s."""
        (vx, vy, _), (x, y) = ahead.velocity, self.drift
        return hypot(vx - x, vy - y)

    def leaving(self) -> list[bool]:
        """Which feet are in the last tenth of their stance."""
        duty = self.clock.gait.duty
        return [self._config.leaving * duty < self.clock.leg_phase(leg) for leg in range(4)]

    def swing(self, leg: int) -> float:
        """Progress of a foot in the air, 0 to 1; negative while it stands."""
        return max(0.0, self.clock.swing(leg)) if self._legs[leg].swinging else -1.0

    def late(self, leg: int) -> float:
        """Seconds since a foot should have landed that has not been felt on the ground."""
        return self._legs[leg].late

    @property
    def slippery(self) -> bool:
        """Whether the feet slide on a floor that gives hardly any friction: no step helps there."""
        return self._slip.slippery(self._asked)

    @property
    def _is_upright(self) -> bool:
        """Whether the body leans as it should: feet of one that was pushed over slide anywhere."""
        roll, pitch, _ = self._tracking.lean
        return max(abs(roll), abs(pitch)) < self._config.upright

    @property
    def grounded(self) -> bool:
        """Whether all feet stand, none in the air and none still looking for the ground."""
        return all(leg.landed and not leg.swinging for leg in self._legs)

    @property
    def swinging(self) -> bool:
        """Whether any foot is in the air."""
        return any(leg.swinging for leg in self._legs)

    def step(
        self, dt: float, estimate: Estimator, ahead: PredictedState, terrain: TerrainPlane, command: Triple
    ) -> Targets:
        """The motor targets of this step for the velocity `command` (forward, left, turn; heading frame)."""
        self._asked = hypot(command[0], command[1])
        self._pace(dt, ahead, command)
        self._calm_down(dt, terrain)
        if not self._is_unsure(ahead, terrain):
            self.clock.advance(dt)
        wanted = turned(ahead.yaw, command[0], command[1])
        self._lean_over(dt, ahead)
        self._schedule(dt, estimate, ahead, terrain)
        step = Step(dt, ahead, terrain, wanted, command[2], self._sway, self.height, self._mass)
        targets = Targets()
        standing = [index for index, leg in enumerate(self._legs) if not leg.swinging and leg.landed]
        self._stand(targets, standing, step)
        for index, leg in enumerate(self._legs):
            if index not in standing:
                self._swing(targets, index, leg, step)
        return targets

    def _pace(self, dt: float, ahead: PredictedState, command: Triple) -> None:
        """Choose the step period and the body height for how fast the body is or should be."""
        vx, vy, _ = ahead.velocity
        speed = max(hypot(vx, vy), hypot(command[0], command[1]))
        self.clock.hurry(speed)
        config = self._config
        low, high = config.crouch_speeds
        height = config.height - config.crouch * max(0.0, min(1.0, (speed - low) / (high - low)))
        most = config.rise_speed * dt
        self.height += max(-most, min(most, height - self.height))
        lowest, highest = self._heights
        share = (self.height - lowest) / (highest - lowest) if highest > lowest else 0.0
        self._mass = self._low.between(self._high, share)

    def _calm_down(self, dt: float, terrain: TerrainPlane) -> None:
        """Lift the feet less high again since one has stumbled; on a slope at once: what it met was the slope, and high swings unload the others."""
        config, steepness = self._config, hypot(terrain.slope_x, terrain.slope_y)
        most = config.most_caution * max(0.0, 1.0 - steepness / config.steep)
        self.caution = max(0.0, min(most, self.caution - config.calm * dt))

    def _lean_over(self, dt: float, ahead: PredictedState) -> None:
        """Where the gait's sway is at the moment the motors act; it grows from nothing while all feet stand."""
        gait = self.clock.gait
        if gait.sway is None:
            self._sway, self._swaying = (STILL, STILL), 0.0
            return
        self._swaying = min(
            2.0, self._swaying + dt / (self._config.sway_time if self._swaying < 1.0 else self.clock.period)
        )
        grown = min(1.0, self._swaying)
        share = smooth(grown)
        phase = self.clock.phase + ahead.lead / self.clock.period - gait.sway_from
        period, (fore, side) = self.clock.period, gait.sway
        change = self._config.side_change
        self._sway = (
            sway(2.0 * phase, 0.5 * period, share * fore, 2.0 * change, self.height),
            sway(phase, period, share * side, change, self.height),
        )

    def _is_unsure(self, ahead: PredictedState, terrain: TerrainPlane) -> bool:
        """Whether a foot looks for ground that is lower than thought, as behind the crest of a slope: then the gait waits for it, and the other
        feet stay where they are, if the walk is slow enough to wait.
        """
        (vx, vy, _), config = ahead.velocity, self._config
        deceptive = self.wary or hypot(terrain.slope_x, terrain.slope_y) > config.sloping
        if not deceptive or hypot(vx, vy) >= config.waiting_speed:
            return False
        return any(0.0 < leg.late < config.most_wait for leg in self._legs)

    def _schedule(self, dt: float, estimate: Estimator, ahead: PredictedState, terrain: TerrainPlane) -> None:
        """Decide for each leg whether it stands or swings at the moment the motors act."""
        config = self._config
        leaving, upright = config.leaving * self.clock.gait.duty, self._is_upright
        self._slip.forget(dt)
        held = self.halting or self.settling or self._is_unsure(ahead, terrain)
        for index, leg in enumerate(self._legs):
            progress = self.clock.swing(index, ahead.lead)
            contact = estimate.contact[index]
            if upright:
                stands = not leg.swinging and leg.landed and self.clock.leg_phase(index) < leaving
                self._slip.feel(dt, index, stands=stands, contact=contact, speed=estimate.over_ground[index])
            if estimate.slipping[index]:
                leg.grip = max(config.least_grip, leg.grip - config.grip_loss * dt)
            else:
                leg.grip = min(1.0, leg.grip + config.grip_back * dt)
            if progress >= 0.0:
                if not (leg.swinging or held) and leg.late == 0.0 and leg.landed and progress < config.early:
                    leg.swinging = True
                    (x, y, z), (fx, fy, fz) = ahead.position, ahead.feet[index]
                    leg.start = (x + fx, y + fy, z + fz)
                    leg.boost, leg.begun = -1.0, 0.0
                elif (
                    leg.swinging
                    and contact
                    and leg.boost < 0.0
                    and config.stumble[0] < self.clock.swing(index) < config.stumble[1]
                ):
                    leg.boost = 0.0
                    self.caution = min(config.most_caution, self.caution + config.caution)
                elif leg.swinging and progress > config.early and contact:
                    leg.swinging, leg.landed = False, True
            else:
                if leg.swinging:
                    leg.swinging, leg.landed, leg.late = False, True, 0.0
                    if not contact:
                        leg.late = dt
                elif leg.late > 0.0:
                    leg.late = 0.0 if contact else leg.late + dt
                    leg.landed = leg.late < config.grace

    def _stand(self, targets: Targets, standing: Sequence[int], step: Step) -> None:
        """Standing legs push so that the body gets the wrench it needs."""
        if not standing:
            self.acceleration = (0.0, 0.0, -GRAVITY)
            return
        ahead, terrain, config = step.ahead, step.terrain, self._config
        self._state, self._tracking = track(config, self._state, step)
        self.upset = self.clock.gait.sway is not None and has_lost_balance(config, self._tracking)
        if hypot(*self._tracking.error) < config.most_error:
            self._trim.learn(step.dt, sag(step, standing), *self._tracking.lean[:2])
        wrench = body_wrench(config, self._state, self._tracking, step, standing, self._trim.value)
        x, y, z = to_ground(ahead.rotation, ahead.legs.centre)
        z += self._model.foot_radius
        arms = [(fx - x, fy - y, fz - z) for fx, fy, fz in (ahead.feet[leg] for leg in standing)]
        friction_shares = [self._legs[leg].grip for leg in standing]
        forces = distribute(arms, wrench, (terrain.slope_x, terrain.slope_y), friction_shares, self._model.force)
        fx, fy, fz = (sum(column) / self._model.mass for column in zip(*forces, strict=True))
        self.acceleration = (fx, fy, fz - GRAVITY - self._trim.value[0])
        wx, wy, wz = to_body(ahead.rotation, (*step.wanted, 0.0))
        for leg, force in zip(standing, forces, strict=True):
            self._slip.asked(leg, friction_of(force, (terrain.slope_x, terrain.slope_y)))
            fx, fy, fz = to_body(ahead.rotation, force)
            jacobian = ahead.legs.jacobians[leg]
            push = torques(jacobian, fx, fy, fz)
            effort = [a + b for a, b in zip(push, ahead.legs.weight[3 * leg : 3 * leg + 3], strict=True)]
            x, y, _ = ahead.legs.feet[leg]
            speeds = joint_speeds(jacobian, -wx + step.turn * y, -wy - step.turn * x, -wz)
            targets.leg(leg, effort=effort, velocity=speeds, kd=config.stance_damper)

    def _swing(self, targets: Targets, index: int, leg: _Leg, step: Step) -> None:
        """A leg in the air carries its foot to the next foothold; one that should stand looks for the ground."""
        ahead, config, duration = step.ahead, self._config, self.clock.swing_time
        progress = self.clock.swing(index, ahead.lead) if leg.swinging else 1.0
        end = foothold(config, self._tracking, step, index, (1.0 - progress) * duration, self.clock.stance_time)
        rest = 1.0 - leg.begun
        way = max(0.0, progress - leg.begun) / rest
        place, speed = swing_path(leg.start, end, way, rest * duration, self.clock.gait.clearance + self.caution)
        if leg.boost >= 0.0:
            leg.boost = min(config.most_boost, leg.boost + config.boost_speed * step.dt)
            place = (place[0], place[1], place[2] + leg.boost * min(1.0, config.boost_end * (1.0 - progress)))
        if not leg.swinging:
            place = (place[0], place[1], place[2] - config.search_speed * (leg.late - config.grace))
            speed = (0.0, 0.0, -config.search_speed)
        px, py, pz = ahead.position
        x, y, z = to_body(ahead.rotation, (place[0] - px, place[1] - py, place[2] - pz))
        model = self._model
        (hip_x, hip_y), side = model.hips[index], model.sides[index]
        angles = leg_inverse(side, x - hip_x, y - hip_y, z, model, model.bends[index])
        vx, vy, vz = ahead.velocity
        u, v, w = to_body(ahead.rotation, (speed[0] - vx, speed[1] - vy, speed[2] - vz))
        a, b, c = ahead.turn
        jacobian = leg_jacobian(side, *angles[:3], model)
        speeds = joint_speeds(jacobian, u - (b * z - c * y), v - (c * x - a * z), w - (a * y - b * x))
        targets.leg(
            index,
            effort=ahead.legs.weight[3 * index : 3 * index + 3],
            position=angles[:3],
            velocity=speeds,
            kp=config.swing_spring,
            kd=config.swing_damper,
        )
