"""`sensor_msgs/msg/Image` as a numpy array, and back."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from actors.images.encodings import converted, encoding_of
from actors.interfaces.sensor_msgs.msg import Image
from actors.interfaces.std_msgs.msg import Header


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
