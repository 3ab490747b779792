"""The three-node lab: a sensor simulator, a planner, and a motor controller that asks it every two seconds.

Topics carry what flows all the time and may have any number of readers (`/sensor/data`, `/motor/commands`); the service carries a question
that has an answer (`plan_trajectory`). A fourth node is added to `tree` without a change to the others.
"""

from __future__ import annotations

from itertools import count
from math import atan2, cos, pi, sin

from actors import ActorError, Node, Service, Supervisor, Topic, background, every, parameter, publishes
from actors.interfaces.geometry_msgs.msg import Point, Pose, PoseStamped
from actors.interfaces.nav_msgs.msg import Path
from actors.interfaces.std_msgs.msg import Header
from robot.interfaces.tutorials.humanoid_control_interfaces.msg import MotorCommand, SensorData
from robot.interfaces.tutorials.humanoid_control_interfaces.srv import (
    PlanTrajectory,
    PlanTrajectory_Request,
    PlanTrajectory_Response,
)
from robot.tutorials.program import main, system

SENSOR_DATA = Topic(SensorData, "/sensor/data", 10)
MOTOR_COMMANDS = Topic(MotorCommand, "/motor/commands", 10)
PLAN_TRAJECTORY = Service(PlanTrajectory, "plan_trajectory")

PERIOD = 2.0
"""Seconds between two requests."""
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
        self.log.info(f"Published sensor data: pos=({reading.position_x:.2f}, {reading.position_y:.2f})")


class Planner(Node):
    """Plans straight lines: takes /sensor/data, serves plan_trajectory.

    Parameters: waypoints of a line, 10, a single one being the goal; from_here, to begin where the robot was last seen.
    """

    waypoints = parameter(10, ge=1, le=10_000)
    from_here = parameter(False, description="Begin at the position last heard, whatever start is asked for.")

    async def on_start(self) -> None:
        self.position: Point | None = None
        """Where the robot was last seen, m."""

    @SENSOR_DATA.on()
    def listen(self, message: SensorData) -> None:
        self.position = Point(x=message.position_x, y=message.position_y)
        self.log.debug(f"Received sensor data: ({message.position_x:.2f}, {message.position_y:.2f})")

    @PLAN_TRAJECTORY.serve()
    async def plan(self, request: PlanTrajectory_Request) -> PlanTrajectory_Response:
        start = self.position if self.from_here and self.position is not None else request.start
        goal = request.goal
        self.log.info(f"Planning trajectory: ({start.x}, {start.y}) -> ({goal.x}, {goal.y})")
        header = Header(stamp=self.clock.stamp(), frame_id="map")
        last = self.waypoints - 1
        poses = tuple(
            PoseStamped(header=header, pose=Pose(position=_between(start, goal, i / last if last else 1.0)))
            for i in range(self.waypoints)
        )
        return PlanTrajectory.Response(trajectory=Path(header=header, poses=poses), success=True)


class MotorController(Node):
    """Asks plan_trajectory for a path every 2 s and drives both motors while it has one: /motor/commands. Outlives a planner that is away.

    Parameters: steer, to turn both motors by the path's direction instead of driving straight on.
    """

    commands = publishes(MOTOR_COMMANDS)
    steer = parameter(False, description="Take the two velocities from the path's direction, not 0.5 each.")

    @background
    async def control(self) -> None:
        """One request at a time: those that would have been due while the planner was away are left out."""
        begun = self.clock.now()
        for request in count(1):
            due = begun + request * PERIOD
            if due >= self.clock.now():
                await self.clock.sleep_until(due)
                await self._drive()

    async def _drive(self) -> None:
        while True:
            try:
                await self.wait_for(PLAN_TRAJECTORY, timeout=1.0)
                break
            except TimeoutError:
                self.log.warning("Planner service not available, waiting...")
        self.log.info("Requesting trajectory...")
        try:
            answer = await self.call(PLAN_TRAJECTORY, PlanTrajectory.Request(goal=Point(x=2.0, y=1.0)), timeout=1.0)
        except ActorError as error:
            self.log.error(f"Service call failed: {error}")
            return
        if not answer.success or not answer.trajectory.poses:
            self.log.error("Trajectory planning failed")
            return
        self.log.info(f"Received trajectory with {len(answer.trajectory.poses)} waypoints")
        header = Header(stamp=self.clock.stamp(), frame_id="base_link")
        left, right = steered(answer.trajectory) if self.steer else (SPEED, SPEED)
        self.commands(MotorCommand(header=header, left_motor_velocity=left, right_motor_velocity=right))
        self.log.info("Published motor commands")


def steered(path: Path) -> tuple[float, float]:
    """Velocities of the left and right motor that turn a robot which looks along x into the path; none for a path without length."""
    first, last = path.poses[0].pose.position, path.poses[-1].pose.position
    if first == last:
        return 0.0, 0.0
    turn = atan2(last.y - first.y, last.x - first.x) / pi
    return SPEED * (1.0 - turn), SPEED * (1.0 + turn)


def tree() -> Supervisor:
    """The lab: a sensor that moves on an ellipse, a planner, and a motor controller."""
    return system("humanoid_lab", SensorSimulator, Planner, MotorController)


def _between(start: Point, goal: Point, share: float) -> Point:
    if share == 1.0:
        return goal  # exactly
    return Point(
        x=start.x + share * (goal.x - start.x),
        y=start.y + share * (goal.y - start.y),
        z=start.z + share * (goal.z - start.z),
    )


if __name__ == "__main__":
    main(tree)
