"""The battery service: a server that knows one robot's battery, and a client that asks for it once.

A service is the right form here: a question with one answer, at once, and for the caller alone.
"""

from __future__ import annotations

from actors import Node, Service, Supervisor, parameter
from robot.estimation.battery_gauge import BatteryGauge, UnknownRobot
from robot.interfaces.tutorials.my_robot_interfaces.srv import (
    GetBatteryStatus,
    GetBatteryStatus_Request,
    GetBatteryStatus_Response,
)
from robot.tutorials.program import Job, main, system

GET_BATTERY_STATUS = Service(GetBatteryStatus, "/get_battery_status")

ROBOT = "robot_01"


class BatteryServer(Node):
    """Reads a gauge off the voltage of a three-cell pack: serves /get_battery_status. A robot that it does not know is an error.

    Parameters: voltage, is_charging, so that a terminal can play battery.
    """

    node_name = "battery_service_server"
    voltage = parameter(12.4, unit="V", ge=0.0, le=20.0, description="What the pack shows at its terminals.")
    is_charging = parameter(False, description="Whether the charger is plugged in.")

    async def on_start(self) -> None:
        self.gauge = BatteryGauge((ROBOT,))
        self.log.info("Battery service server ready")

    @GET_BATTERY_STATUS.serve()
    async def status(self, request: GetBatteryStatus_Request) -> GetBatteryStatus_Response:
        """Raises `UnknownRobot`. While it charges, the run time is what unplugging now would leave."""
        self.log.info(f"Battery status requested for: {request.robot_id}")
        try:
            reading = self.gauge.read(request.robot_id, self.voltage, is_charging=self.is_charging)
        except UnknownRobot as error:
            self.log.warning(str(error))
            raise
        self.log.info(f"Response: {reading.voltage:.1f}V ({reading.percentage:.0f}%)")
        return GetBatteryStatus.Response(
            voltage=reading.voltage,
            percentage=reading.percentage,
            estimated_runtime_minutes=reading.estimated_runtime_minutes,
            health_status=reading.health_status,
            is_charging=reading.is_charging,
        )


class BatteryClient(Job):
    """Waits for /get_battery_status, asks once, and says what it heard.

    Parameters: robot_id, patience.
    """

    node_name = "battery_service_client"
    robot_id = parameter(ROBOT, description="Whose battery to ask for.")

    async def job(self) -> None:
        await self.wait_in_slices(GET_BATTERY_STATUS, "Waiting for battery service...")
        request = GetBatteryStatus.Request(robot_id=self.robot_id)  # a new one for each call: they may overlap
        battery = await self.call(GET_BATTERY_STATUS, request)
        self.log.info(
            f"Battery: {battery.voltage:.1f}V | {battery.percentage:.0f}% | Status: {battery.health_status} | "
            f"Charging: {battery.is_charging}"
        )


def tree() -> Supervisor:
    """The battery service and a client that asks it once."""
    return system("battery_service", BatteryServer, BatteryClient)


if __name__ == "__main__":
    main(tree)
