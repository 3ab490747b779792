"""Where frames are to each other over time: a small tf.

::

    class Grabber(Node):
        async def on_start(self) -> None:
            self.tf = TfListener(self)

        async def reach(self, seen: Detection) -> None:
            where = await self.tf.wait_for("base_link", seen.header.frame_id, seen.header.stamp, timeout=0.2)
            x, y, z = where.point((seen.position.x, seen.position.y, seen.position.z))
"""

from __future__ import annotations

from robot.frames.broadcast import StaticTfBroadcaster, TfBroadcaster
from robot.frames.listen import TfListener
from robot.frames.tree import FrameTree
from robot.geometry.errors import Extrapolation, FrameError, InvalidTransform, NotATree, NotConnected, UnknownFrame
from robot.geometry.transform import Transform, stamped

__all__ = [
    "Extrapolation",
    "FrameError",
    "FrameTree",
    "InvalidTransform",
    "NotATree",
    "NotConnected",
    "StaticTfBroadcaster",
    "TfBroadcaster",
    "TfListener",
    "Transform",
    "UnknownFrame",
    "stamped",
]
