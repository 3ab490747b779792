"""The navigation node: Nav2's two actions and a planning service on one navigator."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator, Sequence
from contextlib import aclosing, suppress
from dataclasses import dataclass, replace
from typing import Any

from actors import Aborted, ActorError, Done, Node, Parameter, Reject, Steps, every, parameter, publishes
from actors.actions import parallel
from actors.interfaces.builtin_interfaces.msg import Duration
from actors.interfaces.geometry_msgs.msg import PoseStamped
from actors.interfaces.nav_msgs.msg import OccupancyGrid, Odometry, Path
from actors.interfaces.sensor_msgs.msg import LaserScan
from actors.interfaces.std_msgs.msg import Header, String
from actors.parameters import post_set
from robot.contracts import (
    AUTONOMY_CMD,
    BATTERY_STATUS,
    GAIT_STATUS,
    GLOBAL_COSTMAP,
    GOAL_POSE,
    LOCAL_COSTMAP,
    LOCALIZATION,
    NAVIGATE_THROUGH_POSES,
    NAVIGATE_TO_POSE,
    ODOMETRY,
    PATH,
    PLAN_PATH,
    POSE,
    RELIEF,
    SAFETY_STATE,
    SCAN,
    STRAIGHT,
)
from robot.estimation.elevation import Relief
from robot.estimation.fit_watch import AMBIGUOUS, BLIND, LOST
from robot.geometry.messages import from_pose, is_pose, pose_stamped, seconds
from robot.geometry.planar import Pose2, Twist2
from robot.interfaces.nav2_msgs.action import (
    NavigateThroughPoses,
    NavigateThroughPoses_Feedback,
    NavigateThroughPoses_Goal,
    NavigateThroughPoses_Result,
    NavigateToPose,
    NavigateToPose_Feedback,
    NavigateToPose_Goal,
    NavigateToPose_Result,
)
from robot.interfaces.nav2_msgs.msg import WaypointStatus
from robot.interfaces.robactor_msgs.msg import BatteryStatus, GaitStatus, SafetyState
from robot.interfaces.tutorials.humanoid_control_interfaces.srv import PlanPath, PlanPath_Request, PlanPath_Response
from robot.model.charge import ChargeLevel
from robot.model.robot import SPOT, RobotModel
from robot.navigation.limits import Limits, Tolerance
from robot.navigation.motion import Motion
from robot.navigation.navigator_config import NavigatorConfig
from robot.nodes.costmaps import global_costmap, local_costmap
from robot.nodes.goal_walk import GoalWalk, Heard, check_arrived
from robot.planning import path as paths
from robot.planning.errors import ErrorCode, NavigationError, NotReached
from robot.planning.grid import Grid

LIMITS, TOLERANCE = Limits(), Tolerance()
RATE = 20.0
"""Steps of a walk a second. Pose and velocity may wait for the next one, which is all that uses them."""
GOALS = 8
"""Goals at a time: the one that is walked to, and those that are ending because a newer one took over."""
FIRST_POSE = 1.0
"""How long a goal that comes before the first pose waits for it, s."""
MOST_POSES = 1000
"""Of a goal of navigate_through_poses."""
THROUGH = NavigateThroughPoses_Result.UNKNOWN - NavigateToPose_Result.UNKNOWN
"""What Nav2's own error codes are higher in the one action than in the other."""
LONGEST = 1e9
"""Of a duration in a message, s."""


@dataclass(frozen=True, slots=True)
class Step:
    """How a walk stands."""

    number: int
    """Of the goal that is walked to, from 0."""
    motion: Motion


class Navigation(Node):
    """Walks to goals. Serves the actions navigate_to_pose and navigate_through_poses, and the service plan_path.

    One goal at a time: a newer one preempts, and the older one is aborted. A goal that cannot be reached is aborted at once, before anything
    moves, and a running one goes on; `error_code` says why, as a `robot.planning.errors.ErrorCode`. A message on goal_pose is a goal, too.

    Takes goal_pose, pose, localization, odom, lidar/scan, elevation, gait_status, battery_status, safety/state; publishes autonomy/cmd_vel
    (20 Hz while it walks), plan,
    and while somebody listens global_costmap/costmap (1 Hz) and local_costmap/costmap (2 Hz).
    Parameters: max_speed, max_turn, acceleration, position_tolerance, yaw_tolerance, blind_speed, patience.
    """

    cmd = publishes(AUTONOMY_CMD)
    plan = publishes(PATH)
    global_costmap = publishes(GLOBAL_COSTMAP)
    local_costmap = publishes(LOCAL_COSTMAP)
    max_speed = parameter(0.7, unit="m/s", ge=0.1, le=1.6, description="Fastest walk along a path.")
    max_turn = parameter(LIMITS.wz_max, unit="rad/s", ge=0.2, le=1.5, description="Fastest turn.")
    acceleration = parameter(
        LIMITS.acceleration, unit="m/s2", ge=0.1, le=1.5, description="At most; braking is never delayed."
    )
    position_tolerance = parameter(
        TOLERANCE.position, unit="m", ge=0.02, le=0.5, description="So near to its goal a walk has arrived."
    )
    yaw_tolerance = parameter(TOLERANCE.yaw, unit="rad", ge=0.01, le=3.2, description="And so near to its heading.")
    blind_speed = parameter(
        0.2, unit="m/s", ge=0.0, le=1.6, description="Fastest walk while the LiDAR has been silent for half a second."
    )
    patience = parameter(
        NavigatorConfig().patience,
        unit="s",
        ge=0.0,
        le=120.0,
        description="How long to wait for something in the way before backing up, turning or another way.",
    )

    def __init__(self, grid: Grid, dock: Pose2 | None = None, sight: bool = False, model: RobotModel = SPOT) -> None:
        """With a `dock`, no walk is made or gone on with that leaves no energy for the way there. With `sight` it takes elevation, too."""
        self._grid = grid
        self._sight = sight
        self._dock = dock
        self._model = model

    async def on_start(self) -> None:
        self._heard = Heard()
        self._located = asyncio.Event()
        self._odom: Pose2 | None = None
        self._shows = 0
        self._walk = GoalWalk(
            self,
            self._heard,
            self._grid,
            self._dock,
            self._model,
            cmd=self.cmd,
            plan=lambda path: self.plan(self._path_message(path)),
        )
        self._retune(())
        if self._sight:
            self.on(RELIEF, self.relief)

    @post_set
    def _retune(self, changed: Sequence[Parameter]) -> None:
        """Use the parameters from the next step on, also during a walk."""
        limits = replace(LIMITS, vx_max=self.max_speed, wz_max=self.max_turn, acceleration=self.acceleration)
        self._walk.retune(
            limits, Tolerance(self.position_tolerance, self.yaw_tolerance), self.patience, self.blind_speed
        )

    # -- inputs -----------------------------------------------------------------------------------------------

    @POSE.on(qos=20, patience=1.0 / RATE)
    def pose(self, message: PoseStamped) -> None:
        if not is_pose(message.pose):
            return
        here = self._heard.pose = from_pose(message.pose)
        self._heard.poses.add(seconds(message.header.stamp), here)
        self._located.set()

    @ODOMETRY.on(qos=20, patience=1.0 / RATE)
    def odometry(self, message: Odometry) -> None:
        if not is_pose(message.pose.pose):
            return
        self._odom = from_pose(message.pose.pose)
        twist = message.twist.twist
        self._heard.velocity = Twist2(twist.linear.x, twist.linear.y, twist.angular.z)

    @LOCALIZATION.on()
    def localization(self, message: String) -> None:
        """A robot that does not know where it is stands still, and goes on when it does; one whose LiDAR sees nothing walks slowly."""
        self._heard.lost, self._heard.blind = message.data in (LOST, AMBIGUOUS), message.data == BLIND

    @SCAN.on()
    def scan(self, message: LaserScan) -> None:
        self._heard.scan = message

    def relief(self, message: OccupancyGrid) -> None:
        """From the first one on the robot avoids steps and holes, and walks no faster than it sees the floor."""
        info = message.info
        if len(message.data) != info.height * info.width or not info.resolution > 0.0:
            return
        cells = message.data.reshape(info.height, info.width)
        self._heard.relief = Relief(cells, info.resolution, info.origin.position.x, info.origin.position.y)

    @GAIT_STATUS.on()
    def gait(self, message: GaitStatus) -> None:
        self._heard.gait, self._heard.gait_goal = message.mode, message.goal

    @BATTERY_STATUS.on()
    def energy(self, message: BatteryStatus) -> None:
        critical = message.level == ChargeLevel.CRITICAL
        self._heard.critical = f"battery critical ({message.percent:.0f} %)" if critical else ""
        self._walk.energy.heard(message.percent, message.energy)

    @SAFETY_STATE.on()
    def safety(self, message: SafetyState) -> None:
        """During a safety stop no goal is accepted, and a running one is aborted."""
        self._heard.stopped = "; ".join(message.reasons) if message.stopped else ""

    @every(hz=RATE)
    def steer(self) -> None:
        """Step the walk, while one is under way."""
        self._walk.steer()

    @every(hz=2)
    def show(self) -> None:
        """Publish the costmaps for their subscribers; each second time both."""
        self._shows += 1
        here, odom, stamp = self._heard.pose, self._odom, self.clock.stamp()
        if self.local_costmap.subscription_count and here is not None and odom is not None:
            self._walk.look()
            self.local_costmap(local_costmap(self._walk.navigator, here, odom, stamp))
        if self.global_costmap.subscription_count and self._shows % 2 == 0:
            self._walk.look()
            self.global_costmap(global_costmap(self._walk.navigator, stamp))

    # -- goals -------------------------------------------------------------------------------------------------------

    @GOAL_POSE.on()
    def goal_pose(self, message: PoseStamped) -> None:
        """Walk there, as a client of navigate_to_pose would ask."""
        self.create_task(self._walk_to(message))

    async def _walk_to(self, pose: PoseStamped) -> None:
        try:
            async with self.send_goal(NAVIGATE_TO_POSE, NavigateToPose.Goal(pose=pose)) as going:
                await going
        except ActorError as error:
            why = getattr(error, "reason", "") or str(error)
            self.log.warning(f"the goal of {GOAL_POSE.name} was not reached", why=why)

    @NAVIGATE_TO_POSE.serve(arrivals=parallel(GOALS))
    async def to_pose(self, goal: NavigateToPose_Goal) -> Steps[NavigateToPose_Feedback, NavigateToPose_Result]:
        begun = self.clock.now()
        try:
            async with aclosing(self._walk_along((goal.pose,), goal.behavior_tree)) as steps:
                async for step in steps:
                    yield NavigateToPose.Feedback(**self._progress(step.motion, begun))
        except NotReached as failure:
            yield Aborted(NavigateToPose.Result(error_code=failure.code, error_msg=str(failure)), str(failure))
        except asyncio.CancelledError:
            yield Done(NavigateToPose.Result(error_msg="Goal canceled"))
        else:
            yield Done(NavigateToPose.Result())

    @NAVIGATE_THROUGH_POSES.accepts
    def check_poses(self, goal: NavigateThroughPoses_Goal) -> None:
        if not 0 < len(goal.poses.goals) <= MOST_POSES:
            raise Reject(f"{len(goal.poses.goals)} poses: give 1 to {MOST_POSES}")

    @NAVIGATE_THROUGH_POSES.serve(arrivals=parallel(GOALS))
    async def through_poses(
        self, goal: NavigateThroughPoses_Goal
    ) -> Steps[NavigateThroughPoses_Feedback, NavigateThroughPoses_Result]:
        begun, poses = self.clock.now(), goal.poses.goals
        reached, failed = 0, NotReached(ErrorCode.NONE, "")
        try:
            async with aclosing(self._walk_along(poses, goal.behavior_tree)) as steps:
                async for step in steps:
                    reached = step.number
                    yield NavigateThroughPoses.Feedback(
                        **self._progress(step.motion, begun),
                        number_of_poses_remaining=len(poses) - reached,
                        waypoint_statuses=_statuses(poses, reached, failed),
                    )
            reached = len(poses)
        except NotReached as error:
            code = error.code + (THROUGH if ErrorCode.UNKNOWN <= error.code <= ErrorCode.TF_ERROR else 0)
            result = NavigateThroughPoses.Result(
                error_code=code, error_msg=str(error), waypoint_statuses=_statuses(poses, reached, error)
            )
            yield Aborted(result, str(error))
        except asyncio.CancelledError:
            statuses = _statuses(poses, reached, failed)
            yield Done(NavigateThroughPoses.Result(error_msg="Goal canceled", waypoint_statuses=statuses))
        else:
            yield Done(NavigateThroughPoses.Result(waypoint_statuses=_statuses(poses, reached, failed)))

    async def _walk_along(self, poses: Sequence[PoseStamped], behavior_tree: str) -> AsyncGenerator[Step, None]:
        """Walk to each of the poses in turn, and yield how it goes ten times a second. Raises `NotReached`."""
        if behavior_tree not in ("", STRAIGHT):
            raise NotReached(
                ErrorCode.FAILED_TO_LOAD_BEHAVIOR_TREE,
                f"there is no behavior tree {behavior_tree!r}: leave it empty, or give {STRAIGHT!r}",
            )
        for pose in poses:
            frame = pose.header.frame_id
            if frame not in ("map", ""):
                raise NotReached(ErrorCode.TF_ERROR, f"unknown frame {frame!r}: give the goal in frame 'map'")
        goals, straight = [from_pose(pose.pose) for pose in poses], behavior_tree == STRAIGHT
        with suppress(TimeoutError):  # a client that has waited for the server may be faster than the first pose
            async with asyncio.timeout(FIRST_POSE):
                await self._located.wait()
        self._walk.check(goals, straight=straight)
        for number, goal in enumerate(goals):
            motion: Motion | None = None
            async with aclosing(self._walk.walk(goal, straight=straight)) as motions:
                async for motion in motions:
                    yield Step(number, motion)
            check_arrived(motion)

    def _progress(self, motion: Motion, begun: float) -> dict[str, Any]:
        """What the feedbacks of both actions have in common."""
        here, path = self._heard.pose, self._walk.path
        assert here is not None
        off, turned = path.tracking_error(here.x, here.y, here.yaw) if path is not None else (0.0, 0.0)
        return {
            "current_pose": pose_stamped(here, self.clock.stamp()),
            "navigation_time": _duration(self.clock.now() - begun),
            "estimated_time_remaining": _duration(motion.eta),
            "number_of_recoveries": self._walk.recoveries,
            "distance_remaining": motion.distance_remaining,
            "position_tracking_error": off,
            "heading_tracking_error": turned,
        }

    # -- plan_path ---------------------------------------------------------------------------------------------------

    @PLAN_PATH.serve()
    async def plan_path(self, request: PlanPath_Request) -> PlanPath_Response:
        """Plan a path on the map. An invalid start or goal is answered with success False and the reason."""
        try:
            path = self._walk.planner.plan(from_pose(request.start.pose), from_pose(request.goal.pose))
        except NavigationError as error:
            return PlanPath.Response(success=False, message=f"{error.name}: {error}")
        return PlanPath.Response(path=self._path_message(path), success=True, message="Path planned successfully")

    def _path_message(self, path: paths.Path | None) -> Path:
        """The path as a message; without poses if there is none."""
        stamp = self.clock.stamp()
        header = Header(stamp=stamp, frame_id="map")
        if path is None:
            return Path(header=header)
        return Path(header=header, poses=tuple(pose_stamped(Pose2(x, y), stamp) for x, y in path.points.tolist()))


def _duration(seconds: float) -> Duration:
    """Rounded to a nanosecond."""
    sec, nanosec = divmod(round(min(max(seconds, 0.0), LONGEST) * 1e9), 1_000_000_000)
    return Duration(sec=sec, nanosec=nanosec)


def _statuses(poses: Sequence[PoseStamped], reached: int, failure: NotReached) -> list[WaypointStatus]:
    """Of each pose: so many were reached, and the next one was not for this reason, if any."""
    return [
        WaypointStatus(
            waypoint_status=WaypointStatus.COMPLETED if number < reached
            else WaypointStatus.FAILED if number == reached and failure.code
            else WaypointStatus.PENDING,
            waypoint_index=number, waypoint_pose=pose,
            error_code=failure.code if number == reached else 0, error_msg=str(failure) if number == reached else "",
        )
        for number, pose in enumerate(poses)
    ]  # fmt: skip
