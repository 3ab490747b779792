"""Asking for a plan: a placeholder that adds numbers, a real planner of paths, and how to call either without surprises.

Both are called `plan_path` and their types differ, so they do not go together: the second to start is refused, with both named.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

from actors import ActorError, CallTimeout, Node, Service, ServiceUnavailable, Supervisor
from actors.interfaces import Message
from actors.interfaces.example_interfaces.srv import AddTwoInts, AddTwoInts_Request, AddTwoInts_Response
from actors.interfaces.geometry_msgs.msg import Point, Pose, PoseStamped
from actors.interfaces.nav_msgs.msg import Path
from actors.interfaces.std_msgs.msg import Header
from robot.geometry.planar import Pose2
from robot.interfaces.tutorials.humanoid_control_interfaces.srv import PlanPath, PlanPath_Request, PlanPath_Response
from robot.planning.errors import NavigationError
from robot.planning.grid import Grid
from robot.planning.planner import Planner
from robot.scenes.scene import Obstacle, Scene
from robot.tutorials.program import Job, JobFailed, main, system

ADD_TO_PLAN = Service(AddTwoInts, "plan_path")
PLAN_PATH = Service(PlanPath, "plan_path")

FLOOR, CELL = (-10.0, -10.0, 10.0, 10.0), 0.1
"""x_min, y_min, x_max, y_max of what is planned on, and the size of its cells, m."""
LIMIT = 5.0
"""Seconds to wait for a server, and again for its answer."""

Req = TypeVar("Req", bound=Message)
Resp = TypeVar("Resp", bound=Message)


async def call_safely(node: Node, service: Service[Req, Resp], request: Req, *, limit: float = LIMIT) -> Resp | None:
    """The answer, or None with a line in the log that says which of three things went wrong."""
    try:
        await node.wait_for(service, timeout=limit)
        return await node.call(service, request, timeout=limit)
    except ServiceUnavailable:
        node.log.error("Service unavailable")
    except CallTimeout:
        node.log.error("Service call timed out")
    except ActorError as error:
        node.log.error(f"Service call failed: {error}")
    return None


class PlannerServer(Node):
    """A placeholder for a planner: serves plan_path by adding start and goal."""

    @ADD_TO_PLAN.serve()
    async def plan(self, request: AddTwoInts_Request) -> AddTwoInts_Response:
        self.log.info(f"Planning path: start={request.a}, goal={request.b}")
        return AddTwoInts.Response(sum=request.a + request.b)


class PlannerClient(Job):
    """Asks the placeholder for a plan from 1 to 2.

    Parameters: patience.
    """

    async def job(self) -> None:
        await self.wait_in_slices(ADD_TO_PLAN, "Service not available, waiting...")
        answer = await call_safely(self, ADD_TO_PLAN, AddTwoInts.Request(a=1, b=2))
        if answer is None:
            raise JobFailed("No plan")
        self.log.info(f"Result: {answer.sum}")


class MotionPlanner(Node):
    """Plans paths in frame map, round the `obstacles` it was given: serves plan_path with the robot's own planner."""

    def __init__(self, obstacles: Sequence[Obstacle] = ()) -> None:
        origin = Pose2(0.0, 0.0)
        scene = Scene("floor", FLOOR, tuple(obstacles), start=origin, dock=origin)
        self._planner = Planner(Grid.from_scene(scene, CELL))

    @PLAN_PATH.serve()
    async def plan(self, request: PlanPath_Request) -> PlanPath_Response:
        """A path from start to goal; what cannot be planned is answered with success False and the reason."""
        start, goal = request.start.pose, request.goal.pose
        begin, end = start.position, goal.position
        self.log.info(f"Planning from ({begin.x}, {begin.y}) to ({end.x}, {end.y})")
        try:
            found = self._planner.plan(_place(start), _place(goal))
        except NavigationError as error:
            return PlanPath.Response(success=False, message=f"{error.name}: {error}")
        header = Header(stamp=self.clock.stamp(), frame_id="map")
        between = [Pose(position=Point(x=x, y=y)) for x, y in found.points.tolist()[1:-1]]
        poses = tuple(PoseStamped(header=header, pose=pose) for pose in (start, *between, goal))
        return PlanPath.Response(
            path=Path(header=header, poses=poses), success=True, message="Path planned successfully"
        )


def _place(pose: Pose) -> Pose2:
    return Pose2(pose.position.x, pose.position.y)


def tree() -> Supervisor:
    """The placeholder of a planner, and a client that asks it for a plan from 1 to 2."""
    return system("planner_service", PlannerServer, PlannerClient)


if __name__ == "__main__":
    main(tree)
