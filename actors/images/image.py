"""`sensor_msgs/msg/Image` as a numpy array, and back."""

from __future__ import annotations

import re
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from actors.interfaces.sensor_msgs.msg import Image
from actors.interfaces.std_msgs.msg import Header

Array = NDArray[Any]

COLOURS: Final = {"rgb": (0, 1, 2), "bgr": (2, 1, 0), "rgba": (0, 1, 2), "bgra": (2, 1, 0), "mono": (0, 0, 0)}
"""Where red, green and blue are among the channels of a pixel."""

_NUMBERS: Final = {"8U": "u1", "8S": "i1", "16U": "u2", "16S": "i2", "32S": "i4", "32F": "f4", "64F": "f8"}
_BAYER: Final = frozenset({"bayer_rggb", "bayer_bggr", "bayer_gbrg", "bayer_grbg"})
_YUV422: Final = {
    "yuv422": (1, 0, 2), "uyvy": (1, 0, 2), "yuv422_yuy2": (0, 1, 3), "yuyv": (0, 1, 3),
}  # fmt: skip
"""Encoding -> the bytes of the first luminance, of U and of V in a group of two pixels."""

_LUMINANCE: Final = np.array((0.299, 0.587, 0.114))
"""The parts of red, green and blue in a grey value (ITU-R BT.601)."""


class Encoding(NamedTuple):
    """The pixels of an image: the type of their numbers, without byte order, and how many there are."""

    number: str
    channels: int
    colours: str
    """The key in `COLOURS`, or "" for what is no colour."""

    @property
    def size(self) -> int:
        """The bytes of one pixel."""
        return np.dtype(self.number).itemsize * self.channels


def encoding_of(name: str) -> Encoding:
    """The encoding of this name. Raises `ValueError` for one that is not known."""
    if name in _YUV422:
        return Encoding("u1", 2, name)
    if found := re.fullmatch(r"(rgba?|bgra?|mono)(8|16)", name):
        colours, bits = found.groups()
        return Encoding(f"u{int(bits) // 8}", 1 if colours == "mono" else len(colours), colours)
    if found := re.fullmatch(r"(8U|8S|16U|16S|32S|32F|64F)C([1-9][0-9]*)", name):
        return Encoding(_NUMBERS[found[1]], int(found[2]), "")
    if (found := re.fullmatch(r"(bayer_[a-z]{4})(8|16)", name)) and found[1] in _BAYER:
        return Encoding(f"u{int(found[2]) // 8}", 1, "")
    raise ValueError(
        f"the encoding {name!r} is not known; there are rgb8, bgr8, rgba8, bgra8, mono8, each also with 16, 8UC1 to 64FC4, "
        f"bayer_rggb8 and so on, {', '.join(_YUV422)}"
    )


def converted(pixels: Array, name: str, wanted: str) -> Array:
    """Pixels of the encoding `name` in the encoding `wanted`: another order of colours, grey, or with full opacity.

    Raises `ValueError` if that is no change of colours, or one between 8 and 16 bits.
    """
    source, target = encoding_of(name), encoding_of(wanted)
    if source.colours in _YUV422 and target.number == "u1" and target.colours in COLOURS:
        pixels, source = _rgb_of_yuv(pixels, _YUV422[source.colours]), encoding_of("rgb8")
    if source.colours not in COLOURS or target.colours not in COLOURS or source.number != target.number:
        raise ValueError(f"an image of {name!r} cannot be turned into {wanted!r}")
    stacked = pixels.reshape(*pixels.shape[:2], -1)
    rgb = stacked[:, :, COLOURS[source.colours]]
    if target.colours == "mono":
        return pixels if source.colours == "mono" else np.rint(rgb @ _LUMINANCE).astype(pixels.dtype)
    result = np.full((*pixels.shape[:2], target.channels), np.iinfo(pixels.dtype).max, dtype=pixels.dtype)
    result[:, :, COLOURS[target.colours]] = rgb
    if source.channels == target.channels == 4:
        result[:, :, 3] = stacked[:, :, 3]
    return result


def _rgb_of_yuv(pixels: Array, places: tuple[int, int, int]) -> Array:
    """Colours of pixels that share U and V in pairs (ITU-R BT.601, luminance from 16 to 235)."""
    height, width = pixels.shape[:2]
    pairs = pixels.reshape(height, width // 2, 4).astype(np.float64)
    first, u, v = places
    luminance = 1.164 * (pairs[:, :, (first, first + 2)].reshape(height, width) - 16.0)
    blue, red = (np.repeat(pairs[:, :, place], 2, axis=1) - 128.0 for place in (u, v))
    rgb = np.stack((luminance + 1.596 * red, luminance - 0.813 * red - 0.391 * blue, luminance + 2.018 * blue), axis=-1)
    return np.clip(np.rint(rgb), 0, 255).astype(np.uint8)


def array_of(image: Image, encoding: str = "") -> NDArray[Any]:
    """The pixels of an image: shape (height, width), or (height, width, channels) for more than one channel, rows from the top.

    Without `encoding`, or with that of the image, it is a read-only view of the message's data, with the byte order of the image. With
    another one the colours are converted: among rgb, bgr, rgba, bgra and mono of the same number of bits, and from yuv422 of either
    order. Raises `ValueError` for an unknown encoding or conversion, and for too little data.
    """
    source = encoding_of(image.encoding)
    step = image.step or image.width * source.size
    needed = step * image.height
    if step < image.width * source.size or len(image.data) < needed:
        raise ValueError(
            f"an image of {image.height} rows of {image.width} pixels {image.encoding} needs {source.size} bytes for each pixel; "
            f"its step is {step}, and it has {len(image.data)} bytes"
        )
    number = np.dtype(source.number).newbyteorder(">" if image.is_bigendian else "<")
    shape = (image.height, image.width, source.channels)
    strides = (step, source.size, number.itemsize)
    pixels: NDArray[Any] = np.ndarray(shape, number, np.ascontiguousarray(image.data).data, 0, strides)
    pixels.setflags(write=False)
    pixels = pixels[:, :, 0] if source.channels == 1 else pixels
    return pixels if encoding in ("", image.encoding) else converted(pixels, image.encoding, encoding)


def image_of(pixels: ArrayLike, encoding: str, header: Header | None = None) -> Image:
    """An image of these pixels, shape (height, width) or (height, width, channels), in numbers of the encoding's type.

    Raises `ValueError` for pixels that do not fit the encoding: nothing is scaled or cut off.
    """
    given = np.asarray(pixels)
    target = encoding_of(encoding)
    stacked = given[:, :, None] if given.ndim == 2 else given
    number = np.dtype(target.number)
    if stacked.ndim != 3 or stacked.shape[2] != target.channels or given.dtype.newbyteorder("=") != number:
        raise ValueError(
            f"{encoding} takes {number} of the shape (height, width, {target.channels}), not {given.dtype} of {given.shape}"
        )
    height, width = stacked.shape[:2]
    data = np.ascontiguousarray(stacked, dtype=number.newbyteorder("<")).view(np.uint8).reshape(-1)
    return Image(
        header=header or Header(), height=height, width=width, encoding=encoding, step=width * target.size, data=data.copy()
    )  # fmt: skip
