"""The part of the navigation node that walks to goals, one at a time."""

from __future__ import annotations

from collections.abc import AsyncGenerator, Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from math import hypot, inf

from actors import ActorError, Node
from actors.interfaces.geometry_msgs.msg import Twist, Vector3
from actors.interfaces.sensor_msgs.msg import LaserScan
from actors.interfaces.std_srvs.srv import Trigger
from robot.contracts import STAND, WALK
from robot.estimation.elevation import Relief
from robot.estimation.history import History, pose_history
from robot.geometry.messages import seconds
from robot.geometry.planar import ZERO_TWIST, Pose2, Twist2, compose
from robot.geometry.vectors import Floats
from robot.model.footprint import Footprint
from robot.model.modes import ON_ITS_FEET, Mode
from robot.model.robot import RobotModel
from robot.navigation.limits import Limits, Tolerance
from robot.navigation.motion import Motion, State
from robot.navigation.navigator import Navigator
from robot.planning import path as paths
from robot.planning.energy import EnergyGuard
from robot.planning.errors import ErrorCode, GoalBlocked, NavigationError, NotReached
from robot.planning.grid import Grid
from robot.planning.planner import Planner
from robot.scenes.dock import BEFORE

ENDED = (State.ARRIVED, State.CANCELED, State.FAILED)
RISING_TIMEOUT = 10.0
"""Seconds within which the robot must be walking after it has been asked to."""
HALTED = 3.0
"""Seconds after which a goal ends when the robot does not walk any more: sat down by somebody, or without its sensors."""
TYPICAL_SPEED = 0.7
"""The energy of a walk is computed for this speed at most, m/s."""
BLIND_AFTER = 0.5
"""Seconds without a scan, five of them, after which a walk goes on slowly."""
STANDSTILL = Twist()


@dataclass(slots=True)
class Heard:
    """The latest inputs of a walk. The node that subscribes to them writes them here."""

    pose: Pose2 | None = None
    velocity: Twist2 = ZERO_TWIST
    scan: LaserScan | None = None
    """The latest scan, until a step has used it."""
    relief: Relief | None = None
    """What the elevation map said last, until a step has used it."""
    gait: str = ""
    gait_goal: str = ""
    critical: str = ""
    """Why the battery is critical; empty when it is not."""
    lost: bool = False
    """Whether the localizer says that its pose is wrong,"""
    blind: bool = False
    """and whether, that the LiDAR sees nothing where there are walls."""
    stopped: str = ""
    """The reasons of a safety stop; empty when there is none."""
    poses: History[Pose2] = field(default_factory=pose_history)
    """Those of the last seconds, for scans that were taken a while ago."""

    def take_relief(self) -> Relief | None:
        """The relief, if no step has used it."""
        relief, self.relief = self.relief, None
        return relief

    def take_scan(self) -> tuple[Floats | None, Pose2 | None]:
        """The ranges (m) of a scan that no step has used, and the pose at its stamp; (None, None) without a scan or where the pose is unknown."""
        scan, self.scan = self.scan, None
        taken_at = self.poses.at(seconds(scan.header.stamp)) if scan is not None else None
        if scan is None or taken_at is None:
            return None, None
        return scan.ranges.astype(float), taken_at


class GoalWalk:
    """Walks to one goal at a time; a new one takes over within one step, and the robot never stops between the two.

    A part of the node that hears and steers: it asks that node for the gait, and hands it commands and plans to publish. With a `dock`, no
    walk is made or gone on with that leaves no energy for the way there.
    """

    def __init__(
        self,
        node: Node,
        heard: Heard,
        grid: Grid,
        dock: Pose2 | None,
        model: RobotModel,
        *,
        cmd: Callable[[Twist], object],
        plan: Callable[[paths.Path | None], object],
    ) -> None:
        self._node = node
        self._heard = heard
        self._dock = dock
        self._cmd = cmd
        self._plan = plan
        footprint = Footprint.of(model)
        self.planner = Planner(grid, footprint)
        self.energy = EnergyGuard(TYPICAL_SPEED, model)
        self.navigator = Navigator(grid, footprint=footprint)
        self._motion: Motion | None = None
        self._owner: object | None = None
        self._shown: paths.Path | None = None
        self._limits, self._blind_speed = Limits(), inf
        self._seen = -inf
        self._blind = False

    # -- control -----------------------------------------------------------------------------------------------------

    def steer(self) -> None:
        """Step the navigator and publish its command, while a walk is under way."""
        if self._owner is None or self._heard.pose is None or self._heard.gait != Mode.WALK:
            return
        if self._heard.lost:
            self._cmd(STANDSTILL)
            return
        now = self._node.clock.now()
        scan, scanned_at = self._heard.take_scan()
        self._heed(now, seen=scan is not None and not self._heard.blind)
        motion = self.navigator.step(
            now, self._heard.pose, self._heard.velocity, scan, scanned_at, self._heard.take_relief()
        )
        self._motion = motion
        self._cmd(Twist(linear=Vector3(x=motion.vx, y=motion.vy), angular=Vector3(z=motion.wz)))
        if self.navigator.path is not self._shown:
            self._shown = self.navigator.path
            if self._shown is not None:
                self._plan(self._shown)

    def look(self) -> None:
        """Take in what is seen while no walk is under way, for subscribers of the costmaps. Call it a few times a second."""
        if self._owner is not None or self._heard.gait not in ON_ITS_FEET:
            return
        scan, scanned_at = self._heard.take_scan()
        if scan is not None and scanned_at is not None:
            self.navigator.around.integrate_scan(self._node.clock.now(), scanned_at, scan)

    def _heed(self, now: float, *, seen: bool) -> None:
        """Slow down while no scans come, or such as see nothing: what is not on the map would be walked into."""
        if seen:
            self._seen = now
        blind = now - self._seen > BLIND_AFTER
        if blind == self._blind:
            return
        self._blind = blind
        self.navigator.set_limits(self._allowed)
        if blind:
            self._node.log.warning("no LiDAR: walking slowly", speed=min(self._blind_speed, self._limits.vx_max))
        else:
            self._node.log.info("LiDAR again: walking as before")

    @property
    def path(self) -> paths.Path | None:
        """The path that is followed."""
        return self.navigator.path

    @property
    def recoveries(self) -> int:
        """How often this walk has cleared its marks, backed up or turned to find a way."""
        return self.navigator.recoveries

    @property
    def _allowed(self) -> Limits:
        slow = min(self._limits.vx_max, self._blind_speed)
        return replace(self._limits, vx_max=slow) if self._blind else self._limits

    def retune(self, limits: Limits, tolerance: Tolerance, patience: float, blind_speed: float) -> None:
        """Walk within these limits from the next step on, at `blind_speed` (m/s) without a LiDAR, arrive by these tolerances, and be patient
        for so long, s.
        """
        self.energy.set_speed(min(limits.vx_max, TYPICAL_SPEED))
        self._limits, self._blind_speed = limits, blind_speed
        self.navigator.retune(self._allowed, tolerance, patience)

    async def walk(self, goal: Pose2, *, straight: bool = False) -> AsyncGenerator[Motion, None]:
        """Walk to `goal`, yielding what the navigator says ten times a second, the final word last.

        `straight`: along the line, and no farther than to the first obstacle on it. Ends early when another walk takes over.
        Leaving it stops the robot, and half a second later it stands.
        """
        self._owner = me = object()
        self.navigator.cancel()
        self._motion = None
        try:
            await self._ensure_walking()
            self._set_goal(goal, straight=straight)
            home, walked, lost = self._home(goal), self._node.clock.now(), False
            while self._owner is me:
                await self._node.clock.sleep(0.1)
                if lost and not self._heard.lost:  # what was marked, and the way, were of another place
                    self.navigator.around.forget()
                    self._set_goal(goal, straight=straight)
                lost = self._heard.lost
                if self._heard.stopped:
                    raise NotReached(ErrorCode.SAFETY_STOP, f"safety stop: {self._heard.stopped}")
                if self._heard.gait == Mode.WALK:
                    walked = self._node.clock.now()
                elif self._node.clock.now() - walked > HALTED:
                    raise NotReached(
                        ErrorCode.NOT_WALKING, f"the robot has stopped walking: its gait is {self._heard.gait!r}"
                    )
                motion = self._motion
                if motion is None or self._owner is not me:
                    continue
                if objection := self.energy.objection(motion.distance_remaining, home):
                    raise NotReached(ErrorCode.LOW_BATTERY, objection)
                yield motion
                if motion.state in ENDED:
                    return
        finally:
            if self._owner is me:
                self._owner = None
                self.navigator.cancel()
                self._cmd(STANDSTILL)
                if self._shown is not None:
                    self._shown = None
                    self._plan(None)
                self._node.create_task(self._rest())

    def _set_goal(self, goal: Pose2, *, straight: bool) -> None:
        """Raises `NotReached` where no way leads there from here: what was checked was the way from where the robot stood."""
        try:
            self.navigator.set_goal(goal, start=self._heard.pose, straight=straight)
        except NavigationError as error:
            raise NotReached(error.code, f"{error.name}: {error}") from None

    async def _ensure_walking(self) -> None:
        """Ask the gait to walk and wait until it does, at most 10 s. Raises `NotReached`."""
        reply = await self._node.call(WALK, Trigger.Request())
        if not reply.success:
            raise NotReached(ErrorCode.NOT_WALKING, reply.message)
        deadline = self._node.clock.now() + RISING_TIMEOUT
        while self._heard.gait != Mode.WALK:
            if self._node.clock.now() > deadline:
                raise NotReached(
                    ErrorCode.NOT_WALKING,
                    f"the robot is not walking {RISING_TIMEOUT:g} s after it was asked to: its gait is {self._heard.gait!r}",
                )
            await self._node.clock.sleep(0.1)

    async def _rest(self) -> None:
        """Half a second after a goal, ask the gait to stand unless another walk has begun: standing takes a third of the power of stepping in place."""
        await self._node.clock.sleep(0.5)
        if self._owner is None and self._heard.gait_goal == Mode.WALK:
            with suppress(ActorError):  # a gait that is away will not walk either
                await self._node.call(STAND, Trigger.Request())

    # -- checks of a goal -----------------------------------------------------------------------------------

    def check(self, goals: Sequence[Pose2], *, straight: bool = False) -> None:
        """Check goals, to be walked to in turn, before anything moves. Raises `NotReached` when one of them cannot be reached."""
        if self._heard.stopped:
            raise NotReached(ErrorCode.SAFETY_STOP, f"safety stop: {self._heard.stopped}")
        if self._heard.critical:
            raise NotReached(ErrorCode.LOW_BATTERY, f"{self._heard.critical}: not starting to walk")
        if self._heard.pose is None:
            raise NotReached(
                ErrorCode.TF_ERROR, "the robot does not know where it is yet: try again when /pose is published"
            )
        start, ahead = self._heard.pose, 0.0
        for goal in goals:
            ahead += self._length(start, goal, straight=straight)
            start = goal
        if objection := self.energy.objection(ahead, self._home(start)):
            raise NotReached(ErrorCode.LOW_BATTERY, objection)

    def _length(self, start: Pose2, goal: Pose2, *, straight: bool) -> float:
        """Of the way, m. Raises `NotReached` if the map has none."""
        try:
            if straight:
                self.planner.check_on_map(goal)
                return hypot(goal.x - start.x, goal.y - start.y)
            self.planner.check_goal(goal)
            return self.planner.plan(start, goal).length
        except GoalBlocked as error:
            free = self.planner.nearest_free(start, goal)
            nearest = (
                f"; the nearest place where it fits is ({free.x:.2f}, {free.y:.2f}, yaw {free.yaw:.2f})" if free else ""
            )
            raise NotReached(error.code, f"{error.name}: {error}{nearest}") from None
        except NavigationError as error:
            raise NotReached(error.code, f"{error.name}: {error}") from None

    def _home(self, goal: Pose2) -> float:
        """Length of the way from `goal` to the front of the dock, m; 0 without a dock."""
        if self._dock is None:
            return 0.0
        before = compose(self._dock, BEFORE)
        try:
            return self.planner.plan(goal, before).length
        except NavigationError:
            return hypot(goal.x - before.x, goal.y - before.y)


def check_arrived(motion: Motion | None) -> None:
    """Raises `NotReached` unless a walk that ended with `motion` reached its goal."""
    if motion is None or motion.state not in ENDED:
        raise NotReached(ErrorCode.PREEMPTED, "preempted by a newer goal")
    if motion.failure is not None:
        raise NotReached(motion.failure.code, f"{motion.failure.name}: {motion.failure}")
    if motion.state is not State.ARRIVED:
        raise NotReached(ErrorCode.PREEMPTED, "Movement canceled")
