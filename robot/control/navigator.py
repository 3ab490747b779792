"""Walking to a goal: plan, follow, watch, plan anew, recover, and say by name why it did not work. Pure: no clock, no
node.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from robot.control.follow import Follower, Phase, Step
from robot.control.gaps import thread
from robot.control.limits import STOP, Command, Limits, Tolerance
from robot.control.progress import Manoeuvre, ProgressChecker, Recovery
from robot.estimation.surroundings import Surroundings
from robot.geometry.angles import wrap
from robot.geometry.planar import Pose2
from robot.geometry.vectors import Floats
from robot.model.footprint import Footprint
from robot.planning.errors import GoalBlocked, NavigationError, NoProgress, PathBlocked
from robot.planning.grid import Grid
from robot.planning.path import Path
from robot.planning.planner import Margins, Planner, check_finite

__all__ = ["Motion", "Navigator", "State"]


class State(StrEnum):
    """What the navigator is doing."""

    IDLE = "idle"
    FOLLOWING = "following"
    WAITING = "waiting"
    RECOVERING = "recovering"
    ARRIVED = "arrived"
    CANCELED = "canceled"
    FAILED = "failed"


@dataclass(frozen=True, slots=True)
class Motion:
    """One answer of the navigator: the command (m/s, m/s, rad/s in body axes) and how things stand."""

    vx: float
    vy: float
    wz: float
    state: State
    distance_remaining: float
    """Along the path, m."""
    eta: float
    """Seconds to the goal at the usual pace."""
    failure: NavigationError | None = None
    """Why, when the state is ``failed``."""
    detail: str = ""
    """The phase or the manoeuvre at work, or why there is neither."""
    clearance: float = math.inf
    """From the body's outline to the nearest thing now, m."""


_NEAR = 0.30
"""A path on which the body's side comes this near to something seen is worth planning anew, m."""
_GAIN = 0.85
"""A new path must cost less than this share of the old one."""
_MISFITS, _CONTACT = 2, 0.05
"""After so many failures to find poses through a place narrower than this (m), another way is looked for."""
_PATIENCE = 8.0
"""How long to wait for something in the way to move, before the recoveries begin, s."""
_MOST_RECOVERIES = 12
_STRAIGHT_LOOK, _BRAKING = 0.3, 0.8
"""On a straight way: how far ahead (m) the body looks beyond the distance in which it stops at so many m/s2."""
_LATENCY = 0.1
"""From a pose estimate to the body answering the command it led to, s."""


def _apart(a: Pose2, b: Pose2) -> float:
    return math.hypot(a.x - b.x, a.y - b.y)


def _carried(pose: Pose2, velocity: Command) -> Pose2:
    """The pose one latency later."""
    c, s = math.cos(pose.yaw), math.sin(pose.yaw)
    x = pose.x + (c * velocity.vx - s * velocity.vy) * _LATENCY
    y = pose.y + (s * velocity.vx + c * velocity.vy) * _LATENCY
    return Pose2(x, y, wrap(pose.yaw + velocity.wz * _LATENCY))


class Navigator:
    """Takes one goal at a time: `set_goal`, then `step` at 10 to 50 Hz until the state is arrived, canceled or failed."""

    def __init__(
        self,
        grid: Grid,
        limits: Limits | None = None,
        tolerance: Tolerance | None = None,
        footprint: Footprint | None = None,
        margins: Margins | None = None,
    ) -> None:
        self._footprint, self._margins = footprint or Footprint(), margins or Margins()
        self.follower = Follower(limits, tolerance)
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
        self._recoveries = 0
        self._recovered_at: Pose2 | None = None
        self._last_time: float | None = None
        self._planned_at = -math.inf
        self._planned_changes = -1
        self._waiting_since: float | None = None
        self._obstruction: NavigationError | None = None
        self._held_since: float | None = None
        self._threaded_at = -math.inf
        self._misfits = 0
        self._straight = False
        self.around.reopen()
        self.failure = None

    # --- goals ------------------------------------------------------------------------------------------------------

    def update_map(self, grid: Grid) -> None:
        """Use another map from now on; a running goal is planned anew at the next step."""
        self.planner = Planner(grid, self._footprint, self._margins)
        self.around = Surroundings(grid, self._footprint)
        self._planned_at = -math.inf
        self._planned_changes = -1

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
            self._check_goal(goal)
            path = self.planner.plan(start, goal) if start is not None else None
        self._begin()
        self._straight = straight
        self.goal, self.path, self.state = goal, path, State.FOLLOWING
        if path is not None:
            self.follower.follow(path, goal)

    def _check_goal(self, goal: Pose2) -> None:
        self.planner.check_goal(goal)
        footprint, grid = self.around.footprint, self.around.grid
        px, py = footprint.placed(*(np.array(v) for v in (goal.x, goal.y, goal.yaw)))
        for x, y in zip(px.tolist(), py.tolist(), strict=True):
            cell = grid.cell(x, y)
            if cell is not None and grid.clearance[cell] < 0.0:
                raise GoalBlocked(
                    f"at the goal ({goal.x:.2f}, {goal.y:.2f}, yaw {goal.yaw:.2f}) the body would touch an obstacle"
                    f" at ({x:.2f}, {y:.2f})"
                )

    def cancel(self) -> Motion:
        """Drop the goal. The answer, and every later step, commands a stop."""
        if self.state in (State.FOLLOWING, State.WAITING, State.RECOVERING):
            self.state = State.CANCELED
        self.follower.halt()
        return self._motion(STOP)

    # --- steps ------------------------------------------------------------------------------------------------------

    def step(self, now: float, pose: Pose2, velocity: Command | None = None, scan: Floats | None = None) -> Motion:
        """The command from `now` (s) on. `scan`: ranges (m) taken at this pose, or None when there is no new one.

        `velocity` is the measured one in body axes: the command is chosen for where the body will be when it takes
        effect.
        """
        if scan is not None:
            self.around.look(now, pose, scan)
        self.around.advance(now)
        if self.state not in (State.FOLLOWING, State.WAITING, State.RECOVERING):
            return self._motion(STOP)
        if not all(map(math.isfinite, (pose.x, pose.y, pose.yaw))):
            self.follower.halt_speed()
            return self._motion(STOP, detail="no pose")
        fresh = self._last_time is None
        dt = 0.05 if self._last_time is None else min(max(now - self._last_time, 0.0), 0.2)
        self._last_time = now
        if velocity is not None:
            if fresh:
                self.follower.take_up(velocity)
            pose = _carried(pose, velocity)
        self.around.center_on(pose)
        if self.state is State.RECOVERING:
            return self._recover(now, pose)
        if self._straight:
            blocked = self._blocked_ahead(pose)
            if blocked is not None:
                return self._fail(blocked)
        elif self._needs_plan(now, pose):
            self._replan(now, pose)
        if self.state is State.WAITING:
            return self._wait(now, pose)
        return self._follow(now, pose, dt)

    def _needs_plan(self, now: float, pose: Pose2) -> bool:
        if self.state is State.WAITING or self.path is None:
            return now - self._planned_at >= 1.0
        if self._planned_changes < 0:
            return True
        if self.around.changes == self._planned_changes or now - self._planned_at < 0.4:
            return False
        ahead = self.follower.ahead(2.5)
        least = float(self.around.clearance(ahead[:, 0], ahead[:, 1]).min())
        if least < self.planner.tightest:
            return True
        return least < self._footprint.inscribed + _NEAR and now - self._planned_at >= 1.0

    def _replan(self, now: float, pose: Pose2) -> bool:
        """Plan with what is seen now; on failure wait, and remember why. True on success."""
        assert self.goal is not None
        first = self._planned_changes < 0
        self._planned_at, self._planned_changes = now, self.around.changes
        extra = self.around.extra()
        try:
            path = self.planner.plan(pose, self.goal, extra)
        except NavigationError as error:
            if self.around.reopen():
                return self._replan(now, pose)
            self._obstruction = error
            if self.state is not State.WAITING:
                self.state, self._waiting_since = State.WAITING, now
            return False
        self._obstruction, self._waiting_since = None, None
        if self.state is State.FOLLOWING and not first and not self._is_better(path, extra):
            return True
        self.state, self.path = State.FOLLOWING, path
        self.follower.follow(path, self.goal, self.around)
        return True

    def _is_better(self, path: Path, extra: Floats | None) -> bool:
        """Whether to change over to a new path: not for a little, or the robot would waver between two ways round a thing."""
        rest = self.planner.price(self.follower.ahead(math.inf), extra)
        return self.planner.price(path.spaced(self.follower.config.spacing).points, extra) < _GAIN * rest

    def _thread(self, now: float, pose: Pose2) -> None:
        """Where it is too narrow to follow the path with the body's middle, plan the heading too."""
        assert self.path is not None
        assert self.goal is not None
        if self.follower.threading or now - self._threaded_at < 0.5 or not self.follower.is_tight(pose, self.around):
            return
        self._threaded_at = now
        poses = thread(pose, self.path, self.follower.along, self.goal, self.around, self.follower.limits)
        if poses is not None:
            self._misfits = 0
            self.follower.thread(poses)
            return
        self._misfits += 1
        clearance, x, y = self.follower.narrowest(self.around, self.follower.config.offered_over)
        if self._misfits >= _MISFITS and clearance < _CONTACT:
            self._misfits, self._planned_changes = 0, -1
            self.around.close(x, y)

    def _follow(self, now: float, pose: Pose2, dt: float) -> Motion:
        if not self._straight:
            self._thread(now, pose)
        step = self.follower.step(pose, self.around, dt)
        if step.phase is Phase.ARRIVED:
            self.state = State.ARRIVED
            return self._motion(STOP, step)
        if step.off_path > 0.6:
            self._planned_changes = -1
        if self._recovered_at is not None and _apart(pose, self._recovered_at) > 1.0:
            self._recovery.reset()
            self._recovered_at = None
        held = step.phase is Phase.BLOCKED
        if held and self._held_since is not None and now - self._held_since > 1.0:
            self.follower.unthread()
        self._held_since = (now if self._held_since is None else self._held_since) if held else None
        too_long = self._held_since is not None and now - self._held_since > 3.0
        if too_long or self._progress.stuck(now, pose):
            return self._start_recovery(now, pose)
        return self._motion(step.command, step)

    def _wait(self, now: float, pose: Pose2) -> Motion:
        self.follower.halt_speed()
        self._progress.reset()
        if self._waiting_since is not None and now - self._waiting_since > _PATIENCE:
            return self._start_recovery(now, pose)
        return self._motion(STOP, detail="blocked")

    # --- trouble ----------------------------------------------------------------------------------------------------

    def _blocked_ahead(self, pose: Pose2) -> NavigationError | None:
        """What stands where the body will be before it could stop, on a way that may not be left."""
        reach = _STRAIGHT_LOOK + self.follower.limits.vx_max**2 / (2 * _BRAKING)
        room, x, y = self.follower.narrowest(self.around, reach)
        if room >= _CONTACT:
            return None
        assert self.goal is not None
        return PathBlocked(
            f"something stands on the straight way to ({self.goal.x:.2f}, {self.goal.y:.2f}), at ({x:.2f}, {y:.2f}),"
            " and it was asked not to walk round obstacles"
        )

    def _start_recovery(self, now: float, pose: Pose2) -> Motion:
        if self._straight:
            return self._fail(self._blocked_ahead(pose))
        self._held_since = None
        self._progress.reset()
        self.follower.halt_speed()
        self._recoveries += 1
        name = self._recovery.begin(now) if self._recoveries <= _MOST_RECOVERIES else None
        if name is None:
            return self._fail()
        self.state, self._recovered_at = State.RECOVERING, pose
        if name is Manoeuvre.CLEAR:
            self.around.forget()
        return self._motion(STOP, detail=name)

    def _recover(self, now: float, pose: Pose2) -> Motion:
        detail = self._recovery.current or ""
        order = self._recovery.command(now)
        if order is not None:
            command = self.follower.limits.clip(order[0], 0.0, order[1])
            if self.follower.is_clear(command, pose, self.around):
                return self._motion(command, detail=detail)
            self._recovery.give_up()
        self.state, self._planned_changes = State.FOLLOWING, -1
        if not self._replan(now, pose):
            return self._start_recovery(now, pose)
        return self._motion(STOP, detail=detail)

    def _fail(self, failure: NavigationError | None = None) -> Motion:
        tried = self._tried()
        assert self.goal is not None
        where = f"the goal ({self.goal.x:.2f}, {self.goal.y:.2f})"
        if failure is not None:
            self.failure = failure
        elif self._obstruction is not None:
            self.failure = PathBlocked(f"the way to {where} is closed ({self._obstruction}); tried: {tried}")
        else:
            self.failure = NoProgress(f"no progress toward {where} although a path exists; tried: {tried}")
        self.state = State.FAILED
        self.follower.halt()
        return self._motion(STOP)

    def _tried(self) -> str:
        """What was done before giving up, in words."""
        if self._straight:
            return "nothing, as it was asked to go straight"
        if self._recoveries > _MOST_RECOVERIES:
            return f"{_MOST_RECOVERIES} recoveries in all"
        return ", ".join(self._recovery.tried)

    # --- answers ----------------------------------------------------------------------------------------------------

    def _motion(self, command: Command, step: Step | None = None, detail: str = "") -> Motion:
        remaining = step.remaining if step is not None else self._remaining
        self._remaining = remaining
        pace = 0.75 * self.follower.limits.vx_max
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
