"""Images and point clouds as numpy arrays, and back: what cv_bridge and sensor_msgs_py are for in ROS 2.

Compressed images need Pillow: ``pip install robactor[images]``.
"""

from __future__ import annotations

from actors.images.cloud import array_of_cloud, cloud_of
from actors.images.compressed import compress, decompress
from actors.images.image import array_of, image_of

__all__ = ["array_of", "array_of_cloud", "cloud_of", "compress", "decompress", "image_of"]
