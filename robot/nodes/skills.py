"""The skills that tasks are composed of: look for an object, walk somewhere, stand still, move the arm, grip.

Every skill raises `TaskFailed` with a stage and a reason that a user can read. A skill that is canceled leaves nothing moving: its goals are
canceled with it.
"""

from __future__ import annotations

from collections.abc import AsyncGenerator, Sequence
from itertools import pairwise
from math import dist, inf

from actors import ActorError, GoalAborted, GoalCanceled, GoalRejected, Node, retry
from actors.errors import NodeRestarting
from actors.interfaces.std_srvs.srv import SetBool, Trigger
from robot.contracts import CALIBRATE_GRIPPER, CONFIRM_OBJECT, GRIPPER, MOVE_ARM, NAVIGATE_TO_POSE, PLAN_PATH
from robot.geometry.messages import pose_stamped
from robot.geometry.planar import Pose2, placed, seen_from
from robot.interfaces.nav2_msgs.action import NavigateToPose
from robot.interfaces.robactor_msgs.srv import ConfirmObject
from robot.interfaces.tutorials.humanoid_control_interfaces.srv import PlanPath
from robot.interfaces.tutorials.robot_arm_control.action import MoveArm
from robot.model.arm import STOWED
from robot.model.modes import Mode
from robot.planning.grasp import STANDING, Spot

LOOK_TIMEOUT = 3.0
AWAY = (NodeRestarting,)
"""A question to a node that is being restarted is asked again."""
STILL_TIMEOUT = 10.0
"""Seconds within which a robot that has arrived must stand."""
NEARLY, PATIENCE = 0.2, 2.5
"""A walk that has so little left, m, and gets no further for so long, s, is over."""
SETTLE = 0.4
"""How long a body that stands sways on, s."""


class Stalled:
    """Whether a walk that is nearly over has come to nothing: near its goal, and for some time neither nearer nor turning."""

    def __init__(self) -> None:
        self._since = -inf
        self._left, self._yaw = inf, inf

    def at(self, now: float, left: float, yaw: float) -> bool:
        """Whether the walk has stalled, given the distance left (m) and the heading (rad) at `now` (s)."""
        if left < self._left - 0.01 or abs(yaw - self._yaw) > 0.05:
            self._since, self._left, self._yaw = now, min(left, self._left), yaw
        return left < NEARLY and now - self._since > PATIENCE


class TaskFailed(Exception):
    """A task cannot go on; the text says in which stage, and why."""

    def __init__(self, stage: str, reason: str) -> None:
        super().__init__(f"{stage}: {reason}")


class Skills:
    """Calls navigation, arm and camera on behalf of a node. That node writes its latest pose, gait and gripper state here."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self.pose: Pose2 | None = None
        self.gait = ""
        self.height = STANDING
        """Of the body, m."""
        self.gripping = False
        """Whether something is in the gripper."""
        self._stowed = False

    @property
    def here(self) -> Pose2:
        """The robot's pose on the map. Raises `TaskFailed` before the first message of the localizer."""
        if self.pose is None:
            raise TaskFailed("navigate", "the robot does not know where it is")
        return self.pose

    def on_map(self, spot: Spot) -> Spot:
        """A point of base_link on the map, for a level body."""
        return Spot(*placed(self.here, spot.x, spot.y), spot.z + self.height)

    def in_base(self, spot: Spot) -> Spot:
        """A point of the map in base_link, for a level body."""
        return Spot(*seen_from(self.here, spot.x, spot.y), spot.z - self.height)

    async def look(self, name: str) -> tuple[Spot | None, str]:
        """Where the camera sees the object now, in base_link, or `None`; and what the confirmation said."""
        try:
            reply = await retry(
                self._node, CONFIRM_OBJECT, ConfirmObject.Request(object_name=name), on=AWAY, timeout=LOOK_TIMEOUT
            )
        except ActorError as error:
            raise TaskFailed("confirm", f"{type(error).__name__}: {error}") from error
        point = reply.position.point
        return (Spot(point.x, point.y, point.z) if reply.success else None), reply.message

    async def calibrate(self) -> None:
        """Have the gripper calibrated."""
        try:
            reply = await retry(self._node, CALIBRATE_GRIPPER, Trigger.Request(), on=AWAY, timeout=LOOK_TIMEOUT)
        except ActorError as error:
            raise TaskFailed("calibrate", f"{type(error).__name__}: {error}") from error
        if not reply.success:
            raise TaskFailed("calibrate", reply.message)

    async def path_length(self, start: Pose2, goal: Pose2) -> float | None:
        """How long the way is, m; `None` if there is none."""
        stamp = self._node.clock.stamp()
        request = PlanPath.Request(start=pose_stamped(start, stamp), goal=pose_stamped(goal, stamp))
        try:
            reply = await retry(self._node, PLAN_PATH, request, on=AWAY, timeout=2.0)
        except ActorError as error:
            raise TaskFailed("navigate", f"{type(error).__name__}: {error}") from error
        if not reply.success:
            return None
        points = [(pose.pose.position.x, pose.pose.position.y) for pose in reply.path.poses]
        return sum(dist(a, b) for a, b in pairwise(points))

    async def walk(self, goal: Pose2) -> AsyncGenerator[float, None]:
        """Walk to a pose with the arm stowed, and stand still there; yields the distance that is left, m.

        A walk that stalls a hand's breadth before its goal counts as done: the arm makes up for the rest.
        """
        await self.stow()
        request = NavigateToPose.Goal(pose=pose_stamped(goal, self._node.clock.stamp()))
        try:
            async with self._node.send_goal(NAVIGATE_TO_POSE, request) as handle:
                stalled = Stalled()
                async for feedback in handle:
                    yield feedback.distance_remaining
                    if stalled.at(self._node.clock.now(), feedback.distance_remaining, self.here.yaw):
                        break
                else:
                    await handle
        except (GoalRejected, GoalAborted, GoalCanceled) as error:
            raise TaskFailed("navigate", error.reason) from error
        except ActorError as error:
            raise TaskFailed("navigate", f"{type(error).__name__}: {error}") from error
        await self._still()

    async def stow(self) -> None:
        """Fold the arm over the body, where it does not disturb walking."""
        if not self._stowed:
            await self.move(STOWED)
            self._stowed = True

    async def move(self, angles: Sequence[float]) -> list[float]:
        """Move the arm; returns where its joints really are then, rad."""
        self._stowed = False
        try:
            async with self._node.send_goal(MOVE_ARM, MoveArm.Goal(target_angles=angles)) as handle:
                result = await handle
        except (GoalRejected, GoalAborted, GoalCanceled) as error:
            raise TaskFailed("arm", error.reason) from error
        except ActorError as error:
            raise TaskFailed("arm", f"{type(error).__name__}: {error}") from error
        return [float(angle) for angle in result.final_angles]

    async def grip(self, closing: bool) -> bool:
        """Close or open the gripper; returns whether it then holds something after closing, nothing after opening."""
        try:
            reply = await self._node.call(GRIPPER, SetBool.Request(data=closing), timeout=LOOK_TIMEOUT)
        except ActorError as error:
            raise TaskFailed("gripper", f"{type(error).__name__}: {error}") from error
        return reply.success

    async def _still(self) -> None:
        deadline = self._node.clock.now() + STILL_TIMEOUT
        while self.gait != Mode.STAND:
            if self._node.clock.now() > deadline:
                raise TaskFailed("navigate", f"the robot has arrived but does not stand: its gait is {self.gait!r}")
            await self._node.clock.sleep(0.1)
        await self._node.clock.sleep(SETTLE)
