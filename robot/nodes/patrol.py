"""The mission: stand up, walk the waypoints in turn, and go to the dock when the battery is low."""

from __future__ import annotations

from collections.abc import Awaitable, Sequence
from math import hypot, isfinite
from typing import Any

from actors import ActorError, GoalCanceled, GoalFailed, GoalRejected, Node, background, parameter, publishes
from actors.interfaces.geometry_msgs.msg import PoseStamped
from actors.interfaces.sensor_msgs.msg import BatteryState
from actors.interfaces.std_srvs.srv import Trigger
from robot.contracts import (
    BATTERY_STATE,
    DOCK,
    GAIT_STATUS,
    GOAL_REPORT,
    NAVIGATE_TO_POSE,
    POSE,
    SAFETY_STATE,
    SIT,
    STAND,
    UNDOCK,
    WALK,
)
from robot.geometry.messages import from_pose, is_pose, pose_stamped
from robot.geometry.planar import Pose2
from robot.interfaces.nav2_msgs.action import NavigateToPose
from robot.interfaces.robactor_msgs.action import Dock
from robot.interfaces.robactor_msgs.msg import GaitStatus, GoalReport, SafetyState
from robot.model.charge import LOW
from robot.model.modes import Mode
from robot.planning.errors import ErrorCode
from robot.planning.grid import Grid
from robot.planning.path import line_cells


class Patrol(Node):
    """Walks `waypoints` for ever, or once with laps=1, and then sits. Publishes mission/goals, one report for each goal that ended.

    Parameters: low_percent, resume_percent (of the coulomb count), docking_tries, retry_pause, laps (0: for ever).
    """

    reports = publishes(GOAL_REPORT)
    low_percent = parameter(
        100.0 * LOW, unit="%", ge=0.0, le=100.0, description="Charge below which it goes to the dock."
    )
    resume_percent = parameter(80.0, unit="%", ge=0.0, le=100.0, description="Charge at which it leaves the dock.")
    docking_tries = parameter(3, ge=1, le=20, description="How often it tries to dock before it goes on without.")
    retry_pause = parameter(
        1.0, unit="s", ge=0.1, le=60.0, description="Before a goal that was not reached is tried again."
    )
    laps = parameter(0, ge=0, description="How often to walk the waypoints; 0: for ever.")

    def __init__(self, waypoints: Sequence[tuple[str, Pose2]], dock: Pose2, grid: Grid) -> None:
        self._waypoints = waypoints
        self._dock = dock
        self._grid = grid
        self._next = 0
        self._charge: float | None = None
        self._charging = False
        self._pose: Pose2 | None = None
        self._stopped = ""
        self._tired = False
        """Whether the last goal was refused for want of charge."""
        self._rising = False
        self.finished = False

    def resume(self, state: int) -> None:
        self._next = state

    @BATTERY_STATE.on()
    def battery(self, message: BatteryState) -> None:
        if isfinite(message.percentage):
            self._charge = 100.0 * message.percentage
        self._charging = message.power_supply_status == BatteryState.POWER_SUPPLY_STATUS_CHARGING

    @SAFETY_STATE.on()
    def safety(self, message: SafetyState) -> None:
        self._stopped = "; ".join(message.reasons) if message.stopped else ""

    @GAIT_STATUS.on()
    def gait(self, message: GaitStatus) -> None:
        """Log that the robot stands. The answer to the request comes two seconds earlier, before it has risen."""
        if self._rising and message.mode in (Mode.STAND, Mode.WALK):
            self._rising = False
            self.log.info("Robot is now standing")

    @POSE.on(qos=20, patience=0.1)  # noted, for the next goal
    def pose(self, message: PoseStamped) -> None:
        if not is_pose(message.pose):
            return
        self._pose = from_pose(message.pose)

    @background
    async def mission(self) -> None:
        await self.wait_for(STAND, SIT, WALK, NAVIGATE_TO_POSE, DOCK, UNDOCK)
        await self._until_known()
        await self._stand()
        while not self._over():
            await self._until_free()
            if self._tired or (self._charge is not None and self._charge < self.low_percent):
                self._tired = False
                await self._recharge()
                continue
            name, goal = self._waypoints[self._next % len(self._waypoints)]
            if await self._try(name, goal, self._walk(goal)):
                self._next += 1
                self.checkpoint(self._next)
            else:
                await self.clock.sleep(self.retry_pause)
        await self.call(SIT, Trigger.Request())
        self.log.info("mission over: sitting down", goals=self._next)
        self.finished = True

    def _over(self) -> bool:
        return self.laps > 0 and self._next >= self.laps * len(self._waypoints)

    async def _until_known(self) -> None:
        """Wait for the first message of battery and localizer."""
        while self._charge is None or self._pose is None:
            await self.clock.sleep(0.05)

    async def _until_free(self) -> None:
        """Wait for the end of a safety stop."""
        if self._stopped:
            self.log.warning("waiting until the robot may move", why=self._stopped)
        while self._stopped:
            await self.clock.sleep(0.1)

    async def _stand(self) -> None:
        while True:
            reply = await self.call(STAND, Trigger.Request())
            if reply.success:
                self.log.info("standing up")
                self._rising = True
                return
            self.log.warning("cannot stand up", why=reply.message)
            await self.clock.sleep(5.0)

    async def _walk(self, goal: Pose2) -> None:
        request = NavigateToPose.Goal(pose=pose_stamped(goal, self.clock.stamp()))
        async with self.send_goal(NAVIGATE_TO_POSE, request) as handle:
            await handle

    async def _onto_dock(self) -> None:
        async with self.send_goal(DOCK, Dock.Goal()) as handle:
            await handle

    async def _try(self, name: str, goal: Pose2, task: Awaitable[None]) -> bool:
        """Await a task that ends at `goal` and publish its report. False if it failed and should be tried again."""
        begun = self.clock.now()
        behind = self._is_behind(goal)
        outcome, reason, again = "succeeded", "", False
        code = ErrorCode.NONE
        self.log.info("walking", to=name, x=goal.x, y=goal.y)
        try:
            await task
        except GoalRejected as error:
            outcome, reason, again, code = "rejected", error.reason, True, ErrorCode.UNKNOWN
        except GoalFailed as error:
            outcome = "canceled" if isinstance(error, GoalCanceled) else "aborted"
            reason, again, code = error.reason, True, ErrorCode.of(error.result)
        except ActorError as error:
            outcome, reason, again = "aborted", f"{type(error).__name__}: {error}", True
            code = ErrorCode.UNKNOWN
        self._tired = code == ErrorCode.LOW_BATTERY
        taken = self.clock.now() - begun
        say = self.log.warning if again else self.log.info
        why: dict[str, Any] = {"why": reason} if reason else {}
        say("goal ended", goal=name, outcome=outcome, seconds=round(taken, 1), **why)
        self.reports(
            GoalReport(
                stamp=self.clock.stamp(), name=name, x=goal.x, y=goal.y, theta=goal.yaw,
                outcome=outcome, reason=reason, error_code=code, seconds=taken, behind_obstacle=behind,
            )
        )  # fmt: skip
        return not again

    async def _recharge(self) -> None:
        """Dock, wait until the charge is `resume_percent`, and leave the dock again."""
        self.log.warning("battery low: going to the dock", percent=round(self._charge or 0.0, 1), gauge="coulomb count")
        for _ in range(self.docking_tries):
            if await self._try("dock", self._dock, self._onto_dock()):
                break
            await self.clock.sleep(self.retry_pause)
        while self._charging and (self._charge or 0.0) < self.resume_percent:
            await self.clock.sleep(1.0)
        await self._stand()
        try:
            async with self.send_goal(UNDOCK, Dock.Goal()) as leaving:
                await leaving
        except ActorError as error:
            self.log.warning("did not leave the dock", why=str(error))

    def _is_behind(self, goal: Pose2) -> bool:
        """Whether the map has an obstacle on the straight line from the robot to the goal."""
        if self._pose is None or hypot(goal.x - self._pose.x, goal.y - self._pose.y) < self._grid.resolution:
            return False
        grid = self._grid

        def cell(pose: Pose2) -> tuple[float, float]:
            return (pose.y - grid.origin_y) / grid.resolution, (pose.x - grid.origin_x) / grid.resolution

        rows, columns = line_cells(cell(self._pose), cell(goal))
        inside = (rows >= 0) & (rows < grid.height) & (columns >= 0) & (columns < grid.width)
        return bool(grid.occupied[rows[inside], columns[inside]].any())
