"""Two sensors on one topic: a reader gets the messages of both, and tells them apart by their frame."""

from __future__ import annotations

from collections import Counter

import numpy as np

from actors import Node, Supervisor, Topic, every, publishes
from actors.interfaces.sensor_msgs.msg import Image
from actors.interfaces.std_msgs.msg import Header
from robot.tutorials.program import main, system

FUSED = Topic(Image, "/sensor/fused", 10)

PIXELS = np.zeros(64 * 48 * 3, dtype=np.uint8)
RANGES = np.frombuffer(np.full(360, 5.0, dtype="<f4").tobytes(), dtype=np.uint8)
"""One row of 360 distances, m."""
PIXELS.setflags(write=False)  # so that every message can share it


class FusedCamera(Node):
    """Publishes a colour image on /sensor/fused at 10 Hz, in frame `camera_frame`."""

    image = publishes(FUSED)

    @every(hz=10)
    def publish(self) -> None:
        header = Header(stamp=self.clock.stamp(), frame_id="camera_frame")
        self.image(Image(header=header, height=48, width=64, encoding="rgb8", step=64 * 3, data=PIXELS))


class FusedLidar(Node):
    """Publishes a row of distances as an image on /sensor/fused at 10 Hz, in frame `lidar_frame`."""

    image = publishes(FUSED)

    @every(hz=10)
    def publish(self) -> None:
        header = Header(stamp=self.clock.stamp(), frame_id="lidar_frame")
        self.image(Image(header=header, height=1, width=360, encoding="32FC1", step=360 * 4, data=RANGES))


class SensorFusion(Node):
    """Takes /sensor/fused and counts what came from which sensor."""

    async def on_start(self) -> None:
        self.seen = Counter[str]()
        self.log.info("Sensor Fusion initialized")

    @FUSED.on()
    def fuse(self, image: Image) -> None:
        self.seen[image.header.frame_id] += 1
        self.log.debug(f"From {image.header.frame_id}: {image.width}x{image.height}, encoding: {image.encoding}")


def tree() -> Supervisor:
    """A camera and a LiDAR on one topic, and a node that tells them apart."""
    return system("sensor_fusion", SensorFusion, FusedCamera, FusedLidar)


if __name__ == "__main__":
    main(tree)
