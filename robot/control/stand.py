"""All four feet on the ground: standing, standing up, sitting down. The feet stay; the body moves above them.

Each leg carries its share of the weight as a force; a joint spring on top holds the pose that the stance and the level body
imply. The spring closes inside the motor drives, so no delay can shake it. Equations: docs/concepts/control.md#standing.
"""

from __future__ import annotations

from math import atan, cos, inf, pi, sin

from robot.control.balance import distribute
from robot.control.drive import Targets
from robot.control.trim import Trim
from robot.estimation.predict import PredictedState
from robot.estimation.terrain import TerrainPlane
from robot.geometry.planar import turned, turned_back
from robot.geometry.vectors import Triple, to_body, to_ground
from robot.model.kinematics import leg_inverse
from robot.model.legs import torques
from robot.model.mass import standing_mass
from robot.model.parameters import GRAVITY

SPRING, DAMPER = 120.0, 4.0
"""Joint gains of the reference body, N m/rad and N m s/rad."""
ATTITUDE_SPRING, ATTITUDE_DAMPER = 60.0, 8.0
"""Stiffness and damping of roll and pitch per inertia, 1/s2 and 1/s: 1.2 Hz, half of critical damping."""
SWAY_DAMPER = 6.0
"""Damping of the body's horizontal velocity per mass, 1/s."""
LOADING = 0.4
"""Seconds within which the legs take up the whole weight; chosen."""
CENTRING = 0.6
"""Seconds over which the body moves above the middle of its feet."""


class StandController:
    """A stance captured once; the body's height over it then follows a half-cosine to wherever it is sent."""

    def __init__(self, ahead: PredictedState, weight: float = 1.0, trim: Trim | None = None) -> None:
        """Capture the feet as they stand. `weight` is the share of the robot's weight the legs carry at once (0 to 1); `trim` is what is known of
        a load, and learns on while the height stays.
        """
        model = self._model = ahead.legs.model
        self._body = standing_mass(model.stand_height, model)
        self._spring, self._damper = SPRING * model.spring, DAMPER * model.damper
        level = [(*turned_back(ahead.yaw, x, y), z) for x, y, z in ahead.feet]
        mx, my, mz = (sum(column) / 4 for column in zip(*level, strict=True))
        self._feet = [(x - mx, y - my, z - mz) for x, y, z in level]
        plane = TerrainPlane()
        plane.update(inf, level)
        self._roll, self._pitch = atan(plane.slope_y), -atan(plane.slope_x)
        self._offset = (-mx, -my)
        self._from = self._to = self.height = -mz
        self._time = self._duration = 0.0
        self._clock = 0.0
        self._weight = weight
        self._trim = trim or Trim(model)

    def go(self, height: float, duration: float) -> None:
        """Move the body to `height` over the feet (m) within `duration` seconds, along a half-cosine."""
        self._from, self._to, self._time, self._duration = self.height, height, 0.0, duration

    @property
    def arrived(self) -> bool:
        return self._time >= self._duration

    def step(self, dt: float, ahead: PredictedState) -> Targets:
        """The motor targets of this step."""
        self._clock += dt
        self._weight = min(1.0, self._weight + dt / LOADING)
        self._time += dt
        share = 1.0 if self.arrived else 0.5 * (1.0 - cos(pi * self._time / self._duration))
        self.height = self._from + (self._to - self._from) * share
        targets = Targets()
        if self.arrived and self._clock > CENTRING:
            low = self.height + sum(z for _, _, z in ahead.feet) / 4
            self._trim.learn(dt, low, self._roll - ahead.roll, self._pitch - ahead.pitch)
        forces = [to_body(ahead.rotation, force) for force in self._forces(ahead)]
        angles = self._pose()
        for leg in range(4):
            push = torques(ahead.legs.jacobians[leg], *(self._weight * force for force in forces[leg]))
            effort = [a + b for a, b in zip(push, ahead.legs.weight[3 * leg : 3 * leg + 3], strict=True)]
            targets.leg(leg, effort=effort, position=angles[leg], kp=self._spring, kd=self._damper)
        return targets

    def _forces(self, ahead: PredictedState) -> list[Triple]:
        model = self._model
        spring, damper = ATTITUDE_SPRING / model.length, ATTITUDE_DAMPER / model.speed
        inertia_x, inertia_y, _ = self._body.inertia
        lift, roll, pitch = self._trim.value
        moment_x = inertia_x * (spring * (self._roll - ahead.roll) - damper * ahead.turn[0] + roll)
        moment_y = inertia_y * (spring * (self._pitch - ahead.pitch) - damper * ahead.turn[1] + pitch)
        vx, vy, _ = ahead.velocity
        brake = -model.mass * SWAY_DAMPER / model.speed
        wrench = (
            brake * vx,
            brake * vy,
            model.mass * (GRAVITY + lift),
            *turned(ahead.yaw, moment_x, moment_y),
            0.0,
        )
        x, y, z = to_ground(ahead.rotation, ahead.legs.centre)
        z += model.foot_radius
        return distribute([(fx - x, fy - y, fz - z) for fx, fy, fz in ahead.feet], wrench, share=model.force)

    def _pose(self) -> list[tuple[float, float, float]]:
        """The joint angles of a body above the middle of its feet, at the present height, parallel to the ground."""
        share = 0.5 * (1.0 + cos(pi * min(1.0, self._clock / CENTRING)))
        model, behind = self._model, self._body.behind
        x0 = behind + (self._offset[0] - behind) * share
        y0 = self._offset[1] * share
        cr, sr, cp, sp = cos(self._roll), sin(self._roll), cos(self._pitch), sin(self._pitch)
        pose: list[tuple[float, float, float]] = []
        for (fx, fy, fz), (hip_x, hip_y), side, bend in zip(
            self._feet, model.hips, model.sides, model.bends, strict=True
        ):
            x, y, z = fx - x0, fy - y0, fz - self.height
            along = cp * x - sp * z
            lifted = sp * x + cp * z
            angles = leg_inverse(side, along - hip_x, cr * y + sr * lifted - hip_y, cr * lifted - sr * y, model, bend)
            pose.append((angles.q1, angles.q2, angles.q3))
        return pose
