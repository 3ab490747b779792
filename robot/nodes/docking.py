"""The docking node: drives to the charging station by navigation, onto it by the LiDAR, and sits down on its contacts."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator, Callable
from contextlib import aclosing, suppress
from dataclasses import replace
from enum import Enum, StrEnum, auto

from actors import Aborted, ActorError, Done, GoalFailed, Node, Reject, Steps, parameter, publishes
from actors.interfaces.geometry_msgs.msg import PoseStamped, Twist, Vector3
from actors.interfaces.nav_msgs.msg import Path
from actors.interfaces.sensor_msgs.msg import BatteryState, LaserScan
from actors.interfaces.std_srvs.srv import Trigger
from robot.contracts import (
    AUTONOMY_CMD,
    BATTERY_STATE,
    DOCK,
    DOCK_STATUS,
    GAIT_STATUS,
    NAVIGATE_TO_POSE,
    PATH,
    POSE,
    SAFETY_STATE,
    SCAN,
    SIT,
    STAND,
    UNDOCK,
    WALK,
)
from robot.estimation.dock_finder import find_dock
from robot.estimation.history import pose_history
from robot.geometry.messages import from_pose, is_pose, pose_stamped, seconds
from robot.geometry.planar import Pose2, compose, inverse
from robot.interfaces.nav2_msgs.action import NavigateToPose
from robot.interfaces.robactor_msgs.action import Dock, Dock_Feedback, Dock_Goal, Dock_Result
from robot.interfaces.robactor_msgs.msg import DockStatus, GaitStatus, SafetyState
from robot.model.modes import Mode
from robot.navigation.dock import DockConfig, Sight, approach, remaining
from robot.planning.errors import ErrorCode
from robot.scenes.dock import BEFORE

CONFIG = DockConfig()
STANDSTILL = Twist()
RESTING = 0.5
"""Seconds after which a robot that was driven onto the dock, or off it, stands: that takes a third of the power of stepping in place."""
DOCKED = Pose2(0.0, 0.0)
"""Where the robot goes, in the frame of the dock."""


class Task(Enum):
    """The action that was asked for last."""

    DOCK = auto()
    UNDOCK = auto()


class Stage(StrEnum):
    """The stages of a task, as its feedback names them."""

    GOING = "going"
    LOOKING = "looking"
    APPROACHING = "approaching"
    SITTING = "sitting"
    RISING = "rising"
    LEAVING = "leaving"


class State(StrEnum):
    """The states of dock_status."""

    UNDOCKED = "UNDOCKED"
    DOCKING = "DOCKING"
    DOCKED = "DOCKED"


class _Failed(Exception):
    """Docking has ended with this outcome."""

    def __init__(self, outcome: str, message: str) -> None:
        super().__init__(message)
        self.outcome = outcome


class Docking(Node):
    """Serves the actions dock and undock; publishes dock_status (UNDOCKED, DOCKING, DOCKED), latched.

    `dock` ends as ``docked``, ``misaligned`` (it sat down, and the charger's contacts did not close, as often as `tries` says),
    ``dock not found``, ``dock lost`` or ``timed out``; it aborts with that word, and with another reason when it could not get there or
    another goal took the robot away. A dock without a station to see (`visible` False) is approached by the map alone.

    Takes pose, lidar/scan, gait_status, battery_state, safety/state, plan; publishes autonomy/cmd_vel during the final approach, after which it
    stands, however that has ended.
    Parameters: tries, time_limit, approach_speed, approach_turn, position_tolerance, yaw_tolerance, find_timeout, lost_timeout, charge_timeout.
    """

    cmd = publishes(AUTONOMY_CMD)
    status = publishes(DOCK_STATUS)
    tries = parameter(3, ge=1, le=10, description="Approaches before it gives up.")
    time_limit = parameter(
        120.0, unit="s", ge=1.0, le=3600.0, description="For all of it, when the goal names no time."
    )
    approach_speed = parameter(
        CONFIG.ahead_speed,
        unit="m/s",
        ge=0.05,
        le=0.5,
        description="Fastest forward and backward on the way onto the dock and off it.",
    )
    approach_turn = parameter(CONFIG.turn_speed, unit="rad/s", ge=0.1, le=1.0, description="Fastest turn on that way.")
    position_tolerance = parameter(
        CONFIG.close,
        unit="m",
        ge=0.01,
        le=0.2,
        description="So near to the dock's pose counts as on it; the contacts reach 0.3 m.",
    )
    yaw_tolerance = parameter(CONFIG.straight, unit="rad", ge=0.01, le=0.3, description="And so straight.")
    find_timeout = parameter(
        CONFIG.finding,
        unit="s",
        ge=1.0,
        le=60.0,
        description="How long to look for the station before it is not found.",
    )
    lost_timeout = parameter(
        CONFIG.lost, unit="s", ge=0.2, le=10.0, description="How long the station may be out of sight on the way."
    )
    charge_timeout = parameter(
        CONFIG.contact, unit="s", ge=1.0, le=60.0, description="How long to wait for the charger, once it sits."
    )

    def __init__(self, dock: Pose2, visible: bool) -> None:
        self._dock = dock
        self._visible = visible

    async def on_start(self) -> None:
        self._pose: Pose2 | None = None
        self._poses = pose_history()
        self._mode = ""
        self._charging = False
        self._outcome = self._stopped = ""
        self._stage: Stage | None = None
        self._task = Task.DOCK
        self._sight = Sight()
        self._others_path = -1.0
        self._state: State | None = None
        self._report()

    # -- inputs -----------------------------------------------------------------------------------------------

    @POSE.on(qos=20, patience=CONFIG.period)
    def pose(self, message: PoseStamped) -> None:
        if not is_pose(message.pose):
            return
        self._pose = from_pose(message.pose)
        self._poses.add(seconds(message.header.stamp), self._pose)

    @GAIT_STATUS.on()
    def gait(self, message: GaitStatus) -> None:
        self._mode = message.mode

    @BATTERY_STATE.on()
    def battery(self, message: BatteryState) -> None:
        self._charging = message.power_supply_status == BatteryState.POWER_SUPPLY_STATUS_CHARGING
        self._report()

    @SAFETY_STATE.on()
    def safety(self, message: SafetyState) -> None:
        self._stopped = "; ".join(message.reasons) if message.stopped else ""

    @PATH.on()
    def plan(self, message: Path) -> None:
        """A new plan means that navigation walks to a goal; one that begins during a final approach preempts it. Without poses it is the end of one."""
        if message.poses:
            self._others_path = self.clock.now()

    @SCAN.on()
    def scan(self, message: LaserScan) -> None:
        """Update the sight of the station while looking or approaching, from the pose at the scan's own stamp."""
        if self._stage not in (Stage.LOOKING, Stage.APPROACHING) or not self._visible:
            return
        taken_at = self._poses.at(seconds(message.header.stamp))
        if taken_at is None:
            return
        seen = find_dock(message.ranges.astype(float), taken_at, self._dock)
        if seen is None:
            return
        by_map = compose(inverse(self._dock), taken_at)
        self._sight = self._sight.with_one_more(seen, by_map, self.clock.now(), CONFIG.share)

    # -- dock --------------------------------------------------------------------------------------------------------

    @DOCK.accepts
    def check(self, goal: Dock_Goal) -> None:
        self._check(goal)
        if self._pose is None:
            raise Reject("the robot does not know where it is yet: try again when /pose is published")

    @DOCK.serve()
    async def dock(self, goal: Dock_Goal) -> Steps[Dock_Feedback, Dock_Result]:
        if self._charging:
            yield Done(Dock.Result(success=True, outcome="docked", message="already docked and charging"))
            return
        self._task = Task.DOCK
        async with aclosing(self._attempts()) as stages:
            async for item in self._conclude(stages, goal, "docked", "docked and charging"):
                yield item

    @UNDOCK.accepts
    def check_leaving(self, goal: Dock_Goal) -> None:
        self._check(goal)

    @UNDOCK.serve()
    async def undock(self, goal: Dock_Goal) -> Steps[Dock_Feedback, Dock_Result]:
        self._task = Task.UNDOCK
        async with aclosing(self._leave()) as stages:
            async for item in self._conclude(stages, goal, "undocked", "up, and in front of the dock"):
                yield item

    def _check(self, goal: Dock_Goal) -> None:
        if not 0.0 <= goal.timeout < float("inf"):
            raise Reject(
                f"the timeout {goal.timeout} is not a number of seconds: give a positive one, or 0 for the default"
            )
        if self._stopped:
            raise Reject(f"safety stop: {self._stopped}")
        if self._stage is not None:
            raise Reject(f"busy {self._stage}: cancel that first")

    async def _conclude(
        self, stages: AsyncGenerator[Dock_Feedback, None], goal: Dock_Goal, outcome: str, message: str
    ) -> AsyncGenerator[Dock_Feedback | Done[Dock_Result] | Aborted[Dock_Result], None]:
        """Yield the stages as feedback and then the result. The robot has stopped when it ends, however it ends."""
        deadline = self.clock.now() + (goal.timeout or self.time_limit)
        success = False
        try:
            async for feedback in stages:
                if self._stopped:
                    raise _Failed("not reached", f"safety stop: {self._stopped}")
                if self.clock.now() > deadline:
                    raise _Failed("timed out", f"not finished within {goal.timeout or self.time_limit:g} s")
                self._stage = Stage(feedback.stage)
                self._report()
                yield feedback
            success = True
        except _Failed as failure:
            outcome, message = failure.outcome, str(failure)
        except asyncio.CancelledError:
            outcome, message = "canceled", "canceled on the way"
        finally:
            if self._stage in (Stage.APPROACHING, Stage.LEAVING):
                self.cmd(STANDSTILL)
                if outcome != "preempted":
                    self.create_task(self._rest())
            self._stage, self._outcome = None, outcome
            self._report()
        result = Dock.Result(success=success, outcome=outcome, message=message)
        yield Done(result) if success or outcome == "canceled" else Aborted(result, f"{outcome}: {message}")

    async def _attempts(self) -> AsyncGenerator[Dock_Feedback, None]:
        for attempt in range(1, self.tries + 1):
            async for feedback in self._go():
                yield feedback
            async for feedback in self._look():
                yield feedback
            async for feedback in self._drive_to(DOCKED, Stage.APPROACHING):
                yield feedback
            yield Dock.Feedback(stage=Stage.SITTING.value)
            await self.call(SIT, Trigger.Request())
            await self._until(lambda: self._mode == Mode.SIT, CONFIG.sitting)
            await self._until(lambda: self._charging, self.charge_timeout)
            if self._charging:
                return
            self.log.warning("docked, but the charger's contacts do not touch", attempt=attempt, tries=self.tries)
            yield Dock.Feedback(stage=Stage.RISING.value)
            await self._stand_up()
        raise _Failed("misaligned", f"the charger's contacts did not close in {self.tries} approaches")

    async def _leave(self) -> AsyncGenerator[Dock_Feedback, None]:
        yield Dock.Feedback(stage=Stage.RISING.value)
        await self._stand_up()
        if self._pose is None or remaining(self._place(), DOCKED) > -BEFORE.x / 2:
            return  # it did not stand on the dock
        self._sight = Sight()
        async for feedback in self._drive_to(BEFORE, Stage.LEAVING):
            yield feedback

    async def _go(self) -> AsyncGenerator[Dock_Feedback, None]:
        """Walk to the front of the station by navigation."""
        target = compose(self._dock, BEFORE)
        goal = NavigateToPose.Goal(pose=pose_stamped(target, self.clock.stamp()))
        try:
            async with self.send_goal(NAVIGATE_TO_POSE, goal) as going:
                async for feedback in going:
                    yield Dock.Feedback(stage=Stage.GOING.value, distance_remaining=feedback.distance_remaining)
                await going
        except GoalFailed as error:
            if ErrorCode.of(error.result).no_way:
                raise _Failed("dock not found", f"no way to the front of the dock: {error.reason}") from None
            raise _Failed("not reached", f"the front of the dock was not reached: {error.reason}") from None

    async def _look(self) -> AsyncGenerator[Dock_Feedback, None]:
        """Wait in front of the station until it has been seen `looks` times; navigation has stopped by then."""
        self._sight, begun = Sight(), self.clock.now()
        yield Dock.Feedback(stage=Stage.LOOKING.value, distance_remaining=-BEFORE.x)
        while self.clock.now() < begun + CONFIG.settling or (self._visible and self._sight.count < CONFIG.looks):
            if self.clock.now() > begun + self.find_timeout:
                raise _Failed(
                    "dock not found", f"no station seen within {self.find_timeout:g} s where the map has the dock"
                )
            await self.clock.sleep(CONFIG.period)

    async def _drive_to(self, target: Pose2, stage: Stage) -> AsyncGenerator[Dock_Feedback, None]:
        """Drive to a pose in the dock's frame by the control law of `approach`."""
        await self._ensure_walking()
        begun = self.clock.now()
        self._sight = replace(self._sight, at=begun)
        while True:
            if self._others_path >= begun:
                raise _Failed("preempted", "another goal took the robot away")
            if stage is Stage.APPROACHING and self._visible and self.clock.now() - self._sight.at > self.lost_timeout:
                raise _Failed("dock lost", f"the station has been out of sight for {self.lost_timeout:g} s")
            place = self._place()
            command = approach(place, target, self._bounds())
            if command is None:
                self.cmd(STANDSTILL)
                return
            self.cmd(Twist(linear=Vector3(x=command.vx, y=command.vy), angular=Vector3(z=command.wz)))
            yield Dock.Feedback(stage=stage.value, distance_remaining=remaining(place, target))
            await self.clock.sleep(CONFIG.period)

    def _bounds(self) -> DockConfig:
        """The control law's numbers with those that are parameters."""
        return replace(
            CONFIG,
            ahead_speed=self.approach_speed,
            turn_speed=self.approach_turn,
            close=self.position_tolerance,
            straight=self.yaw_tolerance,
        )

    def _place(self) -> Pose2:
        """Pose in the frame of the dock: correction * dock^-1 * pose on the map."""
        assert self._pose is not None
        return compose(self._sight.correction, compose(inverse(self._dock), self._pose))

    # -- modes of the gait ---------------------------------------------------------------------------------------------

    async def _stand_up(self) -> None:
        reply = await self.call(STAND, Trigger.Request())
        if not reply.success:
            raise _Failed("not reached", reply.message)
        await self._until(lambda: self._mode == Mode.STAND, CONFIG.rising)

    async def _ensure_walking(self) -> None:
        try:
            reply = await self.call(WALK, Trigger.Request())
        except ActorError as error:
            raise _Failed("not reached", str(error)) from None
        if not reply.success or not await self._until(lambda: self._mode == Mode.WALK, CONFIG.rising):
            raise _Failed("not reached", reply.message if not reply.success else "the robot does not walk")

    async def _rest(self) -> None:
        """Half a second after a drive that has ended, ask the gait to stand, unless somebody else walks the robot by then or it docks again."""
        ended = self.clock.now()
        await self.clock.sleep(RESTING)
        if self._stage is None and self._mode == Mode.WALK and self._others_path < ended:
            with suppress(ActorError):  # a gait that is away does not walk either
                await self.call(STAND, Trigger.Request())

    async def _until(self, true: Callable[[], bool], seconds: float) -> bool:
        """Wait until `true()` holds, at most `seconds`; returns whether it does."""
        deadline = self.clock.now() + seconds
        while not true() and self.clock.now() < deadline:
            await self.clock.sleep(CONFIG.period)
        return true()

    def _report(self) -> None:
        state = state_of(self._task, self._stage, self._charging)
        if state != self._state:
            self._state = state
            self.status(
                DockStatus(stamp=self.clock.stamp(), state=state.value, outcome=self._outcome, charging=self._charging)
            )


def state_of(task: Task, stage: Stage | None, charging: bool) -> State:
    """The state of dock_status. A robot that leaves its dock counts as docked while the charger is connected."""
    if task is Task.DOCK and stage is not None:
        return State.DOCKING
    return State.DOCKED if charging else State.UNDOCKED
