"""A listener to `/tf` and `/tf_static` for one node, made in its `on_start`."""

from __future__ import annotations

from actors.contracts.contracts import Topic
from actors.interfaces.geometry_msgs.msg import TransformStamped
from actors.interfaces.tf2_msgs.msg import TFMessage
from actors.qos.policies import QoS
from actors.runtime.node import Node
from actors.tf2.broadcasters import TF, TF_STATIC
from actors.tf2.buffer import Buffer
from actors.tf2.errors import InvalidArgumentException
from actors.time.ros_clock import JumpThreshold
from actors.time.values import Duration
from actors.topics.stream import Stream

AUTHORITY = "default_authority"
"""What ROS 2 writes: a message does not say who sent it."""


class TransformListener:
    """Keeps a buffer up to date for one node, from the moment it is made until `close`, or the end of the node's incarnation.

    Latched static transforms come at once; with `static_only` nothing else does.

    Transforms that cannot be (see `Buffer.set_transform`), or come too late to be kept, are left out and logged once for each pair of
    frames. When the node's ROS time is set back, or changes its source, what moves is forgotten.
    """

    def __init__(
        self,
        buffer: Buffer,
        node: Node,
        *,
        qos: QoS | int | None = None,
        static_qos: QoS | int | None = None,
        tf_topic: str = TF.name,
        tf_static_topic: str = TF_STATIC.name,
        static_only: bool = False,
    ) -> None:
        self.buffer = buffer
        self._node = node
        self._complained: set[tuple[str, str]] = set()
        static = node.subscribe(Topic(TFMessage, tf_static_topic, TF_STATIC.qos), qos=static_qos)
        node.create_task(self._hear(static, static=True), name="tf_static")
        self._streams = [static]
        if not static_only:
            moving = node.subscribe(Topic(TFMessage, tf_topic, TF.qos), qos=qos)
            node.create_task(self._hear(moving, static=False), name="tf")
            self._streams.append(moving)
        backwards = JumpThreshold(min_forward=None, min_backward=Duration(nanoseconds=-1))
        self._jumps = node.on_jump(backwards, post=self._jumped)

    def __repr__(self) -> str:
        return f"<TransformListener of {self._node.fqn}: {self.buffer!r}>"

    def close(self) -> None:
        """Listen no more; the buffer keeps what it has. A second call is harmless."""
        for stream in self._streams:
            stream.close()
        self._jumps.remove()

    async def _hear(self, messages: Stream[TFMessage], *, static: bool) -> None:
        """A stream of its own, not a handler: a node that was restarted takes over its handlers' queues, which do not tell again what
        is latched.
        """
        async for message in messages:
            for transform in message.transforms:
                self._take(transform, static=static)

    def _take(self, transform: TransformStamped, *, static: bool) -> None:
        try:
            if static:
                self.buffer.set_transform_static(transform, AUTHORITY)
            elif not self.buffer.set_transform(transform, AUTHORITY):
                self._complain(transform, "it is older than what the buffer keeps")
        except InvalidArgumentException as error:
            self._complain(transform, str(error))

    def _complain(self, transform: TransformStamped, reason: str) -> None:
        pair = (transform.header.frame_id, transform.child_frame_id)
        if pair not in self._complained:
            self._complained.add(pair)
            self._node.log.warning("a transform was left out", parent=pair[0], child=pair[1], reason=reason)

    def _jumped(self, jump: object) -> None:
        self._node.log.warning("the transforms were cleared", reason="ROS time was set back, or its source has changed")
        self.buffer.clear()
