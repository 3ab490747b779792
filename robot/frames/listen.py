"""A listener to `/tf` and `/tf_static` for one node, made in its `on_start`."""

from __future__ import annotations

import asyncio

from actors import Node, Stream
from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.tf2_msgs.msg import TFMessage
from actors.time import Duration, JumpThreshold, TimeJump
from robot.contracts import TF, TF_STATIC
from robot.frames.tree import HISTORY, FrameTree
from robot.geometry.errors import Extrapolation, FrameError, NotConnected, UnknownFrame
from robot.geometry.transform import Transform

__all__ = ["TfListener"]


class TfListener:
    """A `FrameTree` that is kept up to date for one node, from the moment it is made; latched static transforms come at once.

    Transforms that cannot be (see `FrameTree.insert`) are left out and logged once for each pair of frames. When the node's ROS
    time is set back, what moves is forgotten.
    """

    def __init__(self, node: Node, history: float = HISTORY) -> None:
        self.tree = FrameTree(history)
        self._node = node
        self._news: asyncio.Event = asyncio.Event()
        self._complained: set[tuple[str, str]] = set()
        node.spawn(self._hear(node.subscribe(TF), static=False), name="tf")
        node.spawn(self._hear(node.subscribe(TF_STATIC), static=True), name="tf_static")
        node.on_jump(JumpThreshold(min_forward=None, min_backward=Duration(nanoseconds=-1)), post=self._jumped)

    def __repr__(self) -> str:
        return f"<TfListener of {self._node.fqn}: {self.tree!r}>"

    def lookup(self, target: str, source: str, at: Time | None = None) -> Transform:
        """As `FrameTree.lookup`: from what has arrived until now."""
        return self.tree.lookup(target, source, at)

    async def wait_for(self, target: str, source: str, at: Time | None = None, *, timeout: float = 1.0) -> Transform:
        """As `lookup`, but wait up to `timeout` seconds for transforms that have not come yet; then raise what `lookup` raises.

        A plain handler that waits here holds up its node; goals, tasks and handlers with ``concurrent=`` do not. A time that has been
        forgotten already does not come back: it raises at once.
        """
        end = asyncio.get_running_loop().time() + timeout
        while True:
            try:
                return self.tree.lookup(target, source, at)
            except (UnknownFrame, NotConnected, Extrapolation) as error:
                if isinstance(error, Extrapolation) and error.past:
                    raise
                try:
                    async with asyncio.timeout_at(end):
                        await self._news.wait()
                except TimeoutError:
                    raise error from None

    async def _hear(self, messages: Stream[TFMessage], *, static: bool) -> None:
        """A stream of its own, not a handler: a node that was restarted takes over its handlers' queues, which do not tell again what
        is latched.
        """
        async for message in messages:
            self._take(message, static=static)

    def _take(self, message: TFMessage, *, static: bool) -> None:
        for transform in message.transforms:
            try:
                self.tree.insert(transform, static=static)
            except FrameError as error:
                pair = (transform.header.frame_id, transform.child_frame_id)
                if pair not in self._complained:
                    self._complained.add(pair)
                    self._node.log.warning("a transform was left out", reason=str(error))
        news, self._news = self._news, asyncio.Event()
        news.set()

    def _jumped(self, jump: TimeJump) -> None:
        self.tree.clear()
