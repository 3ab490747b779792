"""The detector: it looks for coloured objects in the camera's pictures while somebody wants to know, and says where they are."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from actors import CallTimeout, Node, background, parameter, publishes
from actors.interfaces.geometry_msgs.msg import Point
from actors.interfaces.sensor_msgs.msg import Image
from actors.interfaces.std_msgs.msg import Header
from robot.contracts import CAMERA_DEPTH, CAMERA_RGB, DETECTIONS
from robot.estimation.detect import Blob, find_blobs
from robot.interfaces.robactor_msgs.msg import Detection

PATIENCE: Final = 1.0
"""Seconds without a picture after which the camera counts as silent."""


class Detector(Node):
    """Publishes camera/detections, one message for each object in a picture, up to `rate` pictures a second.

    It listens to camera/rgb and camera/depth for one picture at a time, and not at all while nobody listens to it: so the camera renders
    no more pictures than are looked at.
    """

    found = publishes(DETECTIONS)
    rate = parameter(5.0, unit="Hz", ge=0.1, le=30.0, description="Pictures that are looked at, a second.")

    @background
    async def look(self) -> None:
        silent = False
        while True:
            begun = self.clock.now()
            if self.found.subscription_count:
                try:
                    color, depth = await self._picture()
                except CallTimeout:
                    if not silent:
                        self.log.warning("the camera is silent: nothing can be detected", seconds=PATIENCE)
                    silent = True
                else:
                    silent = False
                    self._report(color, depth)
            await self.clock.sleep_until(max(begun + 1.0 / self.rate, self.clock.now()))

    async def _picture(self) -> tuple[Image, Image]:
        """Colour and depth of one instant. Raises `CallTimeout`."""
        async with self.subscribe(CAMERA_RGB) as colors, self.subscribe(CAMERA_DEPTH) as depths:
            color, depth = await colors.next(PATIENCE), await depths.next(PATIENCE)
            while color.header.stamp != depth.header.stamp:
                if _later(color, depth):
                    depth = await depths.next(PATIENCE)
                else:
                    color = await colors.next(PATIENCE)
            return color, depth

    def _report(self, color: Image, depth: Image) -> None:
        if (color.encoding, depth.encoding) != ("rgb8", "16UC1"):
            self.log.warning(
                "cannot read these images", color=color.encoding, depth=depth.encoding, wanted="rgb8 and 16UC1"
            )
            return
        if not (_is_whole(color, 3) and _is_whole(depth, 2)):
            self.log.warning("cannot read these images", why="they hold other than height x step bytes")
            return
        for blob in find_blobs(_rows(color, 3), _rows(depth, 2).view("<u2").reshape(depth.height, depth.width)):
            self.found(_message(color.header, blob))


def _later(one: Image, other: Image) -> bool:
    a, b = one.header.stamp, other.header.stamp
    return (a.sec, a.nanosec) > (b.sec, b.nanosec)


def _is_whole(image: Image, size: int) -> bool:
    return len(image.data) == image.height * image.step and image.step >= image.width * size > 0 and image.height > 0


def _rows(image: Image, size: int) -> NDArray[np.uint8]:
    """The pixels, shape (height, width, size), without what a longer step pads the rows with."""
    rows = image.data.reshape(image.height, image.step)[:, : image.width * size]
    return np.ascontiguousarray(rows).reshape(image.height, image.width, size)


def _message(header: Header, blob: Blob) -> Detection:
    x, y, z = blob.position
    return Detection(
        header=header, label=blob.color, x=blob.x, y=blob.y, width=blob.width, height=blob.height, pixels=blob.pixels,
        position=Point(x=x, y=y, z=z),
    )  # fmt: skip
