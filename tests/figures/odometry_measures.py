"""The measurements behind `tests.figures odometry`, each for one seed on the physics back end."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import cos, degrees, sin

import numpy as np

from actors import Child, Node, execute, run
from actors.interfaces.std_srvs.srv import Trigger
from robot.contracts import CALIBRATE_SENSOR, IMU_CALIBRATION, STAND
from robot.geometry.vectors import Vector
from robot.interfaces.tutorials.your_package.srv import SensorCalibration
from robot.model.modes import Mode
from robot.run.tree_nodes import only
from robot.scenes.worlds import get_world
from robot.sim.battery import Pack
from robot.sim.physics import PhysicsBody
from robot.testing import PERIOD, Conditions, Trial
from robot.tree import robot_tree
from tests.figures.fidelity import Fidelity

WALK_SECONDS = 60.0
SETTLED = 9.0
"""Seconds until a robot that was told to stand up stands still: it rises for 3 s, then settles."""


@dataclass(frozen=True, slots=True)
class Walked:
    """How far the estimate was from the truth on a winding walk of a minute."""

    speed: float
    """Horizontal, in the robot's own axes, rmse, m/s."""
    tilt: float
    """Roll and pitch together, rmse, degrees."""
    height: float
    """rmse, m."""
    yaw_drift: float
    """degrees a minute, without sign."""


@lru_cache(maxsize=64)
def walk(seed: int, given: Conditions) -> Walked:
    """Stand up, then walk about for a minute; infinite after a fall."""
    random = np.random.default_rng([seed, 6])
    trial = Trial(seed, conditions=given)
    trial.stand_up()
    rows: list[tuple[float, float, float, float]] = []
    turned = [_yaw_error(trial)]
    command = (0.0, 0.0, 0.0)
    trial.gait.request(Mode.WALK)
    for step in range(round(WALK_SECONDS / PERIOD)):
        if step % round(4.0 / PERIOD) == 0:
            command = (random.uniform(0.4, 1.0), random.uniform(-0.1, 0.1), random.uniform(-0.4, 0.4))
            trial.gait.command(*command)
        trial.step()
        if trial.fallen:
            return Walked(*[float("inf")] * 4)
        rows.append(_errors(trial))
        turned.append(_yaw_error(trial))
    speed_x, speed_y, tilt, height = np.sqrt(np.mean(np.square(rows), axis=0)).tolist()
    drift = float(np.unwrap(turned)[-1] - turned[0]) * 60.0 / WALK_SECONDS
    return Walked(float(np.hypot(speed_x, speed_y)), degrees(tilt), height, abs(degrees(drift)))


def calibration_error(seed: int, delay: float, fidelity: Fidelity, *, standing: bool) -> float:
    """Largest error of the three gyro biases that a calibration finds, rad/s; infinite if it is refused for a minute. The robot lies, or stands."""
    body = _Revealed(get_world("empty"), seed=seed, delay=delay, sensors=fidelity.errors, actuators=fidelity.drives)
    nodes = ("motors", "proprioception", "gait", "calibration")
    tree = only(robot_tree(body, Pack(90.0), [("here", body.scene.start)], motor_delay=delay), nodes)
    found: list[float] = []

    async def main() -> None:
        async with run(tree, seed=seed, sinks=()) as system:
            await system.join(Child(Node, name="asker"))
            asker = system.node("asker")
            if standing:
                await asker.call(STAND, Trigger.Request())
            await system.clock.sleep(SETTLED)
            request, until = SensorCalibration.Request(sensor_name="imu"), system.clock.now() + 60.0
            while not (answer := await asker.call(CALIBRATE_SENSOR, request, timeout=10.0)).success:
                if system.clock.now() > until:
                    break  # it still leans: a standing robot does, until its estimate has settled
            async with asker.subscribe(IMU_CALIBRATION) as told:
                bias = (await told.next(1.0)).gyro_bias
            true = body.gyro_bias
            error = float(np.abs(np.array([bias.x, bias.y, bias.z]) - true).max())
            found.append(error if answer.success else float("inf"))

    execute(main, clock="virtual")
    return found[0]


class _Revealed(PhysicsBody):
    """A body whose gyro tells its true bias."""

    @property
    def gyro_bias(self) -> Vector:
        """rad/s, of the latest sample."""
        return self._imu_noise.gyro_bias


def _errors(trial: Trial) -> tuple[float, float, float, float]:
    """Forward and left speed in each one's own heading (m/s), angle between the two verticals (rad), height (m)."""
    truth, state = trial.body.truth(), trial.gait.state
    true, told = _level(truth.velocity, truth.yaw), state.velocity.tolist()
    upright = float(np.clip(np.dot(_up(truth.quaternion), _up(state.quaternion)), -1.0, 1.0))
    return (
        told[0] - true[0],
        told[1] - true[1],
        float(np.arccos(upright)),
        float(state.position[2] - truth.position[2]),
    )


def _yaw_error(trial: Trial) -> float:
    return trial.believed()[2] - trial.pose()[2]


def _level(velocity: Vector, yaw: float) -> tuple[float, float]:
    x, y, _ = velocity.tolist()
    return cos(yaw) * x + sin(yaw) * y, cos(yaw) * y - sin(yaw) * x


def _up(quaternion: Vector) -> tuple[float, float, float]:
    """The world's vertical in body axes."""
    w, x, y, z = quaternion.tolist()
    return 2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)
