"""The localizer: odometry between scans, and a correction at each scan by matching it to the map.

Equations: docs/control.md#localization.
"""

from __future__ import annotations

from actors import Node, parameter, publishes
from actors.interfaces.nav_msgs.msg import Odometry
from actors.interfaces.sensor_msgs.msg import LaserScan
from actors.interfaces.std_msgs.msg import String
from actors.interfaces.std_srvs.srv import Trigger, Trigger_Request, Trigger_Response
from robot.contracts import GET_ROBOT_POSE, LOCALIZATION, ODOMETRY, POSE, RELOCALIZE, SCAN
from robot.estimation.fit_watch import BLIND, LOST, TRACKING, FitWatch
from robot.estimation.pose_history import PoseHistory
from robot.estimation.relocalize import CERTAIN, Found, Relocalizer, apart
from robot.estimation.scan_match import ACCEPTED, ScanMatcher
from robot.geometry.messages import from_pose, pose_stamped, seconds
from robot.geometry.planar import ZERO_TWIST, Pose2, Twist2, compose, inverse
from robot.geometry.vectors import Floats
from robot.hardware.beams import MAX_RANGE
from robot.interfaces.tutorials.proposed_interfaces.srv import GetRobotPose, GetRobotPose_Request, GetRobotPose_Response
from robot.planning.grid import Grid

__all__ = ["Localizer"]

LONGEST = 0.1
"""A scan is taken to be at most so much newer than the odometry, s: five messages."""
JUMP = 0.5
"""An odometry step longer than this, m, means that odometry has begun anew."""
FASTEST = 2.0
"""What the robot may have gone meanwhile, along and across together, m/s; more than it can."""
SEARCH = 0.3
"""Seconds that a search of the whole map takes."""
LEAST = 0.5
"""Least score of a place that the robot is taken to."""
SAYINGS = {
    LOST: "scans do not fit the map: looking where on it the robot is",
    BLIND: "the LiDAR sees nothing, where the map has walls",
}


class Localizer(Node):
    """Publishes pose (frame map) at the rate of odom, and serves get_robot_pose. Starts at the pose it is given; knows its last pose after a
    restart.

    While scans do not fit the map there, it looks for them on the whole map, and goes where they fit, if they fit in one place only; that is
    `relocalize` by itself. What the pose is worth is told on localization.

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
        self._odoms = PoseHistory()
        self._watch = FitWatch()
        self._told = TRACKING
        self._newest: tuple[Floats, Pose2] | None = None
        """The latest scan, and where odometry had the robot then."""
        self._relocalizer: Relocalizer | None = None
        self._searching = False

    async def on_start(self) -> None:
        self._matcher = ScanMatcher(self._grid, bias_sd=self.range_bias)

    def resume(self, state: tuple[Pose2, Pose2, float]) -> None:
        """The robot may have walked on meanwhile: while the odometry has gone on, too, what it says counts from the last life's pose."""
        self._here, self._odom, self._stamp = state
        self._offset = compose(self._here, inverse(self._odom))

    @ODOMETRY.on()
    def odometry(self, message: Odometry) -> None:
        odom = from_pose(message.pose.pose)
        passed = max(0.0, seconds(message.header.stamp) - self._stamp) if self._offset is not None else 0.0
        jumped = abs(odom.x - self._odom.x) + abs(odom.y - self._odom.y) > JUMP + FASTEST * passed
        if jumped:
            self._odoms.clear()
        self._odoms.add(seconds(message.header.stamp), odom)
        if self._offset is None or jumped:
            self._offset = compose(self._here, inverse(odom))
        self._odom, self._stamp = odom, seconds(message.header.stamp)
        twist = message.twist.twist
        self._speed = Twist2(twist.linear.x, twist.linear.y, twist.angular.z)
        self._here = compose(self._offset, odom)
        self.checkpoint((self._here, self._odom, self._stamp))
        self.pose(pose_stamped(self._here, message.header.stamp))

    @SCAN.on()
    def scan(self, message: LaserScan) -> None:
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
        self._tell()
        if not self._searching and self._watch.wants_search(stamp):
            self.spawn(self._search_now())

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

    async def _search_now(self) -> None:
        await self._search()

    async def _search(self) -> str | None:
        """Look for the newest scan on the whole map, and go there if it is certain. Returns why not."""
        if self._newest is None or self._offset is None:
            return "there was no scan yet"
        if self._relocalizer is None:
            self._relocalizer = Relocalizer(self._grid)
        (ranges, moved), self._searching = self._newest, True
        try:
            found = await self.offload(self._relocalizer.search, ranges, takes=SEARCH, thread=True)
        finally:
            self._searching = False
        believed = compose(self._offset, moved)
        here = self._relocalizer.score(believed, ranges)
        return self._heed(found, here, moved, believed)

    def _heed(self, found: list[Found], here: float, moved: Pose2, believed: Pose2) -> str | None:
        """Take the place that a search has found, if it is the only one of its kind and better than the one that was believed."""
        now = self._stamp
        best = found[0] if found else None
        if best is not None and not apart(best.pose, believed):
            self._watch.confirmed(now)
            self._watch.searched(now, found=False)
            self._tell()
            return None
        rival = max(here, found[1].score if len(found) > 1 else 0.0)
        if best is None or best.score < LEAST or best.score - rival < CERTAIN:
            self._watch.searched(now, found=False)
            alike = sum(best is not None and best.score - one.score < CERTAIN for one in found)
            return f"the scan fits {alike} places alike" if alike > 1 else "the scan fits no other place"
        self._offset = compose(best.pose, inverse(moved))
        self._here = compose(self._offset, self._odom)
        self.log.warning(
            "found elsewhere on the map", x=round(best.pose.x, 2), y=round(best.pose.y, 2), score=round(best.score, 2)
        )
        self._watch.searched(now, found=True)
        self._tell()
        return None

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
