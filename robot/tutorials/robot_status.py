"""A status service: a request without fields, and an answer in words. The robot's own (`robot.nodes.status`) answers from what it measures."""

from __future__ import annotations

from actors import Node, Service, Supervisor, parameter
from actors.interfaces.std_srvs.srv import Trigger, Trigger_Request, Trigger_Response
from robot.tutorials.program import main, system

GET_STATUS = Service(Trigger, "/robot/get_status")


class RobotStatusService(Node):
    """Says how the robot is, in four lines: serves /robot/get_status.

    Parameters: battery, position, walking, which stand in for a robot.
    """

    node_name = "robot_status_service"
    battery = parameter(85.0, unit="%", ge=0.0, le=100.0)
    position = parameter([1.5, 2.0, 0.0], unit="m")
    walking = parameter(False)

    async def on_start(self) -> None:
        self.log.info("Robot Status Service ready")

    @GET_STATUS.serve()
    async def status(self, request: Trigger_Request) -> Trigger_Response:
        x, y, z = self.position
        lines = (
            "Robot Status:",
            f"- Battery: {self.battery:.1f}%",
            f"- Position: x={x}, y={y}, z={z}",
            f"- Walking: {self.walking}",
        )
        return Trigger.Response(success=True, message="\n".join(lines))


def tree() -> Supervisor:
    """A service that tells how the robot is."""
    return system("robot_status", RobotStatusService)


if __name__ == "__main__":
    main(tree)
