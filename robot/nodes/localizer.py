"""The localizer: odometry between scans, and a correction at each scan by matching it to the map.

Equations: docs/concepts/control.md#localization.
"""

from __future__ import annotations

from math import inf, isfinite, sqrt

from actors import Node, parameter, publishes
from actors.interfaces.geometry_msgs.msg import PoseWithCovarianceStamped
from actors.interfaces.nav_msgs.msg import Odometry
from actors.interfaces.sensor_msgs.msg import LaserScan
from actors.interfaces.std_msgs.msg import String
from actors.interfaces.std_srvs.srv import Trigger, Trigger_Request, Trigger_Response
from robot.contracts import GET_ROBOT_POSE, INITIAL_POSE, LOCALIZATION, ODOMETRY, POSE, RELOCALIZE, SCAN
from robot.estimation.fit_watch import AMBIGUOUS, BLIND, LOST, TRACKING, FitWatch
from robot.estimation.history import pose_history, started_over
from robot.estimation.hypotheses import PoseHypotheses
from robot.estimation.relocalize import CERTAIN, Found, Near, Relocalizer, apart
from robot.estimation.scan_match import ACCEPTED, ScanMatcher
from robot.geometry.messages import from_pose, is_pose, pose_stamped, seconds
from robot.geometry.planar import ZERO_TWIST, Pose2, Twist2, compose, inverse
from robot.geometry.vectors import Floats
from robot.hardware.beams import MAX_RANGE
from robot.interfaces.tutorials.proposed_interfaces.srv import GetRobotPose, GetRobotPose_Request, GetRobotPose_Response
from robot.planning.grid import Grid

LONGEST = 0.1
"""A scan is taken to be at most so much newer than the odometry, s: five messages."""
SEARCH = 0.3
"""Seconds that a search of the whole map takes."""
LEAST = 0.5
"""Least score of a place that the robot is taken to."""
MOST = 8
"""So many places that are alike are weighed."""
WEIGHED = 50
"""Scans after which a robot that believes to be at one of the places that are alike stays there."""
SIGMAS = 3.0
NEAREST, LEAST_TURN = 0.5, 0.35
"""A pose on /initialpose may be wrong by three standard deviations, and by this (m, rad) whatever those are."""
SAYINGS = {
    LOST: "scans do not fit the map: looking where on it the robot is",
    AMBIGUOUS: "scans fit several places of the map alike: drive it about, or publish its pose on /initialpose",
    BLIND: "the LiDAR sees nothing, where the map has walls",
}


class Localizer(Node):
    """Publishes pose (frame map) at the rate of odom, and serves get_robot_pose. Starts at the pose it is given; knows its last pose after a
    restart.

    While scans do not fit the map there, it looks for them on the whole map, and goes where they fit, if they fit in one place only; that is
    `relocalize` by itself. Places that one scan cannot tell from each other are weighed by the next ones. Who knows better tells it by
    initialpose. The quality of the pose is published on localization.

    Parameters: gain, the share of each scan's correction that is taken at once; range_bias.
    """

    pose = publishes(POSE)
    localization = publishes(LOCALIZATION)
    gain = parameter(0.4, ge=0.0, le=1.0, description="Share of a scan's correction that is taken at once.")
    range_bias = parameter(
        0.0,
        unit="m",
        ge=0.0,
        le=0.1,
        read_only=True,
        description="Standard deviation of a length by which all ranges of the LiDAR are wrong; it is found out.",
    )

    def __init__(self, grid: Grid, start: Pose2) -> None:
        self._grid = grid
        self._here = start
        self._offset: Pose2 | None = None
        self._odom = Pose2(0.0, 0.0)
        self._stamp = 0.0
        self._speed = ZERO_TWIST
        self._odoms = pose_history()
        self._watch = FitWatch()
        self._told = TRACKING
        self._newest: tuple[Floats, Pose2] | None = None
        """The latest scan, and where odometry had the robot then."""
        self._relocalizer: Relocalizer | None = None
        self._searching = False
        self._begun = 0
        """So many times odometry has started over."""
        self._near: Near | None = None
        """Where somebody has said that the robot is, until a search there has ended."""
        self._rivals: PoseHypotheses | None = None

    async def on_start(self) -> None:
        self._matcher = ScanMatcher(self._grid, bias_sd=self.range_bias)

    def resume(self, state: tuple[Pose2, Pose2, float, str]) -> None:
        """The robot may have walked on meanwhile: while the odometry has gone on, too, what it says counts from the last life's pose."""
        self._here, self._odom, self._stamp, self._told = state
        self._offset = compose(self._here, inverse(self._odom))
        self._watch = FitWatch(self._told)

    @ODOMETRY.on()
    def odometry(self, message: Odometry) -> None:
        if not is_pose(message.pose.pose):
            return
        odom = from_pose(message.pose.pose)
        passed = seconds(message.header.stamp) - self._stamp if self._offset is not None else 0.0
        jumped = started_over((self._odom.x, self._odom.y), (odom.x, odom.y), passed)
        if jumped:
            self._start_over(odom)
        self._odoms.add(seconds(message.header.stamp), odom)
        if self._offset is None or jumped:
            self._offset = compose(self._here, inverse(odom))
        self._odom, self._stamp = odom, seconds(message.header.stamp)
        twist = message.twist.twist
        self._speed = Twist2(twist.linear.x, twist.linear.y, twist.angular.z)
        self._here = compose(self._offset, odom)
        self.checkpoint((self._here, self._odom, self._stamp, self._told))
        self.pose(pose_stamped(self._here, message.header.stamp))

    def _start_over(self, odom: Pose2) -> None:
        """Odometry counts from elsewhere: the robot stands where it stood, and so it does at each of the places that are weighed."""
        self._odoms.clear()
        self._begun += 1
        if self._rivals is not None:
            self._rivals.start_over(self._odom, odom)
        if self._newest is not None:
            ranges, moved = self._newest
            self._newest = ranges, compose(odom, compose(inverse(self._odom), moved))

    @SCAN.on()
    async def scan(self, message: LaserScan) -> None:
        """Match the scan to the map, starting from the estimate at the scan's stamp."""
        stamp = seconds(message.header.stamp)
        was = self._odoms.at(stamp)
        if self._offset is None or was is None:
            return
        moved = compose(was, self._speed.over(min(max(stamp - self._stamp, 0.0), LONGEST)))
        prior, ranges = compose(self._offset, moved), message.ranges.astype(float)
        self._newest = ranges, moved
        if not self._matcher.sees(ranges):
            self._watch.nothing(stamp, expected=self._walls_near(prior))
            self._tell()
            return
        fitted, quality = self._matcher.correct(prior, ranges)
        accepted = quality >= ACCEPTED
        self._watch.fit(stamp, quality, accepted=accepted)
        if accepted:
            step = compose(inverse(prior), fitted)
            taken = compose(prior, Pose2(self.gain * step.x, self.gain * step.y, self.gain * step.yaw))
            self._offset = compose(taken, inverse(moved))
        if self._rivals is not None:
            await self._weigh(self._rivals, ranges, moved)
        self._tell()
        if not self._searching and self._wants_search(stamp):
            self.create_task(self._search_now())

    def _wants_search(self, now: float) -> bool:
        """Whether to look now: scans do not fit, or somebody has said where the robot is, or a last life did not know which of several places it is."""
        forgotten = self._watch.state == AMBIGUOUS and self._rivals is None
        return self._near is not None or forgotten or self._watch.wants_search(now)

    def _walls_near(self, pose: Pose2) -> bool:
        """Whether the map has walls that beams from `pose` must meet."""
        cell = self._grid.cell(pose.x, pose.y)
        return cell is not None and bool(self._grid.clearance[cell] < MAX_RANGE / 2)

    def _tell(self) -> None:
        """Publish and say what has changed."""
        if self._watch.state == self._told:
            return
        self._told = self._watch.state
        self.localization(String(data=self._told))
        if self._told == TRACKING:
            self.log.info("scans fit the map")
        else:
            self.log.warning(SAYINGS[self._told], x=round(self._here.x, 2), y=round(self._here.y, 2))

    @INITIAL_POSE.on()
    def initial_pose(self, message: PoseWithCovarianceStamped) -> None:
        """Believe it at once, and look for the newest scan about there."""
        pose, frame = from_pose(message.pose.pose), message.header.frame_id
        if frame not in ("map", "") or not all(map(isfinite, (pose.x, pose.y, pose.yaw))):
            self.log.warning("an initial pose that is none: give finite numbers in frame 'map'", frame=frame)
            return
        variance = message.pose.covariance
        place, turn = (sqrt(v) if 0.0 < v < inf else 0.0 for v in (max(variance[0], variance[7]), variance[35]))
        self._near = Near(pose, max(NEAREST, SIGMAS * float(place)), max(LEAST_TURN, SIGMAS * float(turn)))
        self._rivals, self._here = None, pose
        if self._offset is not None:
            self._offset = compose(pose, inverse(self._odom))
        self.log.info("initial pose set", x=round(pose.x, 2), y=round(pose.y, 2), yaw=round(pose.yaw, 2))
        if not self._searching:
            self.create_task(self._search_now())

    async def _search_now(self) -> None:
        await self._search()

    async def _search(self) -> str | None:
        """Look for the newest scan, on the whole map or about where somebody has said, and go there if it is certain. Returns why not."""
        if self._newest is None or self._offset is None:
            return "there was no scan yet"
        if self._searching:
            return "a search is under way: ask again when it has ended"
        if self._relocalizer is None:
            self._relocalizer = Relocalizer(self._grid)
        self._searching = True
        try:
            while True:
                (ranges, moved), near, begun = self._newest, self._near, self._begun
                found = await self.offload(self._relocalizer.search, ranges, near, takes=SEARCH, thread=True)
                if near is not self._near or begun != self._begun:
                    continue  # somebody has said meanwhile that the robot is elsewhere, or odometry has started over
                if near is None or (found and found[0].score >= LEAST):
                    break
                self._near = None  # it is not where somebody has said
        finally:
            self._searching, self._near = False, None
        believed = compose(self._offset, moved)
        here = self._relocalizer.score(believed, ranges) if near is None else 0.0
        return self._heed(self._relocalizer, found, here, moved, believed)

    def _heed(
        self, relocalizer: Relocalizer, found: list[Found], here: float, moved: Pose2, believed: Pose2
    ) -> str | None:
        """Take the place that a search has found, if it is the only one of its kind and better than the one that was believed."""
        best = found[0] if found else None
        if best is not None and not apart(best.pose, believed):
            self._go(compose(believed, inverse(moved)), moved)
            return None
        if best is None or best.score < LEAST:
            if self._rivals is None and self._watch.state == AMBIGUOUS:
                self._watch.given_up()
            self._watch.searched(self._stamp, found=False)
            return "the scan fits no other place"
        places = [one.pose for one in found[:MOST] if best.score - one.score < CERTAIN]
        if best.score - here < CERTAIN:
            places.append(believed)
            self._watch.searched(self._stamp, found=False)
        elif len(places) > 1:
            self._watch.ambiguous(self._stamp)
        else:
            self._go(compose(best.pose, inverse(moved)), moved)
            return None
        self._rivals = PoseHypotheses(relocalizer, places, moved)
        self._tell()
        return f"the scan fits {len(places)} places alike"

    async def _weigh(self, rivals: PoseHypotheses, ranges: Floats, moved: Pose2) -> None:
        """Go where the robot is as soon as scans tell it. Other tasks of the event loop have a turn after each place."""
        for _ in rivals.weighing(ranges, moved):
            await self.clock.sleep(0.0)
        if self._rivals is not rivals:
            return  # a search has ended meanwhile
        offset = rivals.offset()
        if offset is not None:
            self._go(offset, moved)
        elif rivals.best < LEAST:
            self._rivals = None
            self._watch.given_up()
        elif self._watch.state == TRACKING and rivals.scans >= WEIGHED:
            self._rivals = None

    def _go(self, offset: Pose2, moved: Pose2) -> None:
        """The robot is where `offset` from odom to map says; it may have been believed to be there."""
        assert self._offset is not None
        self._rivals = None
        there = compose(offset, moved)
        if not apart(there, compose(self._offset, moved)):
            self._watch.confirmed(self._stamp)
            self._watch.searched(self._stamp, found=False)
        else:
            self._offset = offset
            self._here = compose(offset, self._odom)
            self.log.warning("found elsewhere on the map", x=round(there.x, 2), y=round(there.y, 2))
            self._watch.searched(self._stamp, found=True)
        self._tell()

    @RELOCALIZE.serve()
    async def relocalize(self, request: Trigger_Request) -> Trigger_Response:
        """Look on the whole map; success says that the robot knows where it is."""
        why = await self._search()
        where = f"at ({self._here.x:.2f}, {self._here.y:.2f}), heading {self._here.yaw:.2f} rad"
        return Trigger.Response(success=why is None, message=where if why is None else why)

    @GET_ROBOT_POSE.serve()
    async def get_robot_pose(self, request: GetRobotPose_Request) -> GetRobotPose_Response:
        """Answer with the latest pose; success is False before the first odometry."""
        if self._offset is None:
            return GetRobotPose.Response(success=False, message="no odometry yet: the pose is not known")
        words = f"at ({self._here.x:.2f}, {self._here.y:.2f}), heading {self._here.yaw:.2f} rad"
        return GetRobotPose.Response(success=True, pose=pose_stamped(self._here, self.clock.stamp()), message=words)
