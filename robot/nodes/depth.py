"""The depth cameras' driver: what is around the robot's feet, as points, ten times a second."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from actors import Node, every, publishes
from actors.interfaces.sensor_msgs.msg import PointCloud2
from actors.interfaces.std_msgs.msg import Header
from robot.contracts import DEPTH_POINTS
from robot.geometry.vectors import rotation_of
from robot.hardware.depth import PATTERNS
from robot.nodes.point_clouds import pack_points
from robot.sim.depth import LATENCY, DepthNoise, look, seen

if TYPE_CHECKING:
    from robot.hardware.body import Body

__all__ = ["DepthCameras"]


class DepthCameras(Node):
    """Publishes depth/points, 10 Hz, while somebody listens: noisy, 50 ms late, with gaps, and now and then not at all.

    The points are in `base_link`: the cameras are fixed to the trunk. Their number and order are always the same, that of
    `robot.hardware.depth`; a pixel without depth is NaN.
    """

    points = publishes(DEPTH_POINTS)

    def __init__(self, body: Body) -> None:
        self._body = body

    async def on_start(self) -> None:
        self._noise = DepthNoise(np.random.default_rng(self.rng.getrandbits(64)))
        self._taken = 0

    @every(hz=10)
    def look(self) -> None:
        """Take a picture; it is delivered `LATENCY` later."""
        picture = self._picture() if self.points.subscription_count else None
        if picture is not None:
            self.spawn(self._deliver(picture), name="deliver")

    async def _deliver(self, picture: PointCloud2) -> None:
        await self.clock.sleep(LATENCY)
        self.points(picture)

    def _picture(self) -> PointCloud2 | None:
        now = self.clock.now()
        self._body.advance(now)
        truth, scene = self._body.truth(), self._body.scene
        pattern = self._taken % PATTERNS
        self._taken += 1
        rotation = rotation_of(truth.quaternion)
        exact = look(self._body.obstacles(), scene.pits, truth.position, rotation, pattern, scene.terrain)
        depths = self._noise.apply(exact)
        if depths is None:
            return None
        return pack_points(Header(stamp=self.clock.stamp(now), frame_id="base_link"), seen(depths, pattern))
