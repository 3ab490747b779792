"""The part of the navigation node that walks: what it hears, the 20 Hz that steer, and one walk at a time, whoever asks for it."""

from __future__ import annotations

from collections.abc import AsyncGenerator
from contextlib import suppress
from math import hypot, isfinite

from actors import ActorError, Node, Reject, every, parameter, publishes
from actors.interfaces.geometry_msgs.msg import PoseStamped, Twist, Vector3
from actors.interfaces.nav_msgs.msg import Odometry, Path
from actors.interfaces.sensor_msgs.msg import BatteryState, LaserScan
from actors.interfaces.std_msgs.msg import Header
from actors.interfaces.std_srvs.srv import Trigger
from robot.contracts import (
    AUTONOMY_CMD,
    BATTERY_STATE,
    BATTERY_STATUS,
    GAIT_STATUS,
    ODOMETRY,
    PATH,
    POSE,
    SAFETY_STATE,
    SCAN,
    STAND,
    WALK,
)
from robot.control.limits import Command, Limits
from robot.control.motion import Motion, State
from robot.control.navigator import Navigator
from robot.geometry.messages import from_pose, pose_stamped
from robot.geometry.planar import Pose2, compose
from robot.interfaces.robactor_msgs.msg import BatteryStatus, GaitStatus, SafetyState
from robot.model.modes import Mode
from robot.planning import path as paths
from robot.planning.energy import EnergyGuard
from robot.planning.errors import NavigationError
from robot.planning.grid import Grid
from robot.planning.planner import Planner
from robot.scenes.dock import BEFORE

__all__ = ["ENDED", "Walks", "verdict"]

ENDED = (State.ARRIVED, State.CANCELED, State.FAILED)
RISING_TIMEOUT = 10.0
"""Seconds within which the robot must be walking after it has been asked to."""
HALTED = 3.0
"""Seconds after which a goal ends when the robot does not walk any more: sat down by somebody, or without its sensors."""
CRITICAL = 0.10
STOP = Twist()


class Walks(Node):
    """Walks to one goal at a time; a new one takes over within one step, and the robot never stops between the two."""

    cmd = publishes(AUTONOMY_CMD)
    plan = publishes(PATH)
    max_speed = parameter(0.7, unit="m/s", ge=0.1, le=1.6, description="Fastest walk along a path.")

    def __init__(self, grid: Grid, dock: Pose2 | None = None) -> None:
        """With a `dock`, no walk is made or gone on with that leaves no energy for the way there."""
        self._grid = grid
        self._dock = dock
        self._planner = Planner(grid)

    async def on_start(self) -> None:
        self._navigator = Navigator(self._grid, Limits(vx_max=self.max_speed))
        self._pose: Pose2 | None = None
        self._velocity = Command(0.0, 0.0, 0.0)
        self._ranges: LaserScan | None = None
        self._motion: Motion | None = None
        self._owner: object | None = None
        self._shown: paths.Path | None = None
        self._walked = 0.0
        self._gait = self._gait_goal = ""
        self._charge = 1.0
        self._stopped = ""
        self._energy = EnergyGuard(min(self.max_speed, 0.7))

    # -- what it hears -----------------------------------------------------------------------------------------------

    @POSE.on(qos=1)
    def pose(self, message: PoseStamped) -> None:
        here = from_pose(message.pose)
        if self._pose is not None:
            self._walked += hypot(here.x - self._pose.x, here.y - self._pose.y)
        self._pose = here

    @ODOMETRY.on(qos=1)
    def odometry(self, message: Odometry) -> None:
        twist = message.twist.twist
        self._velocity = Command(twist.linear.x, twist.linear.y, twist.angular.z)

    @SCAN.on()
    def scan(self, message: LaserScan) -> None:
        self._ranges = message

    @GAIT_STATUS.on()
    def gait(self, message: GaitStatus) -> None:
        self._gait, self._gait_goal = message.mode, message.goal

    @BATTERY_STATE.on()
    def battery(self, message: BatteryState) -> None:
        self._charge = message.percentage if isfinite(message.percentage) else 1.0

    @BATTERY_STATUS.on()
    def energy(self, message: BatteryStatus) -> None:
        self._energy.heard(message.percent, message.energy)

    @SAFETY_STATE.on()
    def safety(self, message: SafetyState) -> None:
        """Under a safety stop no goal is accepted, and the one that runs ends."""
        self._stopped = "; ".join(message.reasons) if message.stopped else ""

    # -- control -----------------------------------------------------------------------------------------------------

    @every(hz=20)
    def steer(self) -> None:
        """One step of the navigator, while a goal owns it."""
        if self._owner is None or self._pose is None or self._gait != Mode.WALK:
            return
        scan, self._ranges = self._ranges, None
        ranges = scan.ranges.astype(float) if scan is not None else None
        motion = self._navigator.step(self.clock.now(), self._pose, self._velocity, ranges)
        self._motion = motion
        self.cmd(Twist(linear=Vector3(x=motion.vx, y=motion.vy), angular=Vector3(z=motion.wz)))
        if self._navigator.path is not self._shown:
            self._show(self._navigator.path)

    async def walk(self, goal: Pose2, *, straight: bool = False) -> AsyncGenerator[Motion, None]:
        """Walk to `goal`, yielding what the navigator says ten times a second, the final word last.

        `straight`: along the line, and no farther than to the first obstacle on it. Ends early when another walk takes over.
        Leaving it stops the robot, and half a second later it stands.
        """
        self._owner = me = object()
        self._navigator.cancel()
        self._motion = None
        try:
            await self._rise()
            assert self._pose is not None
            self._navigator.set_goal(goal, start=self._pose, straight=straight)
            home, walked = self._home(goal), self.clock.now()
            while self._owner is me:
                await self.clock.sleep(0.1)
                if self._stopped:
                    raise Reject(f"safety stop: {self._stopped}")
                if self._gait == Mode.WALK:
                    walked = self.clock.now()
                elif self.clock.now() - walked > HALTED:
                    raise Reject(f"the robot has stopped walking: its gait is {self._gait!r}")
                motion = self._motion
                if motion is None or self._owner is not me:
                    continue
                if objection := self._energy.objection(motion.distance_remaining, home):
                    raise Reject(objection)
                yield motion
                if motion.state in ENDED:
                    return
        finally:
            if self._owner is me:
                self._owner = None
                self._navigator.cancel()
                self.cmd(STOP)
                self.spawn(self._rest())

    async def _rise(self) -> None:
        """Have the robot walk: from wherever the gait is."""
        reply = await self.call(WALK, Trigger.Request())
        if not reply.success:
            raise Reject(reply.message)
        deadline = self.clock.now() + RISING_TIMEOUT
        while self._gait != Mode.WALK:
            if self.clock.now() > deadline:
                raise RuntimeError(
                    f"the robot is not walking {RISING_TIMEOUT:g} s after it was asked to: its gait is {self._gait!r}"
                )
            await self.clock.sleep(0.1)

    async def _rest(self) -> None:
        """After a goal, unless something else was asked meanwhile: stand, a third of the power of stepping in place."""
        await self.clock.sleep(0.5)
        if self._owner is None and self._gait_goal == Mode.WALK:
            with suppress(ActorError):  # a gait that is away will not walk either
                await self.call(STAND, Trigger.Request())

    # -- before a goal is accepted -----------------------------------------------------------------------------------

    def check(self, goal: Pose2, *, straight: bool = False) -> None:
        """Refuse what cannot be reached, before it is accepted. Raises `Reject` with the reason in words."""
        if self._stopped:
            raise Reject(f"safety stop: {self._stopped}")
        if self._charge < CRITICAL:
            raise Reject(f"battery critical ({100 * self._charge:.0f} %): not starting to walk")
        if self._pose is None:
            raise Reject("the robot does not know where it is yet: try again when /pose is published")
        ahead = hypot(goal.x - self._pose.x, goal.y - self._pose.y)
        try:
            if straight:
                self._planner.check_on_map(goal)
            else:
                ahead = self._planner.plan(self._pose, goal).length
        except NavigationError as error:
            raise Reject(f"{error.name}: {error}") from None
        if objection := self._energy.objection(ahead, self._home(goal)):
            raise Reject(objection)

    def _home(self, goal: Pose2) -> float:
        """How far it is from `goal` to the place before the dock, m; 0 without a dock."""
        if self._dock is None:
            return 0.0
        before = compose(self._dock, BEFORE)
        try:
            return self._planner.plan(goal, before).length
        except NavigationError:
            return hypot(goal.x - before.x, goal.y - before.y)

    # -- paths -------------------------------------------------------------------------------------------------------

    def _show(self, path: paths.Path | None) -> None:
        self._shown = path
        if path is not None:
            self.plan(self.path_message(path))

    def path_message(self, path: paths.Path) -> Path:
        stamp = self.clock.stamp()
        points = path.points.tolist()
        poses = tuple(pose_stamped(Pose2(x, y), stamp) for x, y in points)
        return Path(header=Header(stamp=stamp, frame_id="map"), poses=poses)


def verdict(motion: Motion | None) -> tuple[bool, str]:
    """Whether a walk that ended with `motion` reached its goal, and in words how it ended."""
    if motion is None or motion.state not in ENDED:
        return False, "preempted by a newer goal"
    if motion.state is State.ARRIVED:
        return True, "Goal reached"
    return False, f"{motion.failure.name}: {motion.failure}" if motion.failure is not None else "Movement canceled"
