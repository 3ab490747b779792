"""`sensor_msgs/msg/CompressedImage` to and from plain images, by Pillow."""

from __future__ import annotations

import io
from types import ModuleType
from typing import Any, Final, Literal

import numpy as np

from actors.images.image import array_of, image_of
from actors.interfaces.sensor_msgs.msg import CompressedImage, Image

_WRITTEN: Final = {
    "rgb8": "rgb8", "bgr8": "rgb8", "rgba8": "rgb8", "bgra8": "rgb8", "mono8": "mono8", "mono16": "mono16", "16UC1": "16UC1",
}  # fmt: skip
"""Encoding -> that of the pixels in the file."""


def compress(image: Image, format: Literal["jpeg", "png"] = "jpeg", *, quality: int = 80) -> CompressedImage:
    """The image as JPEG, of this quality from 1 to 95, or as PNG, which loses nothing but opacity; named as image_transport does.

    Raises `ValueError` for an encoding or a format that cannot be written, and `ImportError` without Pillow.
    """
    written = _WRITTEN.get(image.encoding)
    deep = written in ("mono16", "16UC1")
    if written is None or format not in ("jpeg", "png") or (deep and format == "jpeg"):
        raise ValueError(f"images of {image.encoding!r} cannot be compressed as {format!r}")
    pixels = np.asarray(array_of(image, written))
    file = io.BytesIO()
    _pillow().fromarray(pixels.astype("<u2") if deep else np.ascontiguousarray(pixels)).save(
        file, format, **({"quality": quality} if format == "jpeg" else {})
    )
    kind = "bgr8" if written == "rgb8" else written  # what a reader of image_transport makes of it first
    return CompressedImage(
        header=image.header, format=f"{image.encoding}; {format} compressed {kind}", data=np.frombuffer(file.getvalue(), np.uint8)
    )  # fmt: skip


def decompress(image: CompressedImage, encoding: str = "") -> Image:
    """The plain image, in the encoding that its format names, or in `encoding`; colours are rgb8 if nothing is named.

    Raises `ValueError` for data that are no image and for an encoding that they cannot have, and `ImportError` without Pillow.
    """
    pillow = _pillow()
    try:
        opened: Any = pillow.open(io.BytesIO(np.asarray(image.data).tobytes()))
        opened.load()
    except (OSError, SyntaxError) as error:
        raise ValueError(f"the compressed image ({image.format!r}) cannot be read: {error}") from None
    if opened.mode.startswith("I"):
        pixels, held = np.asarray(opened).astype(np.uint16), "mono16"
    elif opened.mode in ("L", "1"):
        pixels, held = np.asarray(opened.convert("L")), "mono8"
    else:
        pixels, held = np.asarray(opened.convert("RGB")), "rgb8"
    named, semicolon, _ = image.format.partition(";")
    wanted = encoding or (named.strip() if semicolon else held)
    if held == "mono16" and wanted == "16UC1":
        held = wanted
    plain = image_of(pixels, held, image.header)
    return plain if wanted == held else image_of(array_of(plain, wanted), wanted, image.header)


def _pillow() -> ModuleType:
    try:
        from PIL import Image as pillow
    except ModuleNotFoundError as error:
        raise ImportError("compressed images need Pillow: pip install 'robactor[images]'") from error
    return pillow
