"""The camera's driver: colour and depth at 30 Hz, points at 10 Hz, photos on request. Topics without subscribers are not rendered."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Final

from actors import Node, Tick, every, parameter, publishes
from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.sensor_msgs.msg import Image
from actors.interfaces.std_msgs.msg import Header
from actors.interfaces.std_srvs.srv import Trigger, Trigger_Request, Trigger_Response
from robot.contracts import CAMERA_DEPTH, CAMERA_INFO, CAMERA_POINTS, CAMERA_RGB, CAPTURE_PHOTO
from robot.hardware.lens import HEIGHT, WIDTH, camera_info
from robot.nodes.point_clouds import pack_points, points_of_depth

if TYPE_CHECKING:
    from robot.hardware.devices import CameraDevice, Frame

RATE: Final = 30.0
FRAME: Final = "camera_link"
POINTS_EVERY: Final = 3
"""Every so many pictures give a cloud of points."""
ENCODING: Final = 0.05
"""Seconds that writing a photo takes, on the virtual clock."""


class Camera(Node):
    """Publishes camera/rgb, camera/depth and camera/camera_info (30 Hz) and camera/points (10 Hz), each only while somebody listens.

    Serves capture_photo: stores what is seen now as PNG in the folder of the parameter photo_directory (empty: a folder of its own in
    the system's place for temporary files) and answers with the path.
    """

    rgb = publishes(CAMERA_RGB)
    depth = publishes(CAMERA_DEPTH)
    info = publishes(CAMERA_INFO)
    points = publishes(CAMERA_POINTS)
    rate = parameter(RATE, unit="Hz", ge=1.0, le=120.0, read_only=True, description="Pictures a second.")
    photo_directory = parameter("", description="Where photos are stored; empty: in the place for temporary files.")

    def __init__(self, camera: CameraDevice) -> None:
        self._camera = camera
        self._clouds = 0
        """Number of clouds due so far, so that a skipped tick does not lose one."""

    @every(hz="rate")
    def shoot(self, tick: Tick) -> None:
        due, self._clouds = tick.k // POINTS_EVERY > self._clouds, tick.k // POINTS_EVERY
        cloud = due and self.points.subscription_count > 0
        if self.info.subscription_count:
            self.info(camera_info(Header(stamp=self.clock.stamp(), frame_id=FRAME)))
        if not (self.rgb.subscription_count or self.depth.subscription_count or cloud):
            return
        frame, stamp = self._look()
        header = Header(stamp=stamp, frame_id=FRAME)
        if self.rgb.subscription_count:
            self.rgb(Image(header=header, height=HEIGHT, width=WIDTH, encoding="rgb8", step=3 * WIDTH, data=frame.rgb))
        if self.depth.subscription_count:
            self.depth(
                Image(header=header, height=HEIGHT, width=WIDTH, encoding="16UC1", step=2 * WIDTH, data=frame.depth)
            )
        if cloud:
            self.points(pack_points(header, points_of_depth(frame.millimetres())))

    @CAPTURE_PHOTO.serve(concurrent=1)
    async def photo(self, request: Trigger_Request) -> Trigger_Response:
        frame, stamp = self._look()
        folder = Path(self.photo_directory) if self.photo_directory else Path(tempfile.gettempdir()) / "robactor-photos"
        path = folder / f"photo_{stamp.sec}_{stamp.nanosec:09d}.png"
        try:
            await self.offload(store, path, frame, takes=ENCODING, thread=True)
        except OSError as error:
            return Trigger.Response(success=False, message=f"the photo was not stored: {error}")
        self.log.info("photo stored", path=str(path))
        return Trigger.Response(success=True, message=str(path))

    def _look(self) -> tuple[Frame, Time]:
        now = self.clock.now()
        self._camera.advance(now)
        return self._camera.look(), self.clock.stamp(now)


def store(path: Path, frame: Frame) -> None:
    """Write the colours of `frame` as PNG. Raises `OSError`."""
    from robot.png import encode

    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(encode(frame.pixels()))
