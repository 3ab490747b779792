"""The navigation node: three actions and a planning service that share one navigator."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from contextlib import aclosing
from dataclasses import replace
from math import hypot, isfinite

import numpy as np

from actors import Aborted, Done, Node, Parameter, Reject, Steps, every, parameter, publishes
from actors.interfaces.geometry_msgs.msg import PoseStamped
from actors.interfaces.nav_msgs.msg import OccupancyGrid, Odometry, Path
from actors.interfaces.sensor_msgs.msg import BatteryState, LaserScan
from actors.interfaces.std_msgs.msg import Header, String
from actors.parameters import post_set
from robot.contracts import (
    AUTONOMY_CMD,
    BATTERY_STATE,
    BATTERY_STATUS,
    GAIT_STATUS,
    HUMANOID_NAVIGATE,
    LOCALIZATION,
    MOVE_TO_POSITION,
    NAVIGATE_TO_GOAL,
    ODOMETRY,
    PATH,
    PLAN_PATH,
    POSE,
    RELIEF,
    SAFETY_STATE,
    SCAN,
)
from robot.control.limits import Limits, Tolerance
from robot.control.motion import Motion
from robot.control.navigator_config import NavigatorConfig
from robot.estimation.elevation import Relief
from robot.estimation.fit_watch import AMBIGUOUS, BLIND, LOST
from robot.geometry.angles import wrap
from robot.geometry.messages import from_pose, pose_stamped, seconds
from robot.geometry.planar import Pose2, Twist2
from robot.interfaces.robactor_msgs.msg import BatteryStatus, GaitStatus, SafetyState
from robot.interfaces.tutorials.humanoid_control_interfaces.action import (
    NavigateToGoal,
    NavigateToGoal_Feedback,
    NavigateToGoal_Goal,
    NavigateToGoal_Result,
)
from robot.interfaces.tutorials.humanoid_control_interfaces.srv import PlanPath, PlanPath_Request, PlanPath_Response
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
from robot.nodes.goal_walk import GoalWalk, Heard, verdict
from robot.planning import path as paths
from robot.planning.errors import NavigationError
from robot.planning.grid import Grid

LIMITS, TOLERANCE = Limits(), Tolerance()
RATE = 20.0
"""Steps of a walk a second. Pose and velocity may wait for the next one, which is all that uses them."""
NEAR = 0.1
"""A humanoid_navigate goal within this of the robot (m, and rad of heading) is reached at once."""
FEEDBACK_EVERY = 10
"""Looks at the walk (tenths of a second) between two feedbacks of humanoid_navigate, as its tutorial has it."""


class Navigation(Node):
    """Walks to goals. Serves the actions navigate_to_goal, move_to_position and humanoid_navigate, and the service plan_path.

    One goal at a time: a new one preempts, whichever of the three it comes by. The preempted goal ends with its result, canceled when it
    came by the same action, else aborted, and its reason says so. A goal that cannot be reached by the map is rejected with a named reason.

    Takes pose, localization, odom, lidar/scan, elevation, gait_status, battery_state, battery_status, safety/state; publishes autonomy/cmd_vel
    (20 Hz while it walks), plan.
    Parameters: max_speed, max_turn, acceleration, position_tolerance, yaw_tolerance, blind_speed, patience.
    """

    cmd = publishes(AUTONOMY_CMD)
    plan = publishes(PATH)
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

    def __init__(self, grid: Grid, dock: Pose2 | None = None, sight: bool = False) -> None:
        """With a `dock`, no walk is made or gone on with that leaves no energy for the way there. With `sight` it takes elevation, too."""
        self._grid = grid
        self._sight = sight
        self._dock = dock

    async def on_start(self) -> None:
        self._heard = Heard()
        self._walked = 0.0
        self._walk = GoalWalk(
            self,
            self._heard,
            self._grid,
            self._dock,
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
        here, last = from_pose(message.pose), self._heard.pose
        if last is not None:
            self._walked += hypot(here.x - last.x, here.y - last.y)
        self._heard.pose = here
        self._heard.poses.add(seconds(message.header.stamp), here)

    @ODOMETRY.on(qos=20, patience=1.0 / RATE)
    def odometry(self, message: Odometry) -> None:
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
        """From the first one on the robot heeds steps and holes, and walks no faster than it sees the floor."""
        info = message.info
        cells = message.data.reshape(info.height, info.width)
        self._heard.relief = Relief(cells, info.resolution, info.origin.position.x, info.origin.position.y)

    @GAIT_STATUS.on()
    def gait(self, message: GaitStatus) -> None:
        self._heard.gait, self._heard.gait_goal = message.mode, message.goal

    @BATTERY_STATE.on()
    def battery(self, message: BatteryState) -> None:
        self._heard.charge = message.percentage if isfinite(message.percentage) else 1.0

    @BATTERY_STATUS.on()
    def energy(self, message: BatteryStatus) -> None:
        self._walk.energy.heard(message.percent, message.energy)

    @SAFETY_STATE.on()
    def safety(self, message: SafetyState) -> None:
        """During a safety stop no goal is accepted, and a running one is aborted."""
        self._heard.stopped = "; ".join(message.reasons) if message.stopped else ""

    @every(hz=RATE)
    def steer(self) -> None:
        """Step the walk, while one is under way."""
        self._walk.steer()

    # -- navigate_to_goal --------------------------------------------------------------------------------------------

    @NAVIGATE_TO_GOAL.accepts
    def check_navigation(self, goal: NavigateToGoal_Goal) -> None:
        frame = goal.target_pose.header.frame_id
        if frame not in ("map", ""):
            raise Reject(f"unknown frame {frame!r}: give the goal in frame 'map'")
        self._walk.check(from_pose(goal.target_pose.pose))

    @NAVIGATE_TO_GOAL.serve(arrivals="preempt")
    async def navigate(self, goal: NavigateToGoal_Goal) -> Steps[NavigateToGoal_Feedback, NavigateToGoal_Result]:
        walked, whole, progress = self._walked, 0.0, 0.0
        motion: Motion | None = None

        def result(success: bool, message: str) -> NavigateToGoal_Result:
            return NavigateToGoal.Result(success=success, message=message, total_distance=self._walked - walked)

        try:
            async with aclosing(self._walk.walk(from_pose(goal.target_pose.pose))) as motions:
                async for motion in motions:
                    whole = max(whole, motion.distance_remaining + (self._walked - walked))
                    share = 1.0 - motion.distance_remaining / whole if whole > 0.0 else 1.0
                    # A way that grows longer, round something unforeseen, does not take back what has been done.
                    progress = max(progress, 100.0 * min(1.0, max(0.0, share)))
                    assert self._heard.pose is not None
                    yield NavigateToGoal.Feedback(
                        current_pose=pose_stamped(self._heard.pose, self.clock.stamp()),
                        distance_remaining=motion.distance_remaining,
                        progress_percent=progress,
                    )
        except asyncio.CancelledError:
            yield Done(result(False, "Goal canceled"))
        else:
            ok, text = verdict(motion)
            yield Done(result(ok, text)) if ok else Aborted(result(ok, text), text)

    # -- move_to_position --------------------------------------------------------------------------------------------

    @MOVE_TO_POSITION.accepts
    def check_move(self, goal: MoveToPosition_Goal) -> None:
        self._walk.check(Pose2(goal.target_x, goal.target_y, goal.target_theta))

    @MOVE_TO_POSITION.serve(arrivals="preempt")
    async def move(self, goal: MoveToPosition_Goal) -> Steps[MoveToPosition_Feedback, MoveToPosition_Result]:
        begun = self.clock.now()
        motion: Motion | None = None

        def result(success: bool, message: str) -> MoveToPosition_Result:
            here = self._heard.pose or Pose2(0.0, 0.0)
            seconds = self.clock.now() - begun
            return MoveToPosition.Result(
                success=success, final_x=here.x, final_y=here.y, total_time_seconds=seconds, message=message
            )

        try:
            async with aclosing(self._walk.walk(Pose2(goal.target_x, goal.target_y, goal.target_theta))) as motions:
                async for motion in motions:
                    assert self._heard.pose is not None
                    yield MoveToPosition.Feedback(
                        current_x=self._heard.pose.x,
                        current_y=self._heard.pose.y,
                        distance_remaining=motion.distance_remaining,
                        estimated_time_remaining=motion.eta,
                    )
        except asyncio.CancelledError:
            yield Done(result(False, "Movement canceled"))
        else:
            ok, text = verdict(motion)
            yield Done(result(True, "Reached target position")) if ok else Aborted(result(False, text), text)

    # -- humanoid_navigate -------------------------------------------------------------------------------------------

    @HUMANOID_NAVIGATE.accepts
    def check_humanoid(self, goal: HumanoidNav_Goal) -> None:
        target = goal.target_position.tolist()
        if len(target) != 3 or not all(map(isfinite, target)):
            raise Reject(
                f"target_position {target} is not [x, y, theta]: give three finite numbers, in metres and radians"
            )
        self._walk.check(Pose2(*target), straight=not goal.avoid_obstacles)

    @HUMANOID_NAVIGATE.serve(arrivals="preempt")
    async def humanoid(self, goal: HumanoidNav_Goal) -> Steps[HumanoidNav_Feedback, HumanoidNav_Result]:
        target = Pose2(*goal.target_position.tolist())
        looks, motion = 0, None
        away = hypot(target.x - self._here.x, target.y - self._here.y)
        if away < NEAR and abs(wrap(target.yaw - self._here.yaw)) < NEAR:
            yield self._humanoid_feedback(looks, away)
            yield Done(self._humanoid_result(True, "Goal reached"))
            return
        try:
            async with aclosing(self._walk.walk(target, straight=not goal.avoid_obstacles)) as motions:
                async for motion in motions:
                    looks += 1
                    if looks % FEEDBACK_EVERY == 0:
                        yield self._humanoid_feedback(looks, motion.distance_remaining)
            if looks < FEEDBACK_EVERY:
                yield self._humanoid_feedback(looks, motion.distance_remaining if motion is not None else away)
        except asyncio.CancelledError:
            yield Done(self._humanoid_result(False, "Goal canceled"))
        else:
            ok, text = verdict(motion)
            ended = self._humanoid_result(ok, text)
            yield Done(ended) if ok else Aborted(ended, text)

    @property
    def _here(self) -> Pose2:
        return self._heard.pose or Pose2(0.0, 0.0)

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
