"""The depth cameras' driver: what is around the robot's feet, as points, ten times a second."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors import Node, every, publishes
from actors.interfaces.sensor_msgs.msg import PointCloud2
from actors.interfaces.std_msgs.msg import Header
from robot.contracts import DEPTH_POINTS
from robot.nodes.point_clouds import pack_points

if TYPE_CHECKING:
    from robot.hardware.devices import DepthDevice


class DepthCameras(Node):
    """Publishes depth/points, 10 Hz, while somebody listens: noisy, late (50 ms in simulation), with gaps, and now and then not at all.

    The points are in `base_link`: the cameras are fixed to the trunk. Their number and order are always the same, that of
    `robot.hardware.depth`; a pixel without depth is NaN.
    """

    points = publishes(DEPTH_POINTS)

    def __init__(self, cameras: DepthDevice) -> None:
        self._cameras = cameras

    @every(hz=10)
    def look(self) -> None:
        """Take a picture; it is delivered `latency` later."""
        picture = self._picture() if self.points.subscription_count else None
        if picture is not None:
            self.create_task(self._deliver(picture), name="deliver")

    async def _deliver(self, picture: PointCloud2) -> None:
        await self.clock.sleep(self._cameras.latency)
        self.points(picture)

    def _picture(self) -> PointCloud2 | None:
        now = self.clock.now()
        self._cameras.advance(now)
        points = self._cameras.points()
        if points is None:
            return None
        return pack_points(Header(stamp=self.clock.stamp(now), frame_id="base_link"), points)
