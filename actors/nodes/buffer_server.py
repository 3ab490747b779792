"""`BufferServer`: transforms for nodes that keep none."""

from __future__ import annotations

from actors.contracts.contracts import Aborted, Done, Steps, parallel
from actors.interfaces.tf2_msgs.action import (
    LookupTransform,
    LookupTransform_Feedback,
    LookupTransform_Goal,
    LookupTransform_Result,
)
from actors.interfaces.tf2_msgs.msg import TF2Error
from actors.parameters.declare import parameter
from actors.runtime.node import Node
from actors.tf2.buffer import Buffer
from actors.tf2.buffer_client import ERRORS, LOOKUP
from actors.tf2.errors import TransformException
from actors.tf2.listener import TransformListener
from actors.time.values import Duration

AT_ONCE = 1000
"""The number of lookups that may wait at the same time."""


class BufferServer(Node):
    """Keeps the transforms of the last `buffer_size` seconds and answers those who ask by a `BufferClient`, as ROS 2's buffer_server does.

    A lookup that has no answer within its timeout is aborted, with the error in its result.
    """

    node_name = "tf_buffer"
    buffer_size = parameter(120.0, unit="s", read_only=True, description="How long transforms are kept.")

    async def on_start(self) -> None:
        self.buffer = Buffer(self.buffer_size, self)
        TransformListener(self.buffer, self)

    @LOOKUP.serve(arrivals=parallel(AT_ONCE))
    async def look_up(self, goal: LookupTransform_Goal) -> Steps[LookupTransform_Feedback, LookupTransform_Result]:
        timeout = Duration.from_msg(goal.timeout)
        try:
            if goal.advanced:
                there = await self.buffer.lookup_transform_full_async(
                    goal.target_frame,
                    goal.target_time,
                    goal.source_frame,
                    goal.source_time,
                    goal.fixed_frame,
                    timeout=timeout,
                )
            else:
                there = await self.buffer.lookup_transform_async(
                    goal.target_frame, goal.source_frame, goal.source_time, timeout=timeout
                )
        except TransformException as error:
            number = next(number for number, kind in ERRORS.items() if isinstance(error, kind))
            text = str(error)
            yield Aborted(LookupTransform.Result(error=TF2Error(error=number, error_string=text)), text)
        else:
            yield Done(LookupTransform.Result(transform=there))
