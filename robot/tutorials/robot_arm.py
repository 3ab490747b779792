"""The robot arm of the tutorial: a position service, an action that moves four joints in fifty steps, and a client of both.

The server owns the arm and says on a topic where it is, so that the position service, a node of its own, tells the true angles also while the
arm moves. Topic for what changes all the time, service for a question with an answer, action for what takes long and may be canceled.
"""

from __future__ import annotations

import asyncio
from collections.abc import Sequence

from actors import (
    Action,
    Done,
    GoalFailed,
    GoalRejected,
    Node,
    Reject,
    Service,
    Steps,
    Supervisor,
    Topic,
    parameter,
    publishes,
    qos,
)
from robot.interfaces.robactor_msgs.msg import ArmState
from robot.interfaces.tutorials.robot_arm_control.action import MoveArm, MoveArm_Feedback, MoveArm_Goal, MoveArm_Result
from robot.interfaces.tutorials.robot_arm_control.srv import GetPosition, GetPosition_Request, GetPosition_Response
from robot.sim.stepping_arm import Ending, InvalidTarget, TutorialArm
from robot.tutorials.program import Job, JobFailed, main, system

GET_CURRENT_POSITION = Service(GetPosition, "get_current_position")
MOVE_ARM = Action(MoveArm, "move_arm")
ARM_STATE = Topic(ArmState, "arm_state", qos.STATE)
"""At every step, and latched: a position service that comes later knows at once."""

TARGET = (1.57, 0.78, -0.78, 0.0)


class PositionService(Node):
    """Says where the arm is, and whether it moves: serves get_current_position. Without a server of the arm it is at zero, and idle."""

    node_name = "position_service"

    async def on_start(self) -> None:
        arm = TutorialArm()
        self._state = ArmState(joint_angles=arm.joint_angles, arm_status=arm.status)

    @ARM_STATE.on()
    def listen(self, message: ArmState) -> None:
        self._state = message

    @GET_CURRENT_POSITION.serve()
    async def position(self, request: GetPosition_Request) -> GetPosition_Response:
        self.log.info(f"Returning current position: {self._state.joint_angles.tolist()}")
        return GetPosition.Response(joint_angles=self._state.joint_angles, arm_status=self._state.arm_status)


class MoveArmServer(Node):
    """Moves the arm in equal steps, ten a second: serves move_arm. A newer goal preempts, and begins where the arm is then.

    Targets of another length than 4, or with an angle that is not finite or beyond 3.14 rad, are rejected. Parameters: steps.
    """

    node_name = "move_arm_server"
    state = publishes(ARM_STATE)
    steps = parameter(50, ge=1, read_only=True, description="Feedbacks of a motion.")
    _kept: tuple[float, ...] | None = None

    def resume(self, state: tuple[float, ...]) -> None:
        self._kept = state  # the arm has not moved because its driver has failed

    async def on_start(self) -> None:
        self._arm = TutorialArm(self.steps) if self._kept is None else TutorialArm(self.steps, self._kept)
        self._tell()
        self.log.info("Move arm server ready")

    @MOVE_ARM.accepts
    def check(self, goal: MoveArm_Goal) -> None:
        try:
            TutorialArm.check(goal.target_angles.tolist())
        except InvalidTarget as problem:
            self.log.warning(f"Goal rejected: {problem}")
            raise Reject(str(problem)) from None

    @MOVE_ARM.cancels
    def agree(self, goal: MoveArm_Goal) -> bool:
        self.log.info("Received cancel request")
        return True

    @MOVE_ARM.serve(arrivals="preempt")
    async def move(self, goal: MoveArm_Goal) -> Steps[MoveArm_Feedback, MoveArm_Result]:
        self.log.info("Executing move arm action...")
        self.log.info(f"Moving to target: {goal.target_angles.tolist()}")
        begun, step = self.clock.now(), 0
        self._arm.begin(goal.target_angles.tolist())
        try:
            while not self._arm.arrived:
                now = self._arm.step()
                self._tell()
                yield MoveArm.Feedback(
                    current_angles=now.current_angles,
                    progress_percentage=now.progress_percentage,
                    status=now.status,
                )
                step += 1
                await self.clock.sleep_until(
                    begun + step * TutorialArm.STEP_TIME
                )  # not a running sum: that would drift
            ending = self._arm.finish()
        except asyncio.CancelledError:
            ending = self._arm.cancel()
        self._tell()
        if ending.success:
            self.log.info(f"Movement completed. Final angles: {list(ending.final_angles)}")
        else:
            self.log.info(ending.message)
        yield Done(_result(ending))

    def _tell(self) -> None:
        self.checkpoint(self._arm.joint_angles)
        self.state(ArmState(joint_angles=self._arm.joint_angles, arm_status=self._arm.status))


def _result(ending: Ending) -> MoveArm_Result:
    return MoveArm.Result(success=ending.success, final_angles=ending.final_angles, message=ending.message)


class ArmControlClient(Job):
    """Asks where the arm is, and moves it to `target` (rad).

    Parameters: target, patience.
    """

    node_name = "arm_control_client"
    target = parameter(TARGET, unit="rad")

    async def job(self) -> None:
        await self.wait_in_slices(GET_CURRENT_POSITION, "Service not available, waiting again...")
        await self.wait_in_slices(MOVE_ARM, "Move arm action server not available, waiting...")
        self.log.info("Getting current arm position...")
        position = await self.call(GET_CURRENT_POSITION, GetPosition.Request())
        self.log.info(f"Current position: {position.joint_angles.tolist()}, status: {position.arm_status}")
        if await self.move(self.target) is None:
            raise JobFailed("The arm was not moved")

    async def move(self, target: Sequence[float]) -> MoveArm_Result | None:
        """Move the arm and tell how it goes; the result, of a canceled motion too, or `None` when the goal was rejected."""
        self.log.info(f"Moving arm to position: {list(target)}")
        try:
            async with self.send_goal(MOVE_ARM, MoveArm.Goal(target_angles=target)) as moving:
                self.log.info("Goal accepted, waiting for result...")
                async for feedback in moving:
                    self.log.info(f"Feedback: {feedback.status}")
                result = await moving
        except GoalRejected as rejected:
            self.log.error(f"Goal rejected: {rejected.reason}")
            return None
        except GoalFailed as failed:
            partial = failed.result
            result = partial if isinstance(partial, MoveArm_Result) else MoveArm.Result(message=failed.reason)
        self.log.info(f"Movement result: {result.message}")
        return result


def tree() -> Supervisor:
    """A position service, a server that moves the arm, and a client that asks both."""
    return system("robot_arm", PositionService, MoveArmServer, ArmControlClient)


if __name__ == "__main__":
    main(tree)
