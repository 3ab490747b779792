"""The localizer: odometry between scans, and a correction at each scan by matching it to the map.

Equations: docs/control.md#localization.
"""

from __future__ import annotations

from actors import Node, parameter, publishes
from actors.interfaces.nav_msgs.msg import Odometry
from actors.interfaces.sensor_msgs.msg import LaserScan
from robot.contracts import GET_ROBOT_POSE, ODOMETRY, POSE, SCAN
from robot.estimation.pose_history import PoseHistory
from robot.estimation.scan_match import ACCEPTED, ScanMatcher
from robot.geometry.messages import from_pose, pose_stamped, seconds
from robot.geometry.planar import ZERO_TWIST, Pose2, Twist2, compose, inverse
from robot.interfaces.tutorials.proposed_interfaces.srv import GetRobotPose, GetRobotPose_Request, GetRobotPose_Response
from robot.planning.grid import Grid

__all__ = ["Localizer"]

LONGEST = 0.1
"""A scan is taken to be at most so much newer than the odometry, s: five messages."""
JUMP = 0.5
"""An odometry step longer than this, m, means that odometry has begun anew."""
FASTEST = 2.0
"""What the robot may have gone meanwhile, along and across together, m/s; more than it can."""


class Localizer(Node):
    """Publishes pose (frame map) at the rate of odom, and serves get_robot_pose. Starts at the pose it is given; knows its last pose after a
    restart.

    Parameters: gain, the share of each scan's correction that is taken at once; range_bias.
    """

    pose = publishes(POSE)
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
        self._refused = 0

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
        prior = compose(self._offset, moved)
        fitted, quality = self._matcher.correct(prior, message.ranges.astype(float))
        if quality < ACCEPTED:
            self._refused += 1
            if self._refused in (10, 100, 1000):
                self.log.warning("scans do not fit the map", refused=self._refused, quality=round(quality, 2))
            return
        self._refused = 0
        step = compose(inverse(prior), fitted)
        taken = compose(prior, Pose2(self.gain * step.x, self.gain * step.y, self.gain * step.yaw))
        self._offset = compose(taken, inverse(moved))

    @GET_ROBOT_POSE.serve()
    async def get_robot_pose(self, request: GetRobotPose_Request) -> GetRobotPose_Response:
        """Answer with the latest pose; success is False before the first odometry."""
        if self._offset is None:
            return GetRobotPose.Response(success=False, message="no odometry yet: the pose is not known")
        words = f"at ({self._here.x:.2f}, {self._here.y:.2f}), heading {self._here.yaw:.2f} rad"
        return GetRobotPose.Response(success=True, pose=pose_stamped(self._here, self.clock.stamp()), message=words)
