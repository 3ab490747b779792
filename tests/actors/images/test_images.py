"""Images as arrays and back, in the usual encodings, against bytes written by hand."""

from __future__ import annotations

import io
import sys
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image as pillow

from actors.images import array_of, compress, decompress, image_of
from actors.interfaces import decode, encode
from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.sensor_msgs.msg import CompressedImage, Image
from actors.interfaces.std_msgs.msg import Header

HEADER = Header(stamp=Time(sec=7), frame_id="camera")
RED, GREEN, BLUE, WHITE = (255, 0, 0), (0, 255, 0), (0, 0, 255), (255, 255, 255)


def test_an_image_is_written_row_by_row() -> None:
    image = image_of(np.array([[RED, GREEN], [BLUE, WHITE]], dtype=np.uint8), "rgb8", HEADER)
    assert (image.height, image.width, image.step, image.encoding, image.is_bigendian) == (2, 2, 6, "rgb8", 0)
    assert bytes(image.data) == bytes([*RED, *GREEN, *BLUE, *WHITE]) and image.header == HEADER
    assert decode(Image, encode(image)) == image


@pytest.mark.parametrize(
    ("encoding", "dtype", "shape"),
    [
        ("rgb8", "u1", (3, 4, 3)), ("bgr8", "u1", (3, 4, 3)), ("rgba8", "u1", (3, 4, 4)), ("bgra16", "u2", (3, 4, 4)),
        ("mono8", "u1", (3, 4)), ("mono16", "u2", (3, 4)), ("8SC2", "i1", (3, 4, 2)), ("16SC1", "i2", (3, 4)), ("32SC3", "i4", (3, 4, 3)),
        ("32FC1", "f4", (3, 4)), ("64FC4", "f8", (3, 4, 4)), ("bayer_rggb8", "u1", (3, 4)), ("bayer_grbg16", "u2", (3, 4)),
        ("yuv422", "u1", (3, 4, 2)), ("yuv422_yuy2", "u1", (3, 4, 2)),
    ],
)  # fmt: skip
def test_what_goes_in_comes_out(encoding: str, dtype: str, shape: tuple[int, ...]) -> None:
    pixels = np.random.default_rng(1).integers(0, 100, shape).astype(dtype)
    image = image_of(pixels, encoding)
    back = array_of(image)
    assert back.dtype == np.dtype(dtype) and back.shape == shape and np.array_equal(back, pixels)
    assert image.header == Header() and not back.flags.writeable
    assert array_of(image, encoding).shape == shape


def test_rows_may_have_a_rest_and_numbers_the_other_order() -> None:
    data = np.frombuffer(bytes([1, 0, 2, 0, 99, 99, 3, 0, 4, 0, 99, 99]), dtype=np.uint8)
    image = Image(height=2, width=2, encoding="mono16", step=6, data=data)
    assert array_of(image).tolist() == [[1, 2], [3, 4]]
    assert array_of(Image(height=2, width=2, encoding="mono16", step=6, is_bigendian=1, data=data)).tolist() == [
        [256, 512], [768, 1024],
    ]  # fmt: skip
    assert array_of(Image(height=1, width=2, encoding="mono8", data=[5, 6])).tolist() == [[5, 6]]


def test_big_endian_pixels_are_written_little() -> None:
    image = image_of(np.array([[1, 2]], dtype=">u2"), "mono16")
    assert bytes(image.data) == bytes([1, 0, 2, 0])


@pytest.mark.parametrize(
    ("wanted", "expected"),
    [
        ("bgr8", [[0, 0, 255], [0, 255, 0], [255, 0, 0]]),
        ("rgba8", [[255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 255]]),
        ("bgra8", [[0, 0, 255, 255], [0, 255, 0, 255], [255, 0, 0, 255]]),
        ("mono8", [76, 150, 29]),  # as OpenCV has them
    ],
)
def test_colours_are_put_into_another_order(wanted: str, expected: Any) -> None:
    image = image_of(np.array([[RED, GREEN, BLUE]], dtype=np.uint8), "rgb8")
    assert array_of(image, wanted).tolist() == [expected]


def test_grey_and_opacity_are_kept() -> None:
    grey = image_of(np.array([[7, 200]], dtype=np.uint8), "mono8")
    assert array_of(grey, "bgr8").tolist() == [[[7, 7, 7], [200, 200, 200]]]
    clear = image_of(np.array([[[1, 2, 3, 4]]], dtype=np.uint8), "rgba8")
    assert array_of(clear, "bgra8").tolist() == [[[3, 2, 1, 4]]]
    assert array_of(clear, "rgb8").tolist() == [[[1, 2, 3]]]
    deep = image_of(np.array([[1000]], dtype=np.uint16), "mono16")
    assert array_of(deep, "rgba16").tolist() == [[[1000, 1000, 1000, 65535]]]


@pytest.mark.parametrize(("encoding", "order"), [("yuv422", "uyvy"), ("yuv422_yuy2", "yuyv")])
def test_yuv422_becomes_colours(encoding: str, order: str) -> None:
    # Y, U, V of BT.601 with luminance from 16 to 235: black, white, and red twice
    groups = [{"y": (16, 235), "u": 128, "v": 128}, {"y": (81, 81), "u": 90, "v": 240}]
    data: list[int] = []
    for group in groups:
        luminances = iter(group["y"])  # type: ignore[call-overload]
        data += [next(luminances) if letter == "y" else group[letter] for letter in order]
    image = Image(height=1, width=4, encoding=encoding, data=data)
    black, white, *red = array_of(image, "rgb8")[0].tolist()
    assert black == [0, 0, 0] and min(white) >= 254
    assert all(np.abs(np.subtract(one, RED)).max() <= 2 for one in red)
    assert array_of(image, "bgr8")[0].tolist() == [pixel[::-1] for pixel in (black, white, *red)]
    with pytest.raises(ValueError, match="cannot be turned into 'rgb16'"):
        array_of(image, "rgb16")


@pytest.mark.parametrize(
    ("image", "encoding", "said"),
    [
        (Image(encoding="rgb9"), "", "the encoding 'rgb9' is not known; there are rgb8"),
        (Image(encoding="bayer_rrrr8"), "", "'bayer_rrrr8' is not known"),
        (Image(height=2, width=2, encoding="rgb8", step=6, data=[0] * 11), "", "2 rows of 2 pixels rgb8 needs 3 bytes"),
        (Image(height=1, width=2, encoding="rgb8", step=5, data=[0] * 6), "", "its step is 5"),
        (Image(height=1, width=1, encoding="mono8", data=[1]), "mono16", "'mono8' cannot be turned into 'mono16'"),
        (Image(height=1, width=1, encoding="32FC1", data=[0] * 4), "mono8", "'32FC1' cannot be turned into 'mono8'"),
        (Image(height=1, width=1, encoding="mono8", data=[1]), "8UC1", "cannot be turned into '8UC1'"),
    ],
)
def test_what_cannot_be_read_is_refused(image: Image, encoding: str, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        array_of(image, encoding)


@pytest.mark.parametrize(
    ("pixels", "encoding"),
    [
        (np.zeros((2, 2), np.uint8), "rgb8"), (np.zeros((2, 2, 3), np.float32), "rgb8"), (np.zeros(4, np.uint8), "mono8"),
        (np.zeros((2, 2, 4), np.uint8), "bgr8"), (np.zeros((2, 2), np.int16), "mono16"),
    ],
)  # fmt: skip
def test_pixels_that_do_not_fit_are_refused(pixels: NDArray[Any], encoding: str) -> None:
    with pytest.raises(ValueError, match=f"^{encoding} takes uint"):
        image_of(pixels, encoding)


# -- compressed -----------------------------------------------------------------------------------------------------------------


def gradient(encoding: str) -> Image:
    rows, columns = np.mgrid[0:32, 0:48]
    colours = np.stack((rows * 4, columns * 4, 128 + 0 * rows), axis=-1).astype(np.uint8)
    return image_of(array_of(image_of(colours, "rgb8"), encoding), encoding, HEADER)


@pytest.mark.parametrize("encoding", ["rgb8", "bgr8", "mono8"])
def test_png_loses_nothing(encoding: str) -> None:
    image = gradient(encoding)
    packed = compress(image, "png")
    kind = "mono8" if encoding == "mono8" else "bgr8"
    assert packed.format == f"{encoding}; png compressed {kind}" and packed.header == HEADER
    assert bytes(packed.data[:8]) == b"\x89PNG\r\n\x1a\n" and len(packed.data) < len(image.data)
    with pillow.open(io.BytesIO(packed.data.tobytes())) as opened:
        assert opened.size == (48, 32) and opened.getpixel((47, 31)) == (162 if kind == "mono8" else (124, 188, 128))
    assert decompress(packed) == image


@pytest.mark.parametrize("encoding", ["mono16", "16UC1"])
def test_png_keeps_sixteen_bits(encoding: str) -> None:
    image = image_of(np.array([[0, 1, 65535], [300, 256, 255]], np.uint16), encoding, HEADER)
    assert decompress(compress(image, "png")) == image
    with pytest.raises(ValueError, match=f"images of '{encoding}' cannot be compressed as 'jpeg'"):
        compress(image)


@pytest.mark.parametrize("encoding", ["rgb8", "bgr8", "mono8"])
def test_jpeg_is_near_and_smaller_with_less_quality(encoding: str) -> None:
    image = gradient(encoding)
    good, poor = compress(image, quality=90), compress(image, quality=10)
    assert good.format.startswith(f"{encoding}; jpeg compressed") and len(poor.data) < len(good.data) < len(image.data)
    error = array_of(decompress(good)).astype(int) - array_of(image)
    assert np.abs(error).mean() < 3


def test_opacity_is_left_out() -> None:
    image = image_of(np.full((4, 4, 4), 9, np.uint8), "bgra8")
    packed = compress(image, "png")
    assert decompress(packed, "rgb8") == image_of(np.full((4, 4, 3), 9, np.uint8), "rgb8")


def test_an_image_without_a_named_encoding_has_its_own() -> None:
    packed = compress(gradient("rgb8"), "png")
    plain = decompress(CompressedImage(header=HEADER, format="png", data=packed.data))
    assert plain == gradient("rgb8")
    assert decompress(packed, "mono8") == gradient("mono8")


def test_what_is_no_image_or_cannot_be_one_is_refused() -> None:
    with pytest.raises(ValueError, match=r"the compressed image \('jpeg'\) cannot be read"):
        decompress(CompressedImage(format="jpeg", data=[1, 2, 3]))
    with pytest.raises(ValueError, match="images of '32FC1' cannot be compressed as 'png'"):
        compress(Image(encoding="32FC1"), "png")
    with pytest.raises(ValueError, match="cannot be compressed as 'gif'"):
        compress(gradient("rgb8"), "gif")  # type: ignore[arg-type]


def test_without_pillow_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "PIL", None)
    with pytest.raises(ImportError, match=r"compressed images need Pillow: pip install 'robactor\[images\]'"):
        compress(gradient("rgb8"))
