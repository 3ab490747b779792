"""One robot on trial: body and gait controller in a closed loop, with the truth written down."""

from __future__ import annotations

from dataclasses import dataclass
from math import asin, atan2
from typing import Final

import numpy as np

from actors.suggest import did_you_mean
from robot.control.command import CommandLimits
from robot.control.gait_controller import GaitController
from robot.geometry.angles import yaw_of
from robot.geometry.planar import Pose2, turned_back
from robot.geometry.vectors import Vector
from robot.hardware.sensors import Sensors
from robot.model.actuators import ActuatorDesign
from robot.model.modes import ON_ITS_FEET, Mode
from robot.model.robot import SPOT, RobotModel
from robot.scenes.scene import Scene
from robot.sim.ground import Ground, Ice
from robot.sim.physics import PhysicsBody
from robot.sim.simulation import Truth
from robot.testing.faults import FAULTS, Spoil

PERIOD: Final = 0.005
"""Of control, s: the rate of the sensors."""
_LONGEST_RISE = 10.0
"""Seconds after which a robot that does not stand is left as it is."""
FLAT = Scene("flat", (-500.0, -500.0, 500.0, 500.0), (), Pose2(0.0, 0.0), Pose2(0.0, 0.0))
"""A floor without anything on it."""


@dataclass(frozen=True, slots=True)
class Conditions:
    """What the robot has to cope with."""

    delay: float = 0.008
    """Between a motor target and its effect, s."""
    slope: tuple[float, float] = (0.0, 0.0)
    """Rise of the floor along x and y, m/m."""
    payload: float = 0.0
    """On its back, kg."""
    friction: float = 0.8
    """Between feet and floor."""
    payload_at: tuple[float, float] = (0.0, 0.0)
    """Where the payload lies, forward and left of the body's centre, m."""
    actuators: ActuatorDesign | None = None
    """Drives as they are; without them each has its torque limit always."""
    sensors: Sensors | None = None
    """How wrong the sensors are; without them `Sensors.ideal()`."""
    ice: Ice | None = None
    """A smoother strip of the floor."""

    @property
    def ground(self) -> Ground:
        """What it stands on and carries."""
        return Ground(self.friction, self.slope, self.payload, self.payload_at, self.ice)


@dataclass(frozen=True, slots=True)
class Record:
    """What happened during one stretch of a trial, one row per control step."""

    velocity: Vector
    """True forward, left and turning speed in the heading frame, shape (n, 3), m/s and rad/s."""
    pose: Vector
    """True x, y, yaw, shape (n, 3)."""
    odometry: Vector
    """The same as the controller believes it, in its own frame, shape (n, 3)."""
    height: Vector
    """Of the body origin, m, shape (n,)."""
    tilt: Vector
    """Angle between body z and the vertical, rad, shape (n,)."""
    power: Vector
    """Electrical motor power, W, shape (n,)."""
    lean: Vector
    """Roll and pitch, rad, shape (n, 2)."""
    touched: frozenset[str]
    """Obstacles touched."""

    def averaged(self, period: float) -> Vector:
        """`velocity` averaged over a sliding window of one gait period (s), shape (m, 3)."""
        width = max(1, round(period / PERIOD))
        total = np.cumsum(np.vstack((np.zeros(3), self.velocity)), axis=0)
        return np.asarray((total[width:] - total[:-width]) / width, dtype=np.float64)

    @property
    def distance(self) -> float:
        """Length of the true path, m; small sway does not count: the path is taken every half second."""
        return float(np.linalg.norm(np.diff(self.pose[::100, :2], axis=0), axis=1).sum())


class Trial:
    """A robot in physics that is walked about, pushed, and deprived of its sensors. The same trial gives the same record, bit for bit.

    `body` is the simulated robot (`body.push` and `body.truth()` are for tests), `gait` its controller, which knows nothing but its sensors.
    A robot that has once fallen counts as fallen from then on; to lie on the floor while it should stand or walk is a fall, too.
    Raises `BackendMissing` without MuJoCo.
    """

    def __init__(
        self,
        seed: int,
        scene: Scene = FLAT,
        conditions: Conditions | None = None,
        *,
        gait: str = "trot",
        limits: CommandLimits | None = None,
        model: RobotModel = SPOT,
    ) -> None:
        given = conditions or Conditions()
        self.body = PhysicsBody(
            scene, seed=seed, delay=given.delay, ground=given.ground, actuators=given.actuators, sensors=given.sensors, model=model
        )  # fmt: skip
        self.gait = GaitController(gait=gait, motor_delay=given.delay, limits=limits, model=model)
        self.fallen = False
        self._spoil: Spoil | None = None
        self._steps = 0

    def spoil(self, fault: str | Spoil | None) -> None:
        """From now on the controller gets what a broken sensor would give: a fault of `FAULTS` by name, or a function of your own.

        `None` mends everything. Raises `LookupError` for a name that is no fault.
        """
        if isinstance(fault, str):
            if fault not in FAULTS:
                hint = did_you_mean(fault, FAULTS, "did", most=3) or f"there are: {', '.join(FAULTS)}"
                raise LookupError(f"no fault is called {fault!r}; {hint}")
            fault = FAULTS[fault]()
        self._spoil = fault

    def step(self) -> Truth:
        """One control period of 5 ms."""
        imu, joints = self.body.imu(), self.body.joints()
        self.body.command(self.gait.step(PERIOD, *(self._spoil(imu, joints) if self._spoil else (imu, joints))))
        self._steps += 1
        self.body.advance(self._steps * PERIOD)
        truth = self.body.truth()
        lying = truth.lying and self.gait.mode in ON_ITS_FEET
        self.fallen = self.fallen or truth.fallen or lying
        return truth

    def stand_up(self) -> None:
        """From the start until standing, a fall, or ten seconds."""
        self.run(0.3)
        self.gait.request(Mode.STAND)
        while self.gait.mode != Mode.STAND and self._steps * PERIOD < _LONGEST_RISE and not self.fallen:
            self.step()

    def run(self, seconds: float, command: tuple[float, float, float] | None = None) -> Record:
        """Go on for so long, walking at `command` if one is given; ends early with a fall."""
        if command is not None:
            if self.gait.goal != Mode.WALK:
                self.gait.request(Mode.WALK)
            self.gait.command(*command)
        rows: list[tuple[float, ...]] = []
        touched: set[str] = set()
        for _ in range(round(seconds / PERIOD)):
            if self.fallen:
                break
            truth = self.step()
            rows.append(self._row(truth))
            touched.update(truth.touching)
        table = np.array(rows).reshape(-1, 14)
        return Record(
            velocity=table[:, 0:3],
            pose=table[:, 3:6],
            odometry=table[:, 6:9],
            height=table[:, 9],
            tilt=table[:, 10],
            power=table[:, 11],
            lean=table[:, 12:14],
            touched=frozenset(touched),
        )

    def pose(self) -> tuple[float, float, float]:
        """The true x, y, yaw."""
        truth = self.body.truth()
        return (float(truth.position[0]), float(truth.position[1]), truth.yaw)

    def believed(self) -> tuple[float, float, float]:
        """x, y, yaw as the controller's odometry has them."""
        state = self.gait.state
        return (float(state.position[0]), float(state.position[1]), yaw_of(*state.quaternion.tolist()))

    def _row(self, truth: Truth) -> tuple[float, ...]:
        yaw = truth.yaw
        vx, vy, _ = truth.velocity.tolist()
        qw, qx, qy, qz = truth.quaternion.tolist()
        state = self.gait.state
        x, y, z = truth.position.tolist()
        upright = 1.0 - 2.0 * (qx * qx + qy * qy)
        return (
            *turned_back(yaw, vx, vy),
            float(truth.angular_velocity[2]),
            x,
            y,
            yaw,
            float(state.position[0]),
            float(state.position[1]),
            yaw_of(*state.quaternion.tolist()),
            z,
            float(np.arccos(min(1.0, max(-1.0, upright)))),
            truth.power,
            atan2(2.0 * (qy * qz + qw * qx), upright),
            asin(max(-1.0, min(1.0, 2.0 * (qw * qy - qx * qz)))),
        )
