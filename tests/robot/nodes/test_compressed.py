"""Compressed images beside the plain ones: the same pixels in fewer bytes, made only for those who listen."""

from __future__ import annotations

import io
import struct
import zlib
from typing import Any

import numpy as np
import pytest

from actors import Child, Node, Topic, qos
from actors.interfaces.sensor_msgs.msg import Image
from actors.interfaces.std_msgs.msg import Header
from actors.testing import Rig
from robot.nodes import compressed as module
from robot.nodes.compressed import ImageCompressor, compressed, compressed_topic

IMAGES = Topic(Image, "camera/image", qos.SENSOR_DATA)


def scene(encoding: str = "rgb8", padding: int = 0) -> tuple[Image, Any]:
    """An image of 40 x 30 pixels, and its pixels."""
    channels = 1 if encoding == "mono8" else 3
    pixels = np.arange(30 * 40 * channels, dtype=np.uint8).reshape(30, 40 * channels)
    rows = np.pad(pixels, ((0, 0), (0, padding)), constant_values=9)
    image = Image(
        header=Header(frame_id="camera"), height=30, width=40, encoding=encoding, step=rows.shape[1], data=rows.ravel()
    )
    return image, pixels.reshape(30, 40, channels)


def unpacked(png: bytes) -> Any:
    """The pixels of a PNG file of ours, read without the code that wrote it: rows by the filters None and Up."""
    assert png[:8] == b"\x89PNG\r\n\x1a\n"
    position, packed, size = 8, b"", (0, 0)
    while position < len(png):
        length, kind = struct.unpack(">I4s", png[position : position + 8])
        body = png[position + 8 : position + 8 + length]
        size = struct.unpack(">II", body[:8]) if kind == b"IHDR" else size
        packed += body if kind == b"IDAT" else b""
        position += 12 + length
    rows = np.frombuffer(zlib.decompress(packed), dtype=np.uint8).reshape(size[1], 1 + 3 * size[0])
    assert set(rows[:, 0].tolist()) <= {0, 2}
    return np.cumsum(rows[:, 1:], axis=0, dtype=np.uint8).reshape(size[1], size[0], 3)


@pytest.mark.parametrize(
    ("encoding", "format", "order"),
    [
        ("rgb8", "rgb8; png compressed bgr8", [0, 1, 2]),
        ("bgr8", "bgr8; png compressed bgr8", [2, 1, 0]),
        ("mono8", "mono8; png compressed mono8", [0, 0, 0]),
    ],
)
@pytest.mark.parametrize("padding", [0, 8])
def test_no_pixel_is_changed_and_the_format_is_that_of_image_transport(
    encoding: str, format: str, order: list[int], padding: int
) -> None:
    image, pixels = scene(encoding, padding)

    packed = compressed(image)

    assert (packed.format, packed.header) == (format, image.header)
    assert np.array_equal(unpacked(packed.data.tobytes()), pixels[:, :, order])


def test_images_of_another_encoding_are_refused_with_those_that_are_taken() -> None:
    with pytest.raises(ValueError, match=r"^images of '16UC1' are not compressed, only those of rgb8, bgr8, mono8$"):
        compressed(Image(height=1, width=1, encoding="16UC1", step=2, data=np.zeros(2, dtype=np.uint8)))


async def test_a_camera_sends_small_jpegs_unless_it_is_asked_to_lose_nothing(rig: Rig) -> None:
    pillow = pytest.importorskip("PIL.Image")
    await rig.start(Child(ImageCompressor, args=(IMAGES,)), Child(Node, name="camera"))
    camera = rig.node("camera").publisher(IMAGES)
    rows, columns = np.mgrid[0:120, 0:160]
    noise = np.random.default_rng(1).integers(0, 8, (120, 160, 3))
    pixels = (np.stack([rows, columns, 200 - columns // 2], axis=2) + noise).astype(np.uint8)
    image = Image(height=120, width=160, encoding="rgb8", step=480, data=pixels.ravel())
    async with rig.me.subscribe(compressed_topic(IMAGES)) as stream:
        await rig.quiet()
        camera.publish(image)
        small = await stream.next(timeout=2.0)
        rig.node(ImageCompressor).set_parameter("format", "png")
        await rig.advance(0.2)
        camera.publish(image)
        exact = await stream.next(timeout=2.0)

    seen = np.asarray(pillow.open(io.BytesIO(small.data.tobytes())), dtype=int)
    assert small.format == "rgb8; jpeg compressed bgr8"
    assert small.data.size < exact.data.size / 5 and np.abs(seen - pixels).max() < 30
    assert exact.format == "rgb8; png compressed bgr8"


async def test_without_pillow_images_are_png_and_it_is_said_once(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "find_spec", lambda name: None)
    await rig.start(Child(ImageCompressor, args=(IMAGES,)), Child(Node, name="camera"))
    camera = rig.node("camera").publisher(IMAGES)
    probe = rig.probe(compressed_topic(IMAGES))
    await rig.quiet()
    for _ in range(2):
        camera.publish(scene()[0])
        await rig.advance(0.2)

    assert [packed.format for packed in probe.messages] == ["rgb8; png compressed bgr8"] * 2
    assert [log.event for log in rig.logs if log.node == "/image_compressor"] == ["images are compressed as png"]


async def test_images_are_compressed_only_while_somebody_listens(rig: Rig) -> None:
    await rig.start(Child(ImageCompressor, args=(IMAGES,), parameters={"format": "png"}), Child(Node, name="camera"))
    camera = rig.node("camera").publisher(IMAGES)
    image, pixels = scene()
    camera.publish(image)
    await rig.advance(1.0)
    assert camera.subscription_count == 0

    async with rig.me.subscribe(compressed_topic(IMAGES)) as stream:
        await rig.quiet()
        assert camera.subscription_count == 1
        await rig.advance(3.0)  # a camera that is silent for a while is waited for
        camera.publish(image)
        packed = await stream.next(timeout=2.0)
        assert np.array_equal(unpacked(packed.data.tobytes()), pixels)
    await rig.advance(2.0)

    assert camera.subscription_count == 0


@pytest.mark.parametrize("format", ["jpeg", "png"])
async def test_an_image_that_cannot_be_compressed_is_left_out_and_said_once(rig: Rig, format: str) -> None:
    await rig.start(Child(ImageCompressor, args=(IMAGES,), parameters={"format": format}), Child(Node, name="camera"))
    camera = rig.node("camera").publisher(IMAGES)
    probe = rig.probe(compressed_topic(IMAGES))
    await rig.quiet()

    for encoding in ("16UC1", "16UC1", "rgb8"):
        camera.publish(scene()[0].replace(encoding=encoding))
        await rig.advance(0.2)

    assert len(probe) == 1
    assert [log.event for log in rig.logs if log.node == "/image_compressor" and log.level >= 30] == [
        "an image cannot be compressed"
    ]
