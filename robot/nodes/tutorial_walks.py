"""The tutorials' three walking actions, as adapters of /navigate_to_pose: each asks for that, and answers in the words of its own type."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator
from contextlib import aclosing
from math import hypot, isfinite

import numpy as np

from actors import Aborted, ActorError, Done, Node, Reject, Steps
from actors.actions import parallel
from actors.interfaces.geometry_msgs.msg import PoseStamped
from robot.contracts import (
    HUMANOID_NAVIGATE,
    MOVE_TO_POSITION,
    NAVIGATE_TO_GOAL,
    NAVIGATE_TO_POSE,
    PLAN_PATH,
    POSE,
    STRAIGHT,
)
from robot.geometry.angles import wrap
from robot.geometry.messages import from_pose, is_pose, pose_stamped, seconds
from robot.geometry.planar import Pose2
from robot.interfaces.nav2_msgs.action import NavigateToPose, NavigateToPose_Feedback
from robot.interfaces.tutorials.humanoid_control_interfaces.action import (
    NavigateToGoal,
    NavigateToGoal_Feedback,
    NavigateToGoal_Goal,
    NavigateToGoal_Result,
)
from robot.interfaces.tutorials.humanoid_control_interfaces.srv import PlanPath
from robot.interfaces.tutorials.my_robot_interfaces.action import (
    MoveToPosition,
    MoveToPosition_Feedback,
    MoveToPosition_Goal,
    MoveToPosition_Result,
)
from robot.interfaces.tutorials.your_package.action import (
    HumanoidNav,
    HumanoidNav_Feedback,
    HumanoidNav_Goal,
    HumanoidNav_Result,
)

GOALS = 8
"""Goals at a time: the one that is walked to, and those that are ending because a newer one took over."""
NEAR = 0.1
"""A humanoid_navigate goal within this of the robot (m, and rad of heading) is reached at once."""
FEEDBACK_EVERY = 10
"""Feedbacks of navigate_to_pose (tenths of a second) to one of humanoid_navigate, as its tutorial has it."""
CHECK = 5.0
"""Seconds that the check of a goal may take."""


class TutorialWalks(Node):
    """Serves the actions navigate_to_goal, move_to_position and humanoid_navigate by asking for navigate_to_pose.

    A goal to which the map has no way is rejected by name, as plan_path answers; one that is refused for another reason, or fails on the
    way, is aborted with the words of navigate_to_pose. Takes pose.
    """

    async def on_start(self) -> None:
        self._pose: Pose2 | None = None
        self._walked = 0.0

    @POSE.on(qos=20)
    def pose(self, message: PoseStamped) -> None:
        if not is_pose(message.pose):
            return
        here, last = from_pose(message.pose), self._pose
        if last is not None:
            self._walked += hypot(here.x - last.x, here.y - last.y)
        self._pose = here

    @property
    def _here(self) -> Pose2:
        return self._pose or Pose2(0.0, 0.0)

    async def _check(self, goal: Pose2) -> None:
        """Raises `Reject` if the map has no way from here to there."""
        if self._pose is None:
            raise Reject("the robot does not know where it is yet: try again when /pose is published")
        stamp = self.clock.stamp()
        request = PlanPath.Request(start=pose_stamped(self._pose, stamp), goal=pose_stamped(goal, stamp))
        try:
            reply = await self.call(PLAN_PATH, request, timeout=CHECK)
        except ActorError as error:
            raise Reject(f"navigation does not answer: {error}") from None
        if not reply.success:
            raise Reject(reply.message)

    async def _walk(self, goal: Pose2, *, straight: bool = False) -> AsyncGenerator[NavigateToPose_Feedback, None]:
        """Walk there, yielding what navigate_to_pose says; leaving it cancels the goal. Raises `ActorError` if it is not reached."""
        pose = pose_stamped(goal, self.clock.stamp())
        asked = NavigateToPose.Goal(pose=pose, behavior_tree=STRAIGHT if straight else "")
        async with self.send_goal(NAVIGATE_TO_POSE, asked) as going:
            async for feedback in going:
                yield feedback
            await going

    # -- navigate_to_goal --------------------------------------------------------------------------------------------

    @NAVIGATE_TO_GOAL.accepts
    async def check_navigation(self, goal: NavigateToGoal_Goal) -> None:
        frame = goal.target_pose.header.frame_id
        if frame not in ("map", ""):
            raise Reject(f"unknown frame {frame!r}: give the goal in frame 'map'")
        await self._check(from_pose(goal.target_pose.pose))

    @NAVIGATE_TO_GOAL.serve(arrivals=parallel(GOALS))
    async def navigate(self, goal: NavigateToGoal_Goal) -> Steps[NavigateToGoal_Feedback, NavigateToGoal_Result]:
        walked, whole, progress = self._walked, 0.0, 0.0

        def result(success: bool, message: str) -> NavigateToGoal_Result:
            return NavigateToGoal.Result(success=success, message=message, total_distance=self._walked - walked)

        try:
            async with aclosing(self._walk(from_pose(goal.target_pose.pose))) as walk:
                async for said in walk:
                    whole = max(whole, said.distance_remaining + (self._walked - walked))
                    share = 1.0 - said.distance_remaining / whole if whole > 0.0 else 1.0
                    # A way that grows longer, round something unforeseen, does not take back what has been done.
                    progress = max(progress, 100.0 * min(1.0, max(0.0, share)))
                    yield NavigateToGoal.Feedback(
                        current_pose=said.current_pose,
                        distance_remaining=said.distance_remaining,
                        progress_percent=progress,
                    )
        except asyncio.CancelledError:
            yield Done(result(False, "Goal canceled"))
        except ActorError as error:
            yield Aborted(result(False, _why(error)), _why(error))
        else:
            yield Done(result(True, "Goal reached"))

    # -- move_to_position --------------------------------------------------------------------------------------------

    @MOVE_TO_POSITION.accepts
    async def check_move(self, goal: MoveToPosition_Goal) -> None:
        await self._check(Pose2(goal.target_x, goal.target_y, goal.target_theta))

    @MOVE_TO_POSITION.serve(arrivals=parallel(GOALS))
    async def move(self, goal: MoveToPosition_Goal) -> Steps[MoveToPosition_Feedback, MoveToPosition_Result]:
        begun = self.clock.now()

        def result(success: bool, message: str) -> MoveToPosition_Result:
            here, taken = self._here, self.clock.now() - begun
            return MoveToPosition.Result(
                success=success, final_x=here.x, final_y=here.y, total_time_seconds=taken, message=message
            )

        try:
            async with aclosing(self._walk(Pose2(goal.target_x, goal.target_y, goal.target_theta))) as walk:
                async for said in walk:
                    yield MoveToPosition.Feedback(
                        current_x=said.current_pose.pose.position.x,
                        current_y=said.current_pose.pose.position.y,
                        distance_remaining=said.distance_remaining,
                        estimated_time_remaining=seconds(said.estimated_time_remaining),
                    )
        except asyncio.CancelledError:
            yield Done(result(False, "Movement canceled"))
        except ActorError as error:
            yield Aborted(result(False, _why(error)), _why(error))
        else:
            yield Done(result(True, "Reached target position"))

    # -- humanoid_navigate -------------------------------------------------------------------------------------------

    @HUMANOID_NAVIGATE.accepts
    async def check_humanoid(self, goal: HumanoidNav_Goal) -> None:
        target = goal.target_position.tolist()
        if len(target) != 3 or not all(map(isfinite, target)):
            raise Reject(
                f"target_position {target} is not [x, y, theta]: give three finite numbers, in metres and radians"
            )
        if goal.avoid_obstacles:
            await self._check(Pose2(*target))

    @HUMANOID_NAVIGATE.serve(arrivals=parallel(GOALS))
    async def humanoid(self, goal: HumanoidNav_Goal) -> Steps[HumanoidNav_Feedback, HumanoidNav_Result]:
        target = Pose2(*goal.target_position.tolist())
        looks, remaining = 0, hypot(target.x - self._here.x, target.y - self._here.y)
        if remaining < NEAR and abs(wrap(target.yaw - self._here.yaw)) < NEAR:
            yield self._humanoid_feedback(looks, remaining)
            yield Done(self._humanoid_result(True, "Goal reached"))
            return
        try:
            async with aclosing(self._walk(target, straight=not goal.avoid_obstacles)) as walk:
                async for said in walk:
                    looks, remaining = looks + 1, said.distance_remaining
                    if looks % FEEDBACK_EVERY == 0:
                        yield self._humanoid_feedback(looks, remaining)
            if looks < FEEDBACK_EVERY:
                yield self._humanoid_feedback(looks, remaining)
        except asyncio.CancelledError:
            yield Done(self._humanoid_result(False, "Goal canceled"))
        except ActorError as error:
            yield Aborted(self._humanoid_result(False, _why(error)), _why(error))
        else:
            yield Done(self._humanoid_result(True, "Goal reached"))

    def _humanoid_feedback(self, looks: int, remaining: float) -> HumanoidNav_Feedback:
        here = self._here
        return HumanoidNav.Feedback(
            current_waypoint=looks,
            current_position=np.array([here.x, here.y, here.yaw]),
            distance_remaining=remaining,
            status_message=f"Navigating... {remaining:.2f}m to go",
        )

    def _humanoid_result(self, success: bool, message: str) -> HumanoidNav_Result:
        here = self._here
        return HumanoidNav.Result(success=success, final_position=np.array([here.x, here.y, here.yaw]), message=message)


def _why(error: ActorError) -> str:
    """The reason that navigation gave, or what else went wrong."""
    return getattr(error, "reason", "") or f"{type(error).__name__}: {error}"
