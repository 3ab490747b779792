"""Moving to a position: an action server that takes a robot there at 0.5 m/s, and a client that sends it to (3, 4).

An action is the right form here: it takes seconds, tells how far it has come, and can be canceled on the way.
"""

from __future__ import annotations

import asyncio

from actors import Action, Done, GoalFailed, GoalRejected, Node, Reject, Steps, Supervisor, parameter
from robot.geometry.planar import Pose2
from robot.interfaces.tutorials.my_robot_interfaces.action import (
    MoveToPosition,
    MoveToPosition_Feedback,
    MoveToPosition_Goal,
    MoveToPosition_Result,
)
from robot.tutorials.program import Job, JobFailed, main, system
from robot.tutorials.strides import distance, is_finite, stride, turn_left

MOVE_TO_POSITION = Action(MoveToPosition, "/move_to_position")

SPEED = 0.5
"""m/s."""
TICK = 0.1
"""s; 5 cm each."""
TURNED = 0.05
"""Nearer than this is the heading of the goal, rad."""
TURN_RATE = 1.0
"""rad/s; the robot turns to the goal's heading while it drives."""


class MoveServer(Node):
    """Drives straight to a point and turns to its heading: serves the action /move_to_position, 10 feedbacks a second.

    A goal preempts the one before it, which ends canceled; a canceled robot stays where it is, and the next goal starts there.

    Parameters: tolerance.
    """

    node_name = "move_action_server"
    tolerance = parameter(0.05, unit="m", ge=0.01, le=1.0, description="So near to the target is there.")
    pose = Pose2(0.0, 0.0)

    def resume(self, state: Pose2) -> None:
        self.pose = state  # the robot has not moved because its driver has failed

    async def on_start(self) -> None:
        self.log.info("Move action server ready")

    @MOVE_TO_POSITION.accepts
    def check(self, goal: MoveToPosition_Goal) -> None:
        self.log.info(f"Received goal: ({goal.target_x}, {goal.target_y})")
        if not is_finite(_target(goal)):
            reason = f"the target ({goal.target_x}, {goal.target_y}, {goal.target_theta}) holds NaN or infinity"
            self.log.warning(f"Goal rejected: {reason}")
            raise Reject(reason)

    @MOVE_TO_POSITION.cancels
    def agree(self, goal: MoveToPosition_Goal) -> bool:
        self.log.info("Received cancel request")
        return True

    @MOVE_TO_POSITION.serve(arrivals="preempt")
    async def move(self, goal: MoveToPosition_Goal) -> Steps[MoveToPosition_Feedback, MoveToPosition_Result]:
        self.log.info("Executing move...")
        target, begun, ticks = _target(goal), self.clock.now(), 0
        try:
            while (left := distance(self.pose, target)) >= self.tolerance or abs(
                turn_left(self.pose, target)
            ) >= TURNED:
                ticks += 1
                await self.clock.sleep_until(begun + ticks * TICK)  # not a running sum: that would drift
                self.pose = stride(self.pose, target, SPEED * TICK if left >= self.tolerance else 0.0, TURN_RATE * TICK)
                self.checkpoint(self.pose)
                if left >= self.tolerance:  # turning on the spot changes nothing of what feedback tells
                    yield _feedback(self.pose, target)
        except asyncio.CancelledError:
            yield Done(self._result(False, "Movement canceled", begun))
        else:
            self.log.info(f"Move completed in {self.clock.now() - begun:.1f}s")
            yield Done(self._result(True, "Reached target position", begun))

    def _result(self, success: bool, message: str, begun: float) -> MoveToPosition_Result:
        return MoveToPosition.Result(
            success=success,
            final_x=self.pose.x,
            final_y=self.pose.y,
            total_time_seconds=self.clock.now() - begun,
            message=message,
        )


def _target(goal: MoveToPosition_Goal) -> Pose2:
    return Pose2(goal.target_x, goal.target_y, goal.target_theta)


def _feedback(pose: Pose2, target: Pose2) -> MoveToPosition_Feedback:
    """Where the robot is, and how far that is from the target: both of one instant."""
    left = distance(pose, target)
    return MoveToPosition.Feedback(
        current_x=pose.x, current_y=pose.y, distance_remaining=left, estimated_time_remaining=left / SPEED
    )


class MoveClient(Job):
    """Sends one goal of /move_to_position and tells how it goes.

    Parameters: x, y, theta, patience.
    """

    node_name = "move_action_client"
    x = parameter(3.0, unit="m")
    y = parameter(4.0, unit="m")
    theta = parameter(0.0, unit="rad")

    async def job(self) -> None:
        await self.wait_in_slices(MOVE_TO_POSITION, "Waiting for action server...")
        self.log.info(f"Sending goal: ({self.x}, {self.y})")
        goal = MoveToPosition.Goal(target_x=self.x, target_y=self.y, target_theta=self.theta)
        try:
            async with self.send_goal(MOVE_TO_POSITION, goal) as moving:
                self.log.info("Goal accepted!")
                async for now in moving:
                    where = f"({now.current_x:.2f}, {now.current_y:.2f})"
                    self.log.info(f"Position: {where} | Remaining: {now.distance_remaining:.2f}m")
                result = await moving
        except GoalRejected as rejected:
            raise JobFailed(f"Goal rejected: {rejected.reason}") from None
        except GoalFailed as failed:
            self.log.warning(f"Failed: {getattr(failed.result, 'message', '') or failed.reason}")
            return
        self.log.info(f"Arrived at ({result.final_x:.2f}, {result.final_y:.2f}) in {result.total_time_seconds:.1f}s")


def tree() -> Supervisor:
    """A robot that moves to (3, 4) in 10 seconds, and the client that asked for it."""
    return system("move_to_position", MoveServer, MoveClient)


if __name__ == "__main__":
    main(tree)
