"""A camera and a subscriber of its images: 28 MB a second, best effort, because only the newest image counts.

The reader's profile must fit: one that asks for reliable delivery would never see an image, and both sides would be told so.
"""

from __future__ import annotations

import numpy as np

from actors import Node, QoS, Supervisor, Topic, every, publishes
from actors.interfaces.sensor_msgs.msg import Image
from actors.interfaces.std_msgs.msg import Header
from actors.qos import Reliability
from robot.tutorials.program import main, system

CAMERA_RGB = Topic(Image, "/camera/rgb", QoS(depth=5, reliability=Reliability.BEST_EFFORT))

WIDTH, HEIGHT = 640, 480
PERIOD = 0.033
"""s: 30.3 images a second."""
BLACK = np.zeros(HEIGHT * WIDTH * 3, dtype=np.uint8)
BLACK.setflags(write=False)  # so that every message can share it


class CameraPublisher(Node):
    """Publishes black images of 640 x 480 on /camera/rgb at 30.3 Hz, rgb8. `frames` counts them."""

    rgb = publishes(CAMERA_RGB)

    async def on_start(self) -> None:
        self.frames = 0

    @every(period=PERIOD)
    def shoot(self) -> None:
        header = Header(stamp=self.clock.stamp(), frame_id="camera_frame")
        self.rgb(Image(header=header, height=HEIGHT, width=WIDTH, encoding="rgb8", step=3 * WIDTH, data=BLACK))
        self.frames += 1


class ImageProcessor(Node):
    """Says what it sees on /camera/rgb. `frames` counts the images."""

    async def on_start(self) -> None:
        self.frames = 0

    @CAMERA_RGB.on()
    def look(self, image: Image) -> None:
        self.frames += 1
        self.log.info(f"Received image: {image.width}x{image.height}, encoding: {image.encoding}")


def tree() -> Supervisor:
    """A camera that publishes 30 images a second, and a node that looks at them."""
    return system("camera_topics", CameraPublisher, ImageProcessor)


if __name__ == "__main__":
    main(tree)
