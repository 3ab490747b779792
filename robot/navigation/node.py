"""The navigation controller as a node: two actions and a planning service on one navigator."""

from __future__ import annotations

from collections.abc import AsyncGenerator
from contextlib import aclosing, suppress
from math import hypot, isfinite

from actors import Aborted, ActorError, Done, Node, Reject, Steps, every, parameter, publishes
from actors.interfaces.geometry_msgs.msg import Pose, PoseStamped, Twist, Vector3
from actors.interfaces.nav_msgs.msg import MapMetaData, OccupancyGrid, Odometry, Path
from actors.interfaces.sensor_msgs.msg import BatteryState, LaserScan
from actors.interfaces.std_msgs.msg import Header
from actors.interfaces.std_srvs.srv import Trigger
from robot.contracts import (
    BATTERY_STATE,
    CMD_VEL,
    GAIT_STATUS,
    MAP,
    MOVE_TO_POSITION,
    NAVIGATE_TO_GOAL,
    ODOMETRY,
    PATH,
    PLAN_PATH,
    POSE,
    SCAN,
    STAND,
    WALK,
)
from robot.interfaces.humanoid_control_interfaces.action import (
    NavigateToGoal,
    NavigateToGoal_Feedback,
    NavigateToGoal_Goal,
    NavigateToGoal_Result,
)
from robot.interfaces.humanoid_control_interfaces.srv import PlanPath, PlanPath_Request, PlanPath_Response
from robot.interfaces.my_robot_interfaces.action import (
    MoveToPosition,
    MoveToPosition_Feedback,
    MoveToPosition_Goal,
    MoveToPosition_Result,
)
from robot.interfaces.robactor_msgs.msg import GaitStatus
from robot.navigation import path as paths
from robot.navigation.errors import NavigationError
from robot.navigation.follow import Command, Limits
from robot.navigation.geometry import from_pose, pose_stamped
from robot.navigation.grid import Grid
from robot.navigation.navigator import Motion, Navigator, State
from robot.navigation.planner import Planner
from robot.world.scene import Pose2

__all__ = ["Navigation"]

ENDED = (State.ARRIVED, State.CANCELED, State.FAILED)
RISING_TIMEOUT = 10.0
"""Seconds within which the robot must be walking after it has been asked to."""
CRITICAL = 0.10
STOP = Twist()


class Navigation(Node):
    """Walks to goals. Serves navigate_to_goal, move_to_position (a new goal preempts, whichever of the two it comes by)
    and plan_path.

    Takes pose, odom, lidar/scan, gait_status, battery_state; publishes cmd_vel (20 Hz while it walks), plan, map.
    Parameters: max_speed.
    """

    cmd = publishes(CMD_VEL)
    map = publishes(MAP)
    plan = publishes(PATH)
    max_speed = parameter(0.7, unit="m/s", ge=0.1, le=1.2, description="Fastest walk along a path.")

    def __init__(self, grid: Grid) -> None:
        self._grid = grid
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
        self.map(self._occupancy())

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

    # -- control -----------------------------------------------------------------------------------------------------

    @every(hz=20)
    def steer(self) -> None:
        """One step of the navigator, while a goal owns it."""
        if self._owner is None or self._pose is None or self._gait != "walk":
            return
        scan, self._ranges = self._ranges, None
        ranges = scan.ranges.astype(float) if scan is not None else None
        motion = self._navigator.step(self.clock.now(), self._pose, self._velocity, ranges)
        self._motion = motion
        self.cmd(Twist(linear=Vector3(x=motion.vx, y=motion.vy), angular=Vector3(z=motion.wz)))
        if self._navigator.path is not self._shown:
            self._show(self._navigator.path)

    async def _walk(self, goal: Pose2) -> AsyncGenerator[Motion, None]:
        """Walk to `goal`, yielding what the navigator says ten times a second, the final word last."""
        self._owner = me = object()
        self._navigator.cancel()
        self._motion = None
        try:
            await self._rise()
            assert self._pose is not None
            self._navigator.set_goal(goal, start=self._pose)
            while self._owner is me:
                await self.clock.sleep(0.1)
                motion = self._motion
                if motion is None:
                    continue
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
        while self._gait != "walk":
            if self.clock.now() > deadline:
                raise RuntimeError(
                    f"the robot is not walking {RISING_TIMEOUT:g} s after it was asked to: its gait is {self._gait!r}"
                )
            await self.clock.sleep(0.1)

    async def _rest(self) -> None:
        """After a goal, unless something else was asked meanwhile: stand, a third of the power of stepping in place."""
        await self.clock.sleep(0.5)
        if self._owner is None and self._gait_goal == "walk":
            with suppress(ActorError):  # a gait that is away will not walk either
                await self.call(STAND, Trigger.Request())

    def _check(self, goal: Pose2) -> None:
        """Refuse what cannot be reached, before it is accepted. Raises `Reject` with the reason in words."""
        if self._charge < CRITICAL:
            raise Reject(f"battery critical ({100 * self._charge:.0f} %): not starting to walk")
        if self._pose is None:
            raise Reject("the robot does not know where it is yet: try again when /pose is published")
        try:
            self._planner.plan(self._pose, goal)
        except NavigationError as error:
            raise Reject(f"{error.name}: {error}") from None

    # -- navigate_to_goal --------------------------------------------------------------------------------------------

    @NAVIGATE_TO_GOAL.accepts
    def check_navigation(self, goal: NavigateToGoal_Goal) -> None:
        frame = goal.target_pose.header.frame_id
        if frame not in ("map", ""):
            raise Reject(f"unknown frame {frame!r}: give the goal in frame 'map'")
        self._check(from_pose(goal.target_pose.pose))

    @NAVIGATE_TO_GOAL.serve(arrivals="preempt")
    async def navigate(self, goal: NavigateToGoal_Goal) -> Steps[NavigateToGoal_Feedback, NavigateToGoal_Result]:
        walked, whole = self._walked, 0.0
        motion: Motion | None = None
        async with aclosing(self._walk(from_pose(goal.target_pose.pose))) as motions:
            async for motion in motions:
                whole = max(whole, motion.distance_remaining + (self._walked - walked))
                share = 1.0 - motion.distance_remaining / whole if whole > 0.0 else 1.0
                assert self._pose is not None
                yield NavigateToGoal.Feedback(
                    current_pose=pose_stamped(self._pose, self.clock.stamp()),
                    distance_remaining=motion.distance_remaining,
                    progress_percent=100.0 * min(1.0, max(0.0, share)),
                )
        ok, text = _verdict(motion)
        result = NavigateToGoal.Result(success=ok, message=text, total_distance=self._walked - walked)
        yield Done(result) if ok else Aborted(result, text)

    # -- move_to_position --------------------------------------------------------------------------------------------

    @MOVE_TO_POSITION.accepts
    def check_move(self, goal: MoveToPosition_Goal) -> None:
        self._check(Pose2(goal.target_x, goal.target_y, goal.target_theta))

    @MOVE_TO_POSITION.serve(arrivals="preempt")
    async def move(self, goal: MoveToPosition_Goal) -> Steps[MoveToPosition_Feedback, MoveToPosition_Result]:
        begun = self.clock.now()
        motion: Motion | None = None
        async with aclosing(self._walk(Pose2(goal.target_x, goal.target_y, goal.target_theta))) as motions:
            async for motion in motions:
                assert self._pose is not None
                yield MoveToPosition.Feedback(
                    current_x=self._pose.x,
                    current_y=self._pose.y,
                    distance_remaining=motion.distance_remaining,
                    estimated_time_remaining=motion.eta,
                )
        ok, text = _verdict(motion)
        assert self._pose is not None
        result = MoveToPosition.Result(
            success=ok,
            final_x=self._pose.x,
            final_y=self._pose.y,
            total_time_seconds=self.clock.now() - begun,
            message="Reached target position" if ok else text,
        )
        yield Done(result) if ok else Aborted(result, text)

    # -- plan_path ---------------------------------------------------------------------------------------------------

    @PLAN_PATH.serve()
    async def plan_path(self, request: PlanPath_Request) -> PlanPath_Response:
        """A path on the map; a start or goal that cannot be used is answered with success False and the reason."""
        try:
            path = self._planner.plan(from_pose(request.start.pose), from_pose(request.goal.pose))
        except NavigationError as error:
            return PlanPath.Response(success=False, message=f"{error.name}: {error}")
        return PlanPath.Response(path=self._message(path), success=True, message="Path planned successfully")

    def _show(self, path: paths.Path | None) -> None:
        self._shown = path
        if path is not None:
            self.plan(self._message(path))

    def _message(self, path: paths.Path) -> Path:
        stamp = self.clock.stamp()
        points = path.points.tolist()
        poses = tuple(pose_stamped(Pose2(x, y), stamp) for x, y in points)
        return Path(header=Header(stamp=stamp, frame_id="map"), poses=poses)

    def _occupancy(self) -> OccupancyGrid:
        grid, stamp = self._grid, self.clock.stamp()
        origin = Pose(position=pose_stamped(Pose2(grid.origin_x, grid.origin_y), stamp).pose.position)
        info = MapMetaData(
            map_load_time=stamp, resolution=grid.resolution, width=grid.width, height=grid.height, origin=origin
        )
        return OccupancyGrid(header=Header(stamp=stamp, frame_id="map"), info=info, data=grid.to_occupancy())


def _verdict(motion: Motion | None) -> tuple[bool, str]:
    if motion is None or motion.state not in ENDED:
        return False, "preempted by a goal of the other action"
    if motion.state is State.ARRIVED:
        return True, "Goal reached"
    return False, f"{motion.failure.name}: {motion.failure}" if motion.failure is not None else "Movement canceled"
