"""Where frames are to each other over time: tf2.

::

    class Grabber(Node):
        async def on_start(self) -> None:
            self.tf_buffer = Buffer()
            self.tf_listener = TransformListener(self.tf_buffer, self)

        @SEEN.on(concurrent=1)
        async def reach(self, seen: PointStamped) -> None:
            here = await self.tf_buffer.transform_async(seen, "base_link", timeout=0.2)
"""

from __future__ import annotations

from actors.tf2.broadcasters import TF, TF_STATIC, StaticTransformBroadcaster, TransformBroadcaster
from actors.tf2.buffer import FRAMES, Buffer
from actors.tf2.buffer_client import LOOKUP, BufferClient
from actors.tf2.description import Frame
from actors.tf2.errors import (
    BackwardExtrapolationException,
    ConnectivityException,
    DescriptionError,
    ExtrapolationException,
    ForwardExtrapolationException,
    InvalidArgumentException,
    LookupException,
    NoDataForExtrapolationException,
    TimeoutException,
    TransformException,
)
from actors.tf2.geometry import do_transform
from actors.tf2.listener import TransformListener
from actors.tf2.lookups import Instant
from actors.tf2.message_filter import FilterFailureReason, MessageFilter
from actors.tf2.quaternions import Quad, Triple
from actors.tf2.transform import Transform, stamped
from actors.tf2.urdf import Joint, JointKind, Mimic, joints_of

__all__ = [
    "FRAMES",
    "LOOKUP",
    "TF",
    "TF_STATIC",
    "BackwardExtrapolationException",
    "Buffer",
    "BufferClient",
    "ConnectivityException",
    "DescriptionError",
    "ExtrapolationException",
    "FilterFailureReason",
    "ForwardExtrapolationException",
    "Frame",
    "Instant",
    "InvalidArgumentException",
    "Joint",
    "JointKind",
    "LookupException",
    "MessageFilter",
    "Mimic",
    "NoDataForExtrapolationException",
    "Quad",
    "StaticTransformBroadcaster",
    "TimeoutException",
    "Transform",
    "TransformBroadcaster",
    "TransformException",
    "TransformListener",
    "Triple",
    "do_transform",
    "joints_of",
    "stamped",
]
