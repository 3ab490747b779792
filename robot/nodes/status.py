"""The status node: tells the robot's state in one service, and saves and restores the parameters of all nodes."""

from __future__ import annotations

from pathlib import Path

from actors import ActorError, Node, parameter
from actors.interfaces.geometry_msgs.msg import Point, PoseStamped
from actors.interfaces.std_srvs.srv import Trigger, Trigger_Request, Trigger_Response
from robot.contracts import BATTERY_STATUS, GAIT_STATUS, GET_STATUS, POSE, RESTORE_CONFIG, SAVE_CONFIG
from robot.interfaces.robactor_msgs.msg import BatteryStatus, GaitStatus
from robot.model.modes import Mode
from robot.nodes.settings import load, save


class RobotStatus(Node):
    """Serves robot/get_status, robot/save_config and robot/restore_config. Takes battery_status, pose, gait_status.

    Parameters: config_file, where the settings of all nodes are kept, as a ROS 2 parameter file.
    """

    config_file = parameter("robot_config.yaml", description="Where save_config writes and restore_config reads.")

    async def on_start(self) -> None:
        self._charge: float | None = None
        self._position: Point | None = None
        self._mode: str | None = None

    @BATTERY_STATUS.on()
    def battery(self, message: BatteryStatus) -> None:
        self._charge = message.percent

    @POSE.on(qos=20, patience=0.1)  # noted, for who asks
    def pose(self, message: PoseStamped) -> None:
        self._position = message.pose.position

    @GAIT_STATUS.on()
    def gait(self, message: GaitStatus) -> None:
        self._mode = message.mode

    @GET_STATUS.serve()
    async def status(self, request: Trigger_Request) -> Trigger_Response:
        """Answer in the tutorial's four lines with the latest values; those never received are "unknown"."""
        battery = f"{self._charge:.1f}%" if self._charge is not None else "unknown"
        here = self._position
        position = f"x={here.x:.1f}, y={here.y:.1f}, z={here.z:.1f}" if here is not None else "unknown"
        walking = str(self._mode == Mode.WALK) if self._mode is not None else "unknown"
        lines = ("Robot Status:", f"- Battery: {battery}", f"- Position: {position}", f"- Walking: {walking}")
        return Trigger.Response(success=True, message="\n".join(lines))

    @SAVE_CONFIG.serve(concurrent=1)
    async def save_config(self, request: Trigger_Request) -> Trigger_Response:
        """Write the parameters of every node to `config_file`."""
        file = Path(self.config_file)
        try:
            count = await save(self, file)
        except (OSError, ActorError) as error:
            return Trigger.Response(success=False, message=f"Configuration not saved to {file}: {error}")
        return Trigger.Response(success=True, message=f"{count} parameters saved to {file}")

    @RESTORE_CONFIG.serve(concurrent=1)
    async def restore_config(self, request: Trigger_Request) -> Trigger_Response:
        """Set the parameters of `config_file` that are not read-only; the message names those that were refused."""
        file = Path(self.config_file)
        try:
            count, refused = await load(self, file)
        except (OSError, ActorError, ValueError) as error:
            return Trigger.Response(success=False, message=f"Configuration not restored from {file}: {error}")
        text = f"{count} parameters restored from {file}"
        return Trigger.Response(success=not refused, message="; ".join([text, *refused]))
