"""The three-node lab: a sensor simulator, a planner, and a motor controller that asks it every two seconds.

Topics carry what flows all the time and may have any number of readers (`/sensor/data`, `/motor/commands`); the service carries a question
that has an answer (`plan_trajectory`). A fourth node is added to `tree` without a change to the others.
"""

from __future__ import annotations

from math import cos, sin

from actors import ActorError, Child, Node, Service, Supervisor, Topic, every, publishes
from actors.interfaces.geometry_msgs.msg import Point, Pose, PoseStamped
from actors.interfaces.nav_msgs.msg import Path
from actors.interfaces.std_msgs.msg import Header
from robot.interfaces.humanoid_control_interfaces.msg import MotorCommand, SensorData
from robot.interfaces.humanoid_control_interfaces.srv import (
    PlanTrajectory,
    PlanTrajectory_Request,
    PlanTrajectory_Response,
)

__all__ = ["MOTOR_COMMANDS", "PLAN_TRAJECTORY", "SENSOR_DATA", "MotorController", "Planner", "SensorSimulator", "tree"]

SENSOR_DATA = Topic(SensorData, "/sensor/data", 10)
MOTOR_COMMANDS = Topic(MotorCommand, "/motor/commands", 10)
PLAN_TRAJECTORY = Service(PlanTrajectory, "plan_trajectory")

WAYPOINTS = 10
SPEED = 0.5
"""Velocity of both motors while there is a path to follow."""


class SensorSimulator(Node):
    """Moves on an ellipse with semi-axes 2 m and 1 m: /sensor/data at 10 Hz, with position (m) and velocity (m/s)."""

    data = publishes(SENSOR_DATA)

    async def on_start(self) -> None:
        self._ticks = 0

    @every(hz=10)
    def publish(self) -> None:
        t = self._ticks / 10.0  # not a running sum: that would drift
        self._ticks += 1
        reading = SensorData(
            header=Header(stamp=self.clock.stamp(), frame_id="base_link"),
            position_x=2.0 * sin(t),
            position_y=cos(t),
            velocity_x=2.0 * cos(t),
            velocity_y=-sin(t),
        )
        self.data(reading)
        self.log.debug(f"Published sensor data: pos=({reading.position_x:.2f}, {reading.position_y:.2f})")


class Planner(Node):
    """Plans straight lines of 10 waypoints: serves plan_trajectory."""

    async def on_start(self) -> None:
        self.position: Point | None = None
        """Where the robot was last seen, m."""

    @SENSOR_DATA.on()
    def listen(self, message: SensorData) -> None:
        self.position = Point(x=message.position_x, y=message.position_y)
        self.log.debug(f"Received sensor data: ({message.position_x:.2f}, {message.position_y:.2f})")

    @PLAN_TRAJECTORY.serve()
    async def plan(self, request: PlanTrajectory_Request) -> PlanTrajectory_Response:
        start, goal = request.start, request.goal
        self.log.info(f"Planning trajectory: ({start.x}, {start.y}) -> ({goal.x}, {goal.y})")
        header = Header(stamp=self.clock.stamp(), frame_id="map")
        poses = tuple(
            PoseStamped(header=header, pose=Pose(position=_between(start, goal, i / (WAYPOINTS - 1))))
            for i in range(WAYPOINTS)
        )
        return PlanTrajectory.Response(trajectory=Path(header=header, poses=poses), success=True)


class MotorController(Node):
    """Asks for a trajectory every 2 s and drives both motors while it has one: /motor/commands. Outlives a planner that is away."""

    commands = publishes(MOTOR_COMMANDS)

    @every(period=2.0)
    async def control(self) -> None:
        """One request at a time: ticks that come while one is under way are skipped."""
        self.log.info("Requesting trajectory...")
        try:
            answer = await self.call(PLAN_TRAJECTORY, PlanTrajectory.Request(goal=Point(x=2.0, y=1.0)), timeout=1.0)
        except ActorError as error:
            self.log.warning(f"Planner service not available, waiting... ({error})")
            return
        if not answer.success or not answer.trajectory.poses:
            self.log.error("Trajectory planning failed")
            return
        self.log.info(f"Received trajectory with {len(answer.trajectory.poses)} waypoints")
        header = Header(stamp=self.clock.stamp(), frame_id="base_link")
        self.commands(MotorCommand(header=header, left_motor_velocity=SPEED, right_motor_velocity=SPEED))
        self.log.info("Published motor commands")


def tree() -> Supervisor:
    """The lab."""
    return Supervisor("humanoid_lab", children=[Child(SensorSimulator), Child(Planner), Child(MotorController)])


def _between(start: Point, goal: Point, share: float) -> Point:
    if share == 1.0:
        return goal  # exactly
    return Point(
        x=start.x + share * (goal.x - start.x),
        y=start.y + share * (goal.y - start.y),
        z=start.z + share * (goal.z - start.z),
    )
