"""The encodings of `sensor_msgs/msg/Image`: the numbers of a pixel, and conversions between colours."""

from __future__ import annotations

import re
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

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
