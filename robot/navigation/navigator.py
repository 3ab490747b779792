"""Walking to a goal: plan, follow, watch, replan, recover, and say by name why it did not work. Pure: no clock, no node."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from robot.estimation.elevation import Relief
from robot.geometry.planar import ZERO_TWIST, Pose2, Twist2
from robot.geometry.vectors import Floats
from robot.model.footprint import Footprint
from robot.navigation.caution import cautious_speed, slower
from robot.navigation.follow import Follower, Phase, Step
from robot.navigation.gaps import plan_through_gap
from robot.navigation.limits import Limits, Tolerance
from robot.navigation.local_costmap import LocalCostmap
from robot.navigation.local_field import LocalField
from robot.navigation.motion import Motion, State
from robot.navigation.navigator_config import NavigatorConfig
from robot.navigation.navigator_state import Instant, NarrowSearches, Planned, Recoveries, Walked, apart, carried
from robot.navigation.progress import Manoeuvre, ProgressChecker, Recovery
from robot.planning.errors import NavigationError, NoProgress, PathBlocked
from robot.planning.grid import Grid
from robot.planning.path import Path
from robot.planning.planner import Margins, Planner, check_finite


class Navigator:
    """Takes one goal at a time: `set_goal`, then `step` at 10 to 50 Hz until the state is arrived, canceled or failed."""

    def __init__(
        self,
        grid: Grid,
        limits: Limits | None = None,
        tolerance: Tolerance | None = None,
        footprint: Footprint | None = None,
        margins: Margins | None = None,
        config: NavigatorConfig | None = None,
    ) -> None:
        self._footprint, self._margins = footprint or Footprint(), margins or Margins()
        self.config = config or NavigatorConfig()
        self._limits = limits or Limits()
        self.follower = Follower(self._limits, tolerance, self.config.following)
        self.state = State.IDLE
        self.goal: Pose2 | None = None
        self.path: Path | None = None
        """The present plan; a new object whenever the plan changes."""
        self.failure: NavigationError | None = None
        self._remaining = 0.0
        self._progress = ProgressChecker()
        self._recovery = Recovery()
        self.update_map(grid)
        self._begin()

    def __repr__(self) -> str:
        return f"Navigator({self.state}, goal={self.goal}, path={self.path})"

    def _begin(self) -> None:
        self._progress.reset()
        self._recovery.reset()
        self._planned, self._narrow, self._recovered = Planned(), NarrowSearches(), Recoveries()
        self._walked = Walked()
        self._stepped_at: float | None = None
        self._straight = False
        self.around.unblock_all()
        self.failure = None
        self._enter(State.IDLE)

    def _enter(self, state: State, now: float = -math.inf) -> None:
        """Take up a state; the timers of the one before it end."""
        self.state = state
        self._waiting_since = now
        self._blocked_since: float | None = None

    # --- goals ------------------------------------------------------------------------------------------------------

    def update_map(self, grid: Grid) -> None:
        """Use another map from now on; a running goal is replanned at the next step."""
        self.planner = Planner(grid, self._footprint, self._margins)
        self.around = LocalCostmap(grid, self._footprint)
        self._field: LocalField | None = None
        self._planned = Planned()

    def retune(self, limits: Limits, tolerance: Tolerance, patience: float) -> None:
        """Use other limits, tolerances and another patience (s) from the next step on; a running goal goes on."""
        self.set_limits(limits)
        self.follower.tolerance = tolerance
        self.config = replace(self.config, patience=patience)

    def set_limits(self, limits: Limits) -> None:
        """Walk within other limits from the next step on."""
        self._limits = limits
        self.follower.set_limits(limits)

    def set_goal(self, goal: Pose2, start: Pose2 | None = None, *, straight: bool = False) -> None:
        """Take a new goal; a running one is dropped. With `start`, the path is planned at once.

        `straight` (it needs a start) asks for the line to the goal and nothing else: what stands on it ends the walk, failed, before the
        body comes near. Only the map's outer bounds rule such a goal out.

        Raises `InvalidPose` or `GoalBlocked` (and with `start` also `StartBlocked` or `Unreachable`); then the old goal
        is kept. What the LiDAR saw does not count here: it may move away.
        """
        check_finite(goal, "goal")
        if straight:
            assert start is not None, "a straight way needs its start"
            check_finite(start, "start")
            self.planner.check_on_map(goal)
            path: Path | None = Path(np.array([(start.x, start.y), (goal.x, goal.y)]))
        else:
            self.planner.check_goal(goal)
            path = self.planner.plan(start, goal) if start is not None else None
        self._begin()
        self._straight = straight
        self.goal, self.path = goal, path
        self._enter(State.FOLLOWING)
        if path is not None:
            self.follower.follow(path, goal)

    @property
    def recoveries(self) -> int:
        """How many recoveries have been begun for this goal."""
        return self._recovered.count

    def cancel(self) -> Motion:
        """Drop the goal. The answer, and every later step, commands a stop."""
        if self.state.running:
            self._enter(State.CANCELED)
        self.follower.halt()
        return self._motion(ZERO_TWIST)

    # --- steps ------------------------------------------------------------------------------------------------------

    def step(
        self,
        now: float,
        pose: Pose2,
        velocity: Twist2 | None = None,
        scan: Floats | None = None,
        scanned_at: Pose2 | None = None,
        relief: Relief | None = None,
    ) -> Motion:
        """The command from `now` (s) on. `scan`: ranges (m), or None when there is no new one, taken at `scanned_at` (None: at `pose`).

        `relief` is the newest of an elevation map, or None: the first one makes the robot heed steps and holes, and the walk no faster than
        it sees the floor.

        `velocity` is the measured one in body axes: the command is chosen for where the body will be when it takes
        effect.
        """
        if scan is not None:
            self.around.integrate_scan(now, scanned_at or pose, scan)
        self.around.advance(now)
        if relief is not None:
            self.around.integrate_relief(now, pose, relief)
        if not self.state.running:
            return self._motion(ZERO_TWIST)
        if not all(map(math.isfinite, (pose.x, pose.y, pose.yaw))):
            self.follower.halt_speed()
            return self._motion(ZERO_TWIST, detail="no pose")
        dt, first = self.config.first_step, self._stepped_at is None
        if self._stepped_at is not None:
            dt = min(max(now - self._stepped_at, 0.0), self.config.longest_step)
        self._stepped_at = now
        if velocity is not None:
            if first:
                self.follower.take_up(velocity)
            pose = carried(pose, velocity, self.config.latency)
        self._heed_footing(pose)
        self._field = self.around.local_field(pose, self._field)
        return self._advance(Instant(now, pose, self._field), dt)

    def _heed_footing(self, pose: Pose2) -> None:
        """Walk slowly over steps and slopes, no faster than the floor is seen, and round steps again once those that were crossed are behind."""
        around = self.around
        near = around.crossing and around.footing.steps_within(pose, self.config.step_ahead)
        if around.crossing and not near:
            around.cross(False)
            self._planned.again = True
        sloping = around.footing.slopes_within(pose, self.config.slope_ahead)
        limits = slower(self._limits, self.config.slope_speed) if sloping else self._limits
        if around.footing.known and self.follower.path is not None:
            seen = around.footing.seen_along(self.follower.ahead(self.config.sight))
            limits = cautious_speed(limits, self.config, seen, stepping=near)
        self.follower.set_limits(limits)

    def _advance(self, now: Instant, dt: float) -> Motion:
        """The step of the state that it is in, after replanning where that is called for."""
        if self.state is State.RECOVERING:
            return self._recover(now)
        if self._straight:
            blocked = self._blocked_ahead(now)
            if blocked is not None:
                return self._fail(blocked)
        elif self._needs_plan(now):
            self._replan(now)
        if self.state is State.WAITING:
            return self._wait(now)
        return self._follow(now, dt)

    def _needs_plan(self, now: Instant) -> bool:
        planned, config, elapsed = self._planned, self.config, now.time - self._planned.at
        if self.state is State.WAITING or self.path is None:
            return elapsed >= config.relaxed_pause
        if planned.again:
            return True
        if self.around.changes == planned.changes or elapsed < config.pause:
            return False
        ahead = self.follower.ahead(config.look)
        least = float(now.field.clearance(ahead[:, 0], ahead[:, 1]).min())
        if least < self.planner.tightest:
            return True
        return least < self._footprint.inscribed + config.side_room and elapsed >= config.relaxed_pause

    def _replan(self, now: Instant) -> bool:
        """Plan with what is seen now; on failure wait, and remember why. True on success."""
        assert self.goal is not None
        forced = self._planned.again
        self._planned = Planned(now.time, self.around.changes, again=False, failure=self._planned.failure)
        far = apart(now.pose, self.goal) > self.config.look
        extra = self.around.clearance_to_unmapped(but=self.goal if far else None)
        try:
            path = self.planner.plan(now.pose, self.goal, extra)
        except NavigationError as error:
            if self.around.unblock_all() or self._may_cross():
                return self._replan(now)
            self._planned.failure = error
            if self.state is not State.WAITING:
                self._enter(State.WAITING, now.time)
            return False
        self._planned.failure = None
        self._walked.planned = max(self._walked.planned, path.length)
        if self.state is State.FOLLOWING and not forced and not self._is_better(path, extra):
            return True
        if self.state is State.WAITING:
            self._enter(State.FOLLOWING)
        self.path = path
        self.follower.follow(path, self.goal, now.field)
        return True

    def _may_cross(self) -> bool:
        """Whether steps are counted as floor from now on, because no way leads round them."""
        if self.around.crossing or not self.around.footing.steps.any():
            return False
        self.around.cross(True)
        return True

    def _is_better(self, path: Path, extra: Floats | None) -> bool:
        """Whether to change over to a new path: not for a little, or the robot would waver between two ways round a thing."""
        rest = self.planner.price(self.follower.ahead(math.inf), extra)
        return self.planner.price(path.spaced(self.follower.config.spacing).points, extra) < self.config.gain * rest

    def _plan_through_gap(self, now: Instant) -> None:
        """Where it is too narrow to follow the path with the body's middle, plan the heading too."""
        assert self.path is not None
        assert self.goal is not None
        follower, narrow, config = self.follower, self._narrow, self.config
        if follower.threading or now.time - narrow.tried_at < config.poses_pause:
            return
        if not follower.is_tight(now.pose, now.field):
            return
        narrow.tried_at = now.time
        poses = plan_through_gap(now.pose, self.path, follower.along, self.goal, now.field, follower.limits)
        if poses is not None:
            narrow.misfits = 0
            follower.follow_poses(poses)
            return
        narrow.misfits += 1
        clearance, x, y = follower.narrowest(now.field, follower.config.offered_over)
        if narrow.misfits >= config.misfits and clearance < config.contact:
            narrow.misfits, self._planned.again = 0, True
            self.around.block(x, y)

    def _follow(self, now: Instant, dt: float) -> Motion:
        config, recovered = self.config, self._recovered
        if not self._straight:
            self._plan_through_gap(now)
        step = self.follower.step(now.pose, now.field, dt)
        if step.phase is Phase.ARRIVED:
            self._enter(State.ARRIVED)
            return self._motion(ZERO_TWIST, step)
        if step.off_path > config.off_path:
            self._planned.again = True
        if (
            recovered.at is not None
            and apart(now.pose, recovered.at) > config.recovered
            and not self._is_near(now.pose)
        ):
            self._recovery.reset()
            recovered.at = None
        self._walked.to(now.pose)
        if self._walked.metres > config.most_walked * self._walked.planned + config.aside:
            return self._fail(self._wandered())
        blocked = self._blocked_for(now.time, step)
        if blocked > config.release:
            self.follower.drop_poses()
        if blocked > config.held or self._progress.stuck(now.time, now.pose):
            return self._start_recovery(now)
        return self._motion(step.command, step)

    def _is_near(self, pose: Pose2) -> bool:
        return self.goal is not None and apart(pose, self.goal) < self.config.near_goal

    def _wandered(self) -> NavigationError:
        assert self.goal is not None
        return NoProgress(
            f"{self._walked.metres:.0f} m walked without arriving at the goal ({self.goal.x:.2f}, {self.goal.y:.2f}), to which the longest"
            f" way was {self._walked.planned:.0f} m: what the robot sees closes it in, or hides the way"
        )

    def _blocked_for(self, now: float, step: Step) -> float:
        """For how long, s, no command has been allowed; 0 when this step has one."""
        if step.phase is not Phase.BLOCKED:
            self._blocked_since = None
            return 0.0
        if self._blocked_since is None:
            self._blocked_since = now
        return now - self._blocked_since

    def _wait(self, now: Instant) -> Motion:
        self.follower.halt_speed()
        self._progress.reset()
        if now.time - self._waiting_since > self.config.patience:
            return self._start_recovery(now)
        return self._motion(ZERO_TWIST, detail="blocked")

    # --- trouble ----------------------------------------------------------------------------------------------------

    def _blocked_ahead(self, now: Instant) -> NavigationError | None:
        """What stands where the body will be before it could stop, on a way that may not be left."""
        reach = self.config.straight_look + self.follower.limits.vx_max**2 / (2 * self.config.braking)
        room, x, y = self.follower.narrowest(now.field, reach)
        if room >= self.config.contact:
            return None
        assert self.goal is not None
        return PathBlocked(
            f"something stands on the straight way to ({self.goal.x:.2f}, {self.goal.y:.2f}), at ({x:.2f}, {y:.2f}),"
            " and it was asked not to walk round obstacles"
        )

    def _start_recovery(self, now: Instant) -> Motion:
        if self._straight:
            return self._fail(self._blocked_ahead(now))
        self._progress.reset()
        self.follower.halt_speed()
        self._recovered.count += 1
        name = self._recovery.begin(now.time) if self._recovered.count <= self.config.most_recoveries else None
        if name is None:
            return self._fail(near=self._is_near(now.pose))
        self._recovered.at = now.pose
        self._enter(State.RECOVERING)
        if name is Manoeuvre.CLEAR:
            self.around.forget()
        return self._motion(ZERO_TWIST, detail=name)

    def _recover(self, now: Instant) -> Motion:
        detail = self._recovery.current or ""
        order = self._recovery.command(now.time)
        if order is not None:
            command = self.follower.limits.clip(order[0], 0.0, order[1])
            if self.follower.is_clear(command, now.pose, now.field):
                return self._motion(command, detail=detail)
            self._recovery.give_up()
        self._enter(State.FOLLOWING)
        self._planned.again = True
        if not self._replan(now):
            return self._start_recovery(now)
        return self._motion(ZERO_TWIST, detail=detail)

    def _fail(self, failure: NavigationError | None = None, *, near: bool = False) -> Motion:
        tried = self._tried()
        assert self.goal is not None
        where = f"the goal ({self.goal.x:.2f}, {self.goal.y:.2f})"
        if failure is not None:
            self.failure = failure
        elif self._planned.failure is not None:
            inside = ": the goal is inside something that it sees, or closed in by it" if near else ""
            self.failure = PathBlocked(
                f"the way to {where} is closed ({self._planned.failure}){inside}; tried: {tried}"
            )
        else:
            self.failure = NoProgress(f"no progress toward {where} although a path exists; tried: {tried}")
        self._enter(State.FAILED)
        self.follower.halt()
        return self._motion(ZERO_TWIST)

    def _tried(self) -> str:
        """What was done before giving up, in words."""
        if self._straight:
            return "nothing, as it was asked to go straight"
        if self._recovered.count > self.config.most_recoveries:
            return f"{self.config.most_recoveries} recoveries in all"
        return ", ".join(self._recovery.tried)

    # --- answers ----------------------------------------------------------------------------------------------------

    def _motion(self, command: Twist2, step: Step | None = None, detail: str = "") -> Motion:
        remaining = step.remaining if step is not None else self._remaining
        self._remaining = remaining
        pace = self.config.usual_pace * self.follower.limits.vx_max
        return Motion(
            command.vx,
            command.vy,
            command.wz,
            self.state,
            remaining,
            remaining / pace,
            self.failure,
            step.phase if step is not None else detail,
            step.clearance if step is not None else math.inf,
        )
