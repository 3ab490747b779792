"""Nodes for thin links: `tests.stories.far` runs them.

Times are those of the monotonic clock, which all network namespaces of one kernel share.
"""

from __future__ import annotations

import time

import numpy as np

from actors import Node, QoS, Topic, every, parameter, publishes, qos
from actors.interfaces.geometry_msgs.msg import Twist, Vector3
from actors.interfaces.sensor_msgs.msg import Image

WIDTH, HEIGHT = 640, 480
IMAGES = Topic(Image, "camera/image", qos.SENSOR_DATA)
CMD_VEL = Topic(Twist, "cmd_vel", QoS(depth=10))


def picture(noisy: bool) -> bytes:
    """640 x 480 pixels of 24 bits: a scene of plain areas, or noise."""
    if noisy:
        return np.random.default_rng(1).integers(0, 256, 3 * WIDTH * HEIGHT, dtype=np.uint8).tobytes()
    rows, columns = np.mgrid[0:HEIGHT, 0:WIDTH]
    image = np.stack((rows // 40 * 20, columns // 64 * 20, (rows // 60 + columns // 80) * 9), axis=2)
    return image.astype(np.uint8).tobytes()


class Camera(Node):
    """Publishes the same image all the time."""

    out = publishes(IMAGES)
    noisy = parameter(False, description="Whether it sees noise.")
    rate = parameter(10.0, description="Images a second.", read_only=True)

    async def on_start(self) -> None:
        data = picture(self.noisy)
        self._image = Image(height=HEIGHT, width=WIDTH, encoding="rgb8", step=3 * WIDTH, data=data)

    @every(hz="rate")
    def shoot(self) -> None:
        self.out(self._image)


class Driver(Node):
    """Commands a speed 50 times a second, and says when."""

    out = publishes(CMD_VEL)

    @every(hz=50)
    def command(self) -> None:
        self.out(Twist(linear=Vector3(x=time.monotonic())))


class Base(Node):
    """Takes commands, and says each second how many came, and how late the latest of them was at most, in milliseconds."""

    def __init__(self) -> None:
        self.late: list[float] = []

    @CMD_VEL.on()
    def command(self, message: Twist) -> None:
        self.late.append(1e3 * (time.monotonic() - message.linear.x))

    @every(hz=1)
    def tell(self) -> None:
        late, self.late = sorted(self.late), []
        if late:
            print(f"commands {len(late)} median {late[len(late) // 2]:.1f} most {late[-1]:.1f}", flush=True)


class Viewer(Node):
    """Takes images, and says each second how many came."""

    def __init__(self) -> None:
        self.seen = 0

    @IMAGES.on()
    def image(self, message: Image) -> None:
        assert len(message.data) == 3 * WIDTH * HEIGHT
        self.seen += 1

    @every(hz=1)
    def tell(self) -> None:
        print(f"images {self.seen}", flush=True)
        self.seen = 0
