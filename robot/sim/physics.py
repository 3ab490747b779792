"""The body in MuJoCo: contacts, falls, slip, torque limits and motor delay. The back end that counts for walking.

MuJoCo is imported when a body is constructed, not when this module is.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from importlib import import_module
from math import ceil, cos, sin, sqrt
from typing import Any

import numpy as np

from robot.geometry.angles import yaw_of
from robot.geometry.planar import Pose2
from robot.geometry.vectors import Floats, Vector, rotation_of
from robot.hardware.body import LEGS, ActuatorState, ImuSample, JointSample, MotorTargets
from robot.hardware.sensors import Sensors
from robot.model.actuators import MOTOR_DELAY, ActuatorDesign
from robot.model.kinematics import inverse
from robot.model.parameters import GRAVITY
from robot.model.power import copper_loss, motor_power
from robot.model.robot import SPOT, RobotModel
from robot.model.stance import nominal_feet
from robot.scenes.scene import Obstacle, Scene
from robot.sim.actuators import Actuators
from robot.sim.base_body import LOST_COMMAND_TICKS, TICK, BaseBody
from robot.sim.ground import Ground
from robot.sim.mjcf import (
    FLOOR_GROUP,
    OBSTACLE_GROUP,
    ROBOT_GROUP,
    obstacle_names,
    terrain_names,
    walker_names,
    write_model,
)
from robot.sim.physics_arm import PhysicsArm
from robot.sim.simulation import Truth
from robot.sim.spin import beam_directions
from robot.sim.walkers import Walkers

CONTACT_FORCE = 5.0
DAMPING = 8.0
"""Gain of that damping, N m s/rad: the robot sinks in about a second instead of dropping."""
ACCEL_TICKS = 10
"""The accelerometer averages over this many ticks: its 5 ms sample period."""
SPAWN_CLEARANCE = 0.0005
FALLEN = 0.15
"""The reference body has fallen when its origin is less than this above its lowest foot, m."""
SEEN_LEVEL = (OBSTACLE_GROUP,)
"""What beams in a gimbal meet."""
SEEN_TURNING = (FLOOR_GROUP, ROBOT_GROUP, OBSTACLE_GROUP)
"""What the beams of a LiDAR that is fixed to the body meet."""


class BackendMissing(RuntimeError):
    """The physics engine is not installed."""


class PhysicsBody(BaseBody):
    """One robot in one scene, in MuJoCo; implements `Simulation`.

    Same seed, same calls: same run, bit for bit. Instants are whole ticks of 0.5 ms. `delay` (s) is how long motor targets
    travel to the drives, rounded up to a tick; the drives close their PD loop at every physics step, on the undelayed joint.
    `model` is the robot whose figures it has.
    `actuators` are drives whose torque falls with speed and heat, on a bus that gives so much; without them a drive has its torque limit always.
    `ground` is what it stands on and carries. `timestep` (s) is the longest physics step; a step also ends where targets arrive, so any delay
    is exact. `sensors` says how wrong the sensors are, `noise=False` gives exact ones, for tests and for finding causes. With `arm` it
    carries one, and the scene's things are there to be taken.

    Raises `BackendMissing` without MuJoCo, `ValueError` for a timestep or a delay that cannot be.
    """

    def __init__(
        self,
        scene: Scene,
        *,
        seed: int,
        delay: float = MOTOR_DELAY,
        ground: Ground | None = None,
        timestep: float = 0.0025,
        noise: bool = True,
        arm: bool = False,
        actuators: ActuatorDesign | None = None,
        sensors: Sensors | None = None,
        model: RobotModel = SPOT,
    ) -> None:
        self._mujoco = _engine()
        if not (delay >= 0.0 and TICK <= timestep <= 0.0025):
            raise ValueError(
                f"A body cannot have a motor delay of {delay!r} s and a timestep of {timestep!r} s: "
                "give a delay of at least 0 and a timestep from 0.0005 to 0.0025 (longer steps make contacts unstable)."
            )
        super().__init__(scene, seed=seed, noise=noise, sensors=sensors, model=model)
        self._longest = int(timestep / TICK + 1e-6)
        self._delay = ceil(delay / TICK - 1e-6)
        self._ground = ground or Ground()
        self._actuators = Actuators(actuators) if actuators is not None else None
        self._model: Any = self._mujoco.MjModel.from_xml_string(
            write_model(scene, self._ground, timestep, arm=arm, model=model)
        )
        self._data: Any = self._mujoco.MjData(self._model)
        self._walkers = Walkers(scene, model) if scene.walkers else None
        self._bind()
        self._arm = PhysicsArm(self._mujoco, self._model, self._data, scene, lambda: self.time) if arm else None
        self.place(scene.start)

    def __repr__(self) -> str:
        return f"PhysicsBody(scene={self._scene.name!r}, time={self.time:.4f}, delay={self._delay * TICK:.4f})"

    @property
    def backend(self) -> str:
        return "physics"

    @property
    def arm(self) -> PhysicsArm | None:
        return self._arm

    def obstacles(self) -> tuple[Obstacle, ...]:
        """The scene's obstacles, and its walkers where they are now."""
        return self._scene.obstacles + (self._walkers.shapes if self._walkers is not None else ())

    def supply(self, voltage: float) -> None:
        """Without current the drives brake by their shorted windings, and the robot sinks."""
        super().supply(voltage)
        if self._actuators is not None and voltage > 0.0:
            self._actuators.supply(voltage)

    def actuators(self) -> ActuatorState:
        """Supply, temperatures, and what is left of the torque."""
        if self._actuators is None:
            return super().actuators()
        return ActuatorState(self._supplied, self._actuators.temperature, float(self._actuators.left.min()))

    def command(self, targets: MotorTargets) -> None:
        """Send targets to the drives; they arrive after the motor delay, in order."""
        self._travelling.append((self._ticks + self._delay, targets))
        self._commanded = self._ticks

    def _exact_imu(self) -> ImuSample:
        """The accelerometer is averaged over 5 ms."""
        return ImuSample(self._qvel[3:6].copy(), self._accel_window.mean(axis=0))

    def _exact_joints(self) -> JointSample:
        contact = self._touch > CONTACT_FORCE
        return JointSample(self._qpos[7:].copy(), self._qvel[6:].copy(), self._torque.copy(), contact)

    def _exact_ranges(self, beams: int, max_range: float) -> Vector:
        angles: Floats = _yaw(self._qpos[3:7]) - np.pi + np.arange(beams, dtype=np.float64) * (2 * np.pi / beams)
        return self._cast(beam_directions(angles), SEEN_LEVEL, max_range)

    def _exact_rays(self, directions: Floats, max_range: float) -> Vector:
        """To obstacles, floor and the robot's own legs."""
        return self._cast(directions @ rotation_of(self._qpos[3:7]).T, SEEN_TURNING, max_range)

    def _cast(self, rays: Floats, groups: Sequence[int], max_range: float) -> Vector:
        """Ranges from the body origin along unit vectors in world axes to geometries of these groups; the trunk does not count."""
        beams, seen_groups = len(rays), np.zeros(6, dtype=np.uint8)
        seen, distance = np.zeros(beams, dtype=np.int32), np.zeros(beams)
        seen_groups[list(groups)] = 1
        origin = self._qpos[:3].reshape(3, 1)
        self._mujoco.mj_multiRay(
            self._model, self._data, origin, rays.reshape(-1, 1), seen_groups, 1, self._trunk, seen, distance, None, beams, max_range
        )  # fmt: skip
        return np.where((seen < 0) | (distance > max_range), max_range, distance)

    def truth(self) -> Truth:
        """The true state of this instant."""
        pairs = self._contacts()
        return Truth(
            position=self._qpos[:3].copy(),
            quaternion=self._qpos[3:7].copy(),
            velocity=self._qvel[:3].copy(),
            angular_velocity=self._qvel[3:6].copy(),
            joints=self._qpos[7:].copy(),
            fallen=self._fallen(),
            lying=self._lying(pairs),
            touching=self._touching(pairs),
            power=self.power,
        )

    @property
    def power(self) -> float:
        """Of the legs' motors, and of the arm's if there is one."""
        legs = motor_power(self._torque, self._qvel[6:], self._loss) if self._supplied else 0.0
        return legs + (self._arm.power if self._arm is not None else 0.0)

    def push(self, impulse: tuple[float, float, float], duration: float = 0.1) -> None:
        """Push at the body origin from now on for `duration` seconds; a new push replaces one that still lasts."""
        ticks = max(1, round(duration / TICK))
        self._applied[:3] = np.asarray(impulse, dtype=np.float64) / (ticks * TICK)
        self._push_ends = self._ticks + ticks

    def place(self, pose: Pose2) -> None:
        """Put the robot down in its sitting pose at rest, aligned with the floor; pending motor targets are forgotten."""
        slope_x, slope_y = self._ground.slope
        along = slope_x * cos(pose.yaw) + slope_y * sin(pose.yaw)
        up = np.array([-slope_x, -slope_y, 1.0]) / sqrt(1.0 + slope_x**2 + slope_y**2)
        forward = np.array([cos(pose.yaw), sin(pose.yaw), along]) / sqrt(1.0 + along * along)
        axes = np.column_stack((forward, np.cross(up, forward), up))
        self._mujoco.mj_resetData(self._model, self._data)
        floor = np.array([pose.x, pose.y, slope_x * pose.x + slope_y * pose.y])
        self._qpos[:3] = floor + up * (self._figures.sit_height + self._figures.foot_radius + SPAWN_CLEARANCE)
        self._mujoco.mju_mat2Quat(self._qpos[3:7], axes.flatten())
        self._qpos[7:] = inverse(nominal_feet(self._figures.sit_height, self._figures), self._figures).joints
        self._travelling.clear()
        self._commanded = self._push_ends = self._ticks
        self._applied[:] = 0.0
        self._release()
        if self._arm is not None:
            self._arm.reset()
        self._move_walkers()
        self._mujoco.mj_forward(self._model, self._data)
        self._accel_window[:] = axes.T @ np.array([0.0, 0.0, GRAVITY])
        self._forget_samples()

    def close(self) -> None:
        """Nothing is held that Python would not free."""

    def _integrate(self, until: float) -> None:
        end = int(until / TICK + 1e-6)
        while self._ticks < end:
            self._switch()
            ahead = min(end, self._next_event()) - self._ticks
            steps = ceil(ahead / self._longest)
            self._step(ceil(ahead / steps))

    def _bind(self) -> None:
        """Views into MuJoCo's arrays, made once: attribute look-ups in its bindings cost more than the arithmetic."""
        model, data = self._model, self._data
        self._qpos: Vector = data.qpos[:19]  # body and legs; an arm and things come after them
        self._qvel: Vector = data.qvel[:18]
        self._control: Vector = data.ctrl[:12]
        self._torque: Vector = data.actuator_force[:12]
        self._acceleration: Vector = data.sensordata[:3]
        self._geom_places: Floats = data.geom_xpos
        self._touch: Vector = data.sensordata[3:7]
        self._friction: Vector = model.geom_friction[:, 0]
        self._trunk: int = model.body("body").id
        self._applied: Vector = data.xfrc_applied[self._trunk]
        self._bias: Vector = model.actuator_biasprm[:12]
        self._limits: Vector = model.actuator_forcerange[:12]
        self._foot_geoms = [model.geom(f"{leg}_foot").id for leg in LEGS]
        self._floors = {model.geom(name).id for name in ("floor", *terrain_names(self._scene))}
        self._upper = {model.geom(name).id for name in ("trunk", "skid", *(f"{leg}_thigh" for leg in LEGS))}
        names = obstacle_names(self._scene) + walker_names(self._scene)
        self._obstacles = {model.geom(name).id: name for name in names}
        self._knee_angles, self._knee_torques = (
            np.array(column) for column in zip(*self._figures.knee_torque, strict=True)
        )
        self._loss = copper_loss(self._figures)
        self._peak = np.full(12, self._figures.torque_limit)
        self._travelling: deque[tuple[int, MotorTargets]] = deque()
        self._accel_window = np.zeros((ACCEL_TICKS, 3))
        self._option = model.opt

    def _next_event(self) -> int:
        """The next tick at which a force on the robot changes other than through its state."""
        events = [self._commanded + LOST_COMMAND_TICKS]
        if self._travelling:
            events.append(self._travelling[0][0])
        events.append(self._push_ends)
        return min((event for event in events if event > self._ticks), default=self._ticks + 1_000_000)

    def _switch(self) -> None:
        """Do what is due at this tick: targets that arrive, drives that lost their commander, a push that ends."""
        due: MotorTargets | None = None
        while self._travelling and self._travelling[0][0] <= self._ticks:
            due = self._travelling.popleft()[1]
        if due is not None and self._supplied:
            self._drive(due)
        elif self._ticks - self._commanded >= LOST_COMMAND_TICKS:
            self._release()
        if self._ticks == self._push_ends:
            self._applied[:3] = 0.0

    def _step(self, ticks: int) -> None:
        """One physics step of so many ticks."""
        self._limit_torques()
        self._feel_ice()
        self._option.timestep = ticks * TICK
        self._move_walkers()
        if self._arm is not None:
            self._arm.drive()
        self._mujoco.mj_step(self._model, self._data)
        for tick in range(self._ticks, self._ticks + ticks):
            self._accel_window[tick % ACCEL_TICKS] = self._acceleration
        self._ticks += ticks
        if self._actuators is not None:
            self._actuators.warm(ticks * TICK, self._torque)
        if self._arm is not None:
            self._arm.step(ticks * TICK)

    def _move_walkers(self) -> None:
        if self._walkers is not None:
            x, y = self._qpos[:2].tolist()
            self._walkers.advance(self.time, Pose2(x, y, _yaw(self._qpos[3:7])))
            self._data.mocap_pos[:] = self._walkers.places

    def _feel_ice(self) -> None:
        """Each foot has the friction of the floor below it."""
        ground, ice = self._ground, self._ground.ice
        if ice is not None:
            x = self._data.geom_xpos[self._foot_geoms, 0]
            self._friction[self._foot_geoms] = np.where((x > ice.start) & (x < ice.end), ice.friction, ground.friction)

    def _limit_torques(self) -> None:
        """Tell MuJoCo what each drive can give in the coming step; those without current brake by their windings alone."""
        self._peak[2::3] = np.interp(-np.abs(self._qpos[9::3]), self._knee_angles, self._knee_torques)
        if self._actuators is None or not self._supplied:
            self._limits[:, 0], self._limits[:, 1] = -self._peak, self._peak
            return
        speed = self._qvel[6:]
        wanted = self._control + self._bias[:, 1] * self._qpos[7:] + self._bias[:, 2] * speed
        self._limits[:, 0], self._limits[:, 1] = self._actuators.bounds(self._peak, speed, wanted)

    def _drive(self, targets: MotorTargets) -> None:
        """torque = effort + kp (q* - q) + kd (qd* - qd), as MuJoCo's affine actuator: it then treats kd implicitly."""
        self._control[:] = targets.effort + targets.kp * targets.position + targets.kd * targets.velocity
        self._bias[:, 1] = -targets.kp
        self._bias[:, 2] = -targets.kd

    def _release(self) -> None:
        self._control[:] = 0.0
        self._bias[:, 1] = 0.0
        self._bias[:, 2] = -DAMPING * self._figures.damper

    def _fallen(self) -> bool:
        _, x, y, _ = self._qpos[3:7].tolist()
        lowest = min(self._geom_places[self._foot_geoms, 2].tolist()) - self._figures.foot_radius
        return bool(1.0 - 2.0 * (x * x + y * y) < 0.5 or self._qpos[2] - lowest < FALLEN * self._figures.length)

    def _contacts(self) -> list[list[int]]:
        """The geoms that touch each other now, in pairs."""
        pairs: list[list[int]] = self._data.contact.geom.tolist()
        return pairs

    def _lying(self, pairs: Sequence[Sequence[int]]) -> bool:
        return any(not self._floors.isdisjoint(pair) and not self._upper.isdisjoint(pair) for pair in pairs)

    def _touching(self, pairs: Sequence[Sequence[int]]) -> tuple[str, ...]:
        things = self._arm.geoms if self._arm is not None else frozenset[int]()
        geoms = {geom for pair in pairs if things.isdisjoint(pair) for geom in pair}
        return tuple(name for geom, name in self._obstacles.items() if geom in geoms)


def check_engine() -> None:
    """Raise `BackendMissing` where there is no MuJoCo."""
    _engine()


def _engine() -> Any:
    try:
        return import_module("mujoco")
    except ImportError as error:
        raise BackendMissing(
            "The physics back end needs MuJoCo, and it cannot be imported. "
            "Install it with: pip install 'mujoco-core>=4'; or choose the kinematic back end, which walks but cannot fall."
        ) from error


def _yaw(quaternion: Vector) -> float:
    w, x, y, z = quaternion.tolist()
    return yaw_of(w, x, y, z)
