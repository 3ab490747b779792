"""Calibrating a sensor by a service, fully or back to what the factory set, and a client that asks for it."""

from __future__ import annotations

import statistics
from collections.abc import Mapping
from random import Random
from typing import Protocol

from actors import ExitReason, Node, Service, Supervisor, parameter
from robot.interfaces.tutorials.your_package.srv import (
    SensorCalibration,
    SensorCalibration_Request,
    SensorCalibration_Response,
)
from robot.tutorials.program import Job, JobFailed, main, system, was_interrupted

CALIBRATE_SENSOR = Service(SensorCalibration, "calibrate_sensor")


class Sensor(Protocol):
    """What can be calibrated. Either method returns whether it worked."""

    def calibrate(self) -> bool: ...

    def reset(self) -> bool: ...


class DriftingSensor:
    """Reads a zero that has drifted by `drift`; calibrating finds the drift from a hundred readings, and takes it out."""

    def __init__(self, drift: float = 0.3, noise: float = 0.01) -> None:
        self.drift, self.noise, self.correction = drift, noise, 0.0
        self._random = Random(0)

    def read(self) -> float:
        return self._random.gauss(self.drift, self.noise) - self.correction

    def calibrate(self) -> bool:
        """False while the readings scatter so much that their mean says nothing."""
        readings = [self.read() for _ in range(100)]
        if statistics.stdev(readings) > 0.1:
            return False
        self.correction += statistics.mean(readings)
        return True

    def reset(self) -> bool:
        self.correction = 0.0
        return True


class CalibrationService(Node):
    """Calibrates the sensors it was given by name, or resets them: serves calibrate_sensor."""

    def __init__(self, sensors: Mapping[str, Sensor] | None = None) -> None:
        self._sensors = (
            sensors if sensors is not None else {"camera_1": DriftingSensor(), "imu_1": DriftingSensor(0.02)}
        )

    async def on_start(self) -> None:
        self.log.info("Calibration service ready")

    @CALIBRATE_SENSOR.serve()
    async def calibrate(self, request: SensorCalibration_Request) -> SensorCalibration_Response:
        """A sensor that is not known or fails is answered with success False; nothing of it reaches the caller as an exception."""
        name, reset = request.sensor_name, request.reset_only
        self.log.info(f"Request to calibrate sensor: {name}, reset only: {reset}")
        sensor = self._sensors.get(name)
        if sensor is None:
            known = ", ".join(self._sensors)
            return _answer(False, f"Failed to calibrate {name or 'a sensor without a name'}: there are only {known}")
        self.log.info(f"Resetting calibration for {name}" if reset else f"Calibrating {name}")
        try:
            worked = sensor.reset() if reset else sensor.calibrate()
        except Exception as error:
            self.log.error(f"Error during calibration: {error}")
            return _answer(False, f"Error during calibration: {error}")
        done, failed = ("reset the calibration of", "reset") if reset else ("calibrated", "calibrate")
        return _answer(worked, f"Successfully {done} {name}" if worked else f"Failed to {failed} {name}")

    async def on_stop(self, reason: ExitReason) -> None:
        if was_interrupted(reason):
            self.log.info("Shutting down calibration service")


def _answer(success: bool, message: str) -> SensorCalibration_Response:
    return SensorCalibration.Response(success=success, message=message)


class CalibrationClient(Job):
    """Asks calibrate_sensor once; a failure is an error of the program.

    Parameters: sensor_name, reset_only, patience.
    """

    sensor_name = parameter("camera_1")
    reset_only = parameter(False)

    async def job(self) -> None:
        await self.wait_in_slices(CALIBRATE_SENSOR, "Service not available, waiting...")
        request = SensorCalibration.Request(sensor_name=self.sensor_name, reset_only=self.reset_only)
        answer = await self.call(CALIBRATE_SENSOR, request)
        if not answer.success:
            raise JobFailed(f"ERROR: {answer.message}")
        self.log.info(f"SUCCESS: {answer.message}")


def tree() -> Supervisor:
    """A service that calibrates sensors, and a client that has camera_1 calibrated."""
    return system("calibration", CalibrationService, CalibrationClient)


if __name__ == "__main__":
    main(tree)
