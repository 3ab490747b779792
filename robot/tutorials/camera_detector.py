"""Camera, detector, controller: each does one thing, and they meet on topics.

camera -> /camera/image -> detector -> /detections -> controller -> /cmd_vel
"""

from __future__ import annotations

from math import pi, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from actors import Node, Supervisor, Topic, every, parameter, publishes, qos
from actors.interfaces.geometry_msgs.msg import Twist, Vector3
from actors.interfaces.sensor_msgs.msg import Image
from actors.interfaces.std_msgs.msg import Header
from robot.interfaces.robactor_msgs.msg import Detection
from robot.tutorials.program import main, system

IMAGE = Topic(Image, "/camera/image", qos.SENSOR_DATA)
DETECTIONS = Topic(Detection, "/detections", 10)
CMD_VEL = Topic(Twist, "/cmd_vel", 10)

WIDTH, HEIGHT = 320, 240
BACKGROUND = (90, 110, 90)
RED = (220, 30, 30)
TURN = 1.0
"""rad/s for something at the image's edge."""

Pixels = NDArray[np.uint8]


class Box(NamedTuple):
    """A rectangle in an image, pixels."""

    x: int
    y: int
    width: int
    height: int


def draw(box: Box) -> Pixels:
    """An image (height, width, 3) with one red box."""
    pixels = np.empty((HEIGHT, WIDTH, 3), dtype=np.uint8)
    pixels[:] = BACKGROUND
    pixels[box.y : box.y + box.height, box.x : box.x + box.width] = RED
    return pixels


def red_box(pixels: Pixels, least: int = 9) -> tuple[Box, int] | None:
    """The box around all that is clearly red in an image (height, width, 3), and how many pixels are; None below `least` of them."""
    red, green, blue = (pixels[:, :, k].astype(np.int16) for k in range(3))
    mask = (red > 120) & (red > 2 * green) & (red > 2 * blue)
    count = int(mask.sum())
    if count < least:
        return None
    columns, rows = np.flatnonzero(mask.any(axis=0)), np.flatnonzero(mask.any(axis=1))
    x, y = int(columns[0]), int(rows[0])
    return Box(x, y, int(columns[-1]) - x + 1, int(rows[-1]) - y + 1), count


class Camera(Node):
    """Sees a red square that goes from side to side: /camera/image at 10 Hz, rgb8.

    Parameters: size of the square.
    """

    image = publishes(IMAGE)
    size = parameter(30, unit="px", ge=1, le=200, read_only=True)

    @every(hz=10)
    def shoot(self) -> None:
        middle = (WIDTH - self.size) / 2
        x = round(middle + middle * sin(2.0 * pi * self.clock.now() / 10.0))
        header = Header(stamp=self.clock.stamp(), frame_id="camera")
        data = draw(Box(x, 100, self.size, self.size)).reshape(-1)
        self.image(Image(header=header, height=HEIGHT, width=WIDTH, encoding="rgb8", step=3 * WIDTH, data=data))


class Detector(Node):
    """Looks for red things in /camera/image and publishes one /detections message for each image that has one."""

    detections = publishes(DETECTIONS)

    async def on_start(self) -> None:
        self.log.info("Detector initialized")

    @IMAGE.on()
    def look(self, image: Image) -> None:
        if image.encoding != "rgb8":
            self.log.warning(f"Cannot read images of encoding {image.encoding!r}, only rgb8")
            return
        found = red_box(image.data.reshape(image.height, image.width, 3))
        if found is not None:
            box, count = found
            self.detections(
                Detection(
                    header=image.header, label="red", x=box.x, y=box.y, width=box.width, height=box.height, pixels=count
                )
            )


class Controller(Node):
    """Turns towards what is detected: takes /detections, publishes /cmd_vel."""

    cmd = publishes(CMD_VEL)

    async def on_start(self) -> None:
        self.log.info("Controller initialized")

    @DETECTIONS.on()
    def turn(self, detection: Detection) -> None:
        aside = (detection.x + detection.width / 2) / (WIDTH / 2) - 1.0  # -1 at the left edge, 1 at the right
        self.cmd(Twist(angular=Vector3(z=-TURN * aside)))


def tree() -> Supervisor:
    """A camera that sees a red square, a detector that finds it, and a controller that turns towards it."""
    return system("camera_detector", Controller, Detector, Camera)


if __name__ == "__main__":
    main(tree)
