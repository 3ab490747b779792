"""A humanoid that walks to a place at 0.1 m/s: an action server with feedback once a second, and a client.

The path is the straight line, or on request the robot's own planner's way round the obstacles that the server was given.
"""

from __future__ import annotations

import asyncio
from collections.abc import Sequence

import numpy as np

from actors import Aborted, Action, Done, GoalFailed, GoalRejected, Node, Reject, Steps, Supervisor, parameter
from robot.geometry.planar import Pose2
from robot.interfaces.tutorials.your_package.action import (
    HumanoidNav,
    HumanoidNav_Feedback,
    HumanoidNav_Goal,
    HumanoidNav_Result,
)
from robot.planning.errors import NavigationError
from robot.planning.grid import Grid, signed_distance
from robot.planning.path import Path
from robot.planning.planner import Planner
from robot.scenes.scene import Obstacle, Scene
from robot.tutorials.program import Job, JobFailed, main, system
from robot.tutorials.strides import is_finite, turn_left, turned

HUMANOID_NAVIGATE = Action(HumanoidNav, "humanoid_navigate")

TICK = 0.1
"""s."""
STEP = 0.01
"""m in a tick."""
TURN = 0.05
"""rad in a tick, and how exactly the heading is reached: the humanoid turns to the goal's heading while it walks."""
TOLD_EVERY = 10
"""Ticks between two feedbacks."""
FLOOR, CELL = (-10.0, -10.0, 10.0, 10.0), 0.1
"""x_min, y_min, x_max, y_max of what is planned on, and the size of its cells, m."""


class HumanoidNavServer(Node):
    """Walks to a pose: serves the action humanoid_navigate, one goal after another; up to ten more wait.

    `obstacles` are what it knows of the floor. With `avoid_obstacles` it keeps at least 0.26 m from them, without it walks straight, and a
    contact aborts the goal. Every goal starts where the humanoid really is.

    Parameters: tolerance.
    """

    node_name = "humanoid_nav_action_server"
    tolerance = parameter(0.1, unit="m", ge=0.02, le=1.0, description="So near to the target is there.")
    pose = Pose2(0.0, 0.0)

    def __init__(self, obstacles: Sequence[Obstacle] = ()) -> None:
        self._obstacles = tuple(obstacles)
        scene = Scene("floor", FLOOR, self._obstacles, start=self.pose, dock=self.pose)
        self._planner = Planner(Grid.from_scene(scene, CELL))

    def resume(self, state: Pose2) -> None:
        self.pose = state

    async def on_start(self) -> None:
        self.log.info("Humanoid navigation action server ready")

    @HUMANOID_NAVIGATE.accepts
    def check(self, goal: HumanoidNav_Goal) -> None:
        self.log.info("Received navigation goal request")
        wanted = goal.target_position.tolist()
        if len(wanted) != 3:
            raise self._rejection(f"target_position must be x, y, theta: 3 numbers, not {len(wanted)}")
        if not is_finite(Pose2(*wanted)):
            raise self._rejection(f"target_position {wanted} holds NaN or infinity")
        if goal.avoid_obstacles and self._obstacles:
            try:
                self._planner.check_goal(Pose2(*wanted))
            except NavigationError as error:
                raise self._rejection(f"{error.name}: {error}") from None

    def _rejection(self, reason: str) -> Reject:
        self.log.warning(f"Goal rejected: {reason}")
        return Reject(reason)

    @HUMANOID_NAVIGATE.cancels
    def agree(self, goal: HumanoidNav_Goal) -> bool:
        self.log.info("Received cancel request")
        return True

    @HUMANOID_NAVIGATE.serve(arrivals="queue")
    async def navigate(self, goal: HumanoidNav_Goal) -> Steps[HumanoidNav_Feedback, HumanoidNav_Result]:
        self.log.info("Executing navigation goal...")
        target, begun, ticks, steps = Pose2(*goal.target_position.tolist()), self.clock.now(), 0, 0
        try:
            path = self._path(target, around=goal.avoid_obstacles)
            while (left := path.length - steps * STEP) > self.tolerance or abs(turn_left(self.pose, target)) >= TURN:
                ticks += 1
                steps += left > self.tolerance  # who is there turns on the spot
                await self.clock.sleep_until(begun + ticks * TICK)
                x, y = path.at(steps * STEP)
                if self._stands_in_something(x, y):
                    yield self._aborted(f"contact with an obstacle at ({x:.2f}, {y:.2f})")
                    return
                self.pose = Pose2(x, y, turned(self.pose.yaw, target.yaw, TURN))
                self.checkpoint(self.pose)
                if ticks % TOLD_EVERY == 0:
                    yield self._feedback(ticks, path.length - steps * STEP)
            if ticks < TOLD_EVERY:
                yield self._feedback(ticks, left)
            message = f"Navigation completed to [{self.pose.x:.2f}, {self.pose.y:.2f}]"
            self.log.info(f"Goal succeeded: {message}")
            yield Done(self._result(True, message))
        except NavigationError as error:
            yield self._aborted(f"{error.name}: {error}")
        except asyncio.CancelledError:
            self.log.info("Goal canceled")
            yield Done(self._result(False, "Goal canceled"))

    def _path(self, target: Pose2, *, around: bool) -> Path:
        """From here to the target. Raises `NavigationError` when no way round is found."""
        if around and self._obstacles:
            return self._planner.plan(self.pose, target)
        return Path(np.array([(self.pose.x, self.pose.y), (target.x, target.y)]))

    def _stands_in_something(self, x: float, y: float) -> bool:
        return any(signed_distance(obstacle, np.array(x), np.array(y)) <= 0.0 for obstacle in self._obstacles)

    def _feedback(self, ticks: int, left: float) -> HumanoidNav_Feedback:
        status = f"Navigating... {left:.2f}m to go"
        self.log.info(f"Feedback: {status}")
        return HumanoidNav.Feedback(
            current_waypoint=ticks,
            current_position=[self.pose.x, self.pose.y, self.pose.yaw],
            distance_remaining=left,
            status_message=status,
        )

    def _result(self, success: bool, message: str) -> HumanoidNav_Result:
        return HumanoidNav.Result(
            success=success, final_position=[self.pose.x, self.pose.y, self.pose.yaw], message=message
        )

    def _aborted(self, why: str) -> Aborted[HumanoidNav_Result]:
        self.log.warning(why)
        return Aborted(self._result(False, why), why)


class HumanoidNavClient(Job):
    """Sends one goal of humanoid_navigate and tells how it goes.

    Parameters: target (x, y, theta), avoid_obstacles, patience.
    """

    node_name = "humanoid_nav_action_client"
    target = parameter([5.0, 3.0, 0.0], unit="m, m, rad")
    avoid_obstacles = parameter(True)

    async def job(self) -> None:
        await self.wait_in_slices(HUMANOID_NAVIGATE, "Waiting for action server...")
        goal = HumanoidNav.Goal(target_position=self.target, avoid_obstacles=self.avoid_obstacles)
        try:
            async with self.send_goal(HUMANOID_NAVIGATE, goal) as walking:
                self.log.info("Goal accepted :)")
                async for feedback in walking:
                    self.log.info(f"Received feedback: {feedback.status_message}")
                result = await walking
        except GoalRejected as rejected:
            raise JobFailed(f"Goal rejected :( {rejected.reason}") from None
        except GoalFailed as failed:
            self.log.warning(f"Result: {getattr(failed.result, 'message', '') or failed.reason}")
            return
        self.log.info(f"Result: {result.message}")


def tree() -> Supervisor:
    """A humanoid that walks to (5, 3) in 57 seconds, and the client that asked for it."""
    return system("humanoid_navigation", HumanoidNavServer, HumanoidNavClient)


if __name__ == "__main__":
    main(tree)
