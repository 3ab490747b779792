"""Compressed images beside the plain ones, for links that cannot carry those: as image_transport names and writes them."""

from __future__ import annotations

from functools import partial
from importlib.util import find_spec
from typing import Final

import numpy as np

from actors import Node, Topic, background, parameter, qos
from actors.images import compress
from actors.interfaces.sensor_msgs.msg import CompressedImage, Image
from robot.nodes.on_demand import while_heard
from robot.png import encode

CHANNELS: Final = {"rgb8": (0, 1, 2), "bgr8": (2, 1, 0), "mono8": (0, 0, 0)}
"""For each encoding, which of its channels are red, green and blue."""
ENCODING: Final = 0.05
"""Seconds that an image takes, on the virtual clock."""
QUALITY: Final = 80
"""Of JPEG: what differs from the image then is hard to see."""


def compressed_topic(images: Topic[Image]) -> Topic[CompressedImage]:
    """The topic of the compressed images of a topic: its name followed by ``/compressed``."""
    return Topic(CompressedImage, f"{images.name}/compressed", qos.SENSOR_DATA)


def compressed(image: Image) -> CompressedImage:
    """The image as PNG, which loses nothing. Raises ValueError for an encoding other than rgb8, bgr8 and mono8, or too little data."""
    channels = CHANNELS.get(image.encoding)
    if channels is None:
        raise ValueError(f"images of {image.encoding!r} are not compressed, only those of {', '.join(CHANNELS)}")
    depth = 1 if image.encoding == "mono8" else 3
    rows = np.asarray(image.data, dtype=np.uint8).reshape(image.height, image.step)[:, : depth * image.width]
    pixels = rows.reshape(image.height, image.width, depth)[:, :, list(channels)]
    kind = (
        "mono8" if depth == 1 else "bgr8"
    )  # what a reader of image_transport makes of the file, before it restores the encoding
    data = np.frombuffer(encode(np.ascontiguousarray(pixels)), dtype=np.uint8)
    return CompressedImage(header=image.header, format=f"{image.encoding}; png compressed {kind}", data=data)


class ImageCompressor(Node):
    """Publishes the images of a topic once more, compressed, on the topic ``<name>/compressed``, at most `rate` a second.

    It listens to the images only while somebody listens to it, takes the newest, and leaves out those that come while it works. It works
    in a thread. An image that cannot be compressed is left out, and the first one of each encoding is logged. JPEG is written by Pillow; where
    that is missing, images are PNG, which is ten times as large and loses nothing.
    """

    rate = parameter(10.0, unit="Hz", ge=0.1, le=120.0, description="Pictures a second, at most.")
    format = parameter(
        "jpeg", choices=("jpeg", "png"), description="jpeg, if Pillow is installed, or png, which loses nothing."
    )
    jpeg_quality = parameter(QUALITY, ge=1, le=95, description="What jpeg keeps: more is better, and larger.")

    def __init__(self, images: Topic[Image]) -> None:
        self._images = images

    @background
    async def work(self) -> None:
        out = self.publisher(compressed_topic(self._images))
        refused, pillow, told = set[str](), find_spec("PIL") is not None, False
        newest = qos.SENSOR_DATA.replace(depth=1)
        async for image in while_heard(self, out, self._images, newest, lambda: self.rate):
            if not (pillow or told):
                told = True
                self.log.info(
                    "images are compressed as png", because="there is no Pillow: pip install 'robactor[images]'"
                )
            work = partial(compress, quality=self.jpeg_quality) if pillow and self.format == "jpeg" else compressed
            try:
                out(await self.offload(work, image, takes=ENCODING, thread=True))
            except ValueError as error:
                if image.encoding not in refused:
                    refused.add(image.encoding)
                    self.log.warning("an image cannot be compressed", because=str(error))
