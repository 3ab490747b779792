"""The mission of one task: fetch a thing, carry it somewhere if that was asked, and sit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from actors import ActorError, GoalAborted, GoalFailed, GoalRejected, Node, background, publishes
from actors.errors import NodeRestarting
from actors.interfaces.geometry_msgs.msg import Point, Pose, PoseStamped
from actors.interfaces.std_msgs.msg import Header
from actors.interfaces.std_srvs.srv import Trigger
from robot.contracts import FETCH_AND_CARRY, GOAL_REPORT, NAVIGATE_AND_GRAB, POSE, SIT
from robot.geometry.messages import from_pose
from robot.geometry.vectors import Triple
from robot.interfaces.robactor_msgs.action import FetchAndCarry
from robot.interfaces.robactor_msgs.msg import GoalReport
from robot.interfaces.tutorials.proposed_interfaces.action import NavigateAndGrab
from robot.nodes.task_feedback import CANCELED
from robot.planning.errors import ErrorCode

TRIES = 3
"""How often a task is asked for, when its server fails on the way."""
PAUSE = 1.0
"""Seconds that a server has to come back, before it is asked again."""


@dataclass(frozen=True, slots=True)
class Delivery:
    """What to fetch, and where to."""

    name: str
    """Of the thing."""
    about: Triple
    """Where on the map it is about, m."""
    to: Triple | None = None
    """Where it shall stand, m; `None`: hold it."""


class Carrier(Node):
    """Runs one task by navigate_and_grab or fetch_and_carry, logs its stages, and sits. Publishes one report on mission/goals at its end."""

    reports = publishes(GOAL_REPORT)

    def __init__(self, delivery: Delivery) -> None:
        self._delivery = delivery
        self.finished = False

    @background
    async def mission(self) -> None:
        await self.wait_for(NAVIGATE_AND_GRAB, FETCH_AND_CARRY, SIT)
        async with self.subscribe(POSE) as poses:
            await poses.next(timeout=30.0)
        begun = self.clock.now()
        outcome, reason = "succeeded", ""
        try:
            await self._attempts()
        except (GoalRejected, GoalFailed) as error:
            outcome, reason = type(error).__name__.removeprefix("Goal").lower(), error.reason
        except ActorError as error:
            outcome, reason = "aborted", f"{type(error).__name__}: {error}"
        taken = self.clock.now() - begun
        why: dict[str, Any] = {"why": reason} if reason else {}
        self.log.info("delivery over", outcome=outcome, seconds=round(taken, 1), **why)
        await self._report(outcome, reason, taken)
        await self.call(SIT, Trigger.Request())
        self.finished = True

    async def _attempts(self) -> None:
        """Run the task; ask for it again when its server has failed on the way: such a goal ends without a result, or as if canceled."""
        for _ in range(TRIES - 1):
            try:
                return await self._run()
            except GoalAborted as error:
                if getattr(error.result, "message", CANCELED) != CANCELED:
                    raise
                why = error.reason
            except NodeRestarting as error:
                why = str(error)
            self.log.warning("delivery lost: asking for it again", why=why)
            await self.clock.sleep(PAUSE)
        await self._run()

    async def _run(self) -> None:
        delivery, stage = self._delivery, ""
        target = _pose(delivery.about)
        if delivery.to is None:
            async with self.send_goal(
                NAVIGATE_AND_GRAB, NavigateAndGrab.Goal(object_name=delivery.name, target_pose=target)
            ) as grabbing:
                async for told in grabbing:
                    stage = self._say(stage, told.stage)
                await grabbing
            return
        goal = FetchAndCarry.Goal(object_name=delivery.name, target_pose=target, place_pose=_pose(delivery.to))
        async with self.send_goal(FETCH_AND_CARRY, goal) as carrying:
            async for carried in carrying:
                stage = self._say(stage, carried.stage)
            await carrying

    def _say(self, before: str, stage: str) -> str:
        if stage != before:
            self.log.info(stage, thing=self._delivery.name)
        return stage

    async def _report(self, outcome: str, reason: str, taken: float) -> None:
        """Publish the report; its place is the robot's estimate of its own pose."""
        async with self.subscribe(POSE) as poses:
            here = from_pose((await poses.next(timeout=5.0)).pose)
        self.reports(
            GoalReport(
                stamp=self.clock.stamp(), name=f"fetch {self._delivery.name}", x=here.x, y=here.y, theta=here.yaw,
                outcome=outcome, reason=reason, seconds=taken,
                error_code=ErrorCode.UNKNOWN if reason else ErrorCode.NONE,
            )
        )  # fmt: skip


def _pose(at: Triple) -> PoseStamped:
    x, y, z = at
    return PoseStamped(header=Header(frame_id="map"), pose=Pose(position=Point(x=x, y=y, z=z)))
