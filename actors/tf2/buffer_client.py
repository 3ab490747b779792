"""`BufferClient`: transforms asked of a buffer server, another node that keeps the buffer."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from types import MappingProxyType

from actors.contracts.contracts import Action
from actors.errors import ActionUnavailable, GoalAborted
from actors.interfaces.builtin_interfaces.msg import Time as TimeMessage
from actors.interfaces.geometry_msgs.msg import TransformStamped
from actors.interfaces.tf2_msgs.action import LookupTransform, LookupTransform_Goal
from actors.interfaces.tf2_msgs.msg import TF2Error
from actors.runtime.node import Node
from actors.tf2.errors import (
    ConnectivityException,
    ExtrapolationException,
    InvalidArgumentException,
    LookupException,
    TimeoutException,
    TransformException,
)
from actors.tf2.lookups import WAIT, AsyncLookups, Instant, instant_asked, seconds_of
from actors.time.deadlines import check_timeout
from actors.time.values import Duration, stamp_of

LOOKUP = Action(LookupTransform, "tf2_buffer_server")
"""The action of a buffer server, under the name that it has in ROS 2."""

ERRORS: Mapping[int, type[TransformException]] = MappingProxyType(
    {
        TF2Error.LOOKUP_ERROR: LookupException,
        TF2Error.CONNECTIVITY_ERROR: ConnectivityException,
        TF2Error.EXTRAPOLATION_ERROR: ExtrapolationException,
        TF2Error.INVALID_ARGUMENT_ERROR: InvalidArgumentException,
        TF2Error.TIMEOUT_ERROR: TimeoutException,
        TF2Error.TRANSFORM_ERROR: TransformException,
    }
)
"""What the numbers of ``tf2_msgs/msg/TF2Error`` stand for."""

PADDING = 2.0
"""The default of how much longer than the server the client waits, seconds."""


class BufferClient(AsyncLookups):
    """Asks the buffer server of that name, a `BufferServer` or that of ROS 2, for a node that keeps no transforms itself.

    The methods are those of a `Buffer` that wait, and raise what theirs raise, and `TimeoutException` when the server does not answer
    within `timeout_padding` (seconds, or a `Duration`) after the timeout of the lookup.
    """

    def __init__(self, node: Node, ns: str = LOOKUP.name, *, timeout_padding: float | Duration = PADDING) -> None:
        self._node = node
        self._action = Action(LookupTransform, ns)
        check_timeout(f"the padding of {self!r}", padding := seconds_of(timeout_padding))
        self._padding = padding

    def __repr__(self) -> str:
        return f"<BufferClient of {self._action.name}>"

    async def lookup_transform_async(
        self, target_frame: str, source_frame: str, time: Instant = None, *, timeout: float | Duration | None = WAIT
    ) -> TransformStamped:
        """As `Buffer.lookup_transform_async`."""
        goal = LookupTransform.Goal(target_frame=target_frame, source_frame=source_frame, source_time=_stamp(time))
        return await self._ask(goal, timeout)

    async def lookup_transform_full_async(
        self,
        target_frame: str,
        target_time: Instant,
        source_frame: str,
        source_time: Instant,
        fixed_frame: str,
        *,
        timeout: float | Duration | None = WAIT,
    ) -> TransformStamped:
        """As `Buffer.lookup_transform_full_async`."""
        goal = LookupTransform.Goal(
            target_frame=target_frame,
            target_time=_stamp(target_time),
            source_frame=source_frame,
            source_time=_stamp(source_time),
            fixed_frame=fixed_frame,
            advanced=True,
        )
        return await self._ask(goal, timeout)

    async def _ask(self, goal: LookupTransform_Goal, timeout: float | Duration | None) -> TransformStamped:
        if timeout is None:
            raise ValueError("timeout=None: a buffer server is asked for a time; give seconds")
        check_timeout("a lookup of a transform", seconds := seconds_of(timeout))
        patience = seconds + self._padding
        goal = goal.replace(timeout=Duration(seconds=seconds).to_msg())
        try:
            async with asyncio.timeout(patience), self._node.send_goal(self._action, goal, timeout=patience) as asked:
                result = await asked
        except (ActionUnavailable, TimeoutError) as error:
            raise TimeoutException(
                f"{self!r} has no answer after {patience:g} s: {str(error) or 'it is late'}"
            ) from None
        except GoalAborted as aborted:
            given = aborted.result
            if not isinstance(given, LookupTransform.Result) or given.error.error == TF2Error.NO_ERROR:
                raise TimeoutException(  # ROS 2's server gives up without a word
                    f"{goal.source_frame} -> {goal.target_frame} has not become known to {self!r} within {seconds:g} s"
                ) from None
            result = given
        if result.error.error != TF2Error.NO_ERROR:
            raise ERRORS.get(result.error.error, TransformException)(result.error.error_string)
        return result.transform


def _stamp(time: Instant) -> TimeMessage:
    return stamp_of(instant_asked(time))
