"""What a buffer and the client of a buffer are asked by: times, timeouts, and the header of a message."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Coroutine
from typing import TypeAlias

from actors.interfaces.geometry_msgs.msg import TransformStamped
from actors.interfaces.message import M, Message
from actors.interfaces.std_msgs.msg import Header
from actors.message_filters.stamps import Stamp, instant_of
from actors.tf2.errors import TransformException
from actors.tf2.geometry import do_transform
from actors.time.values import Duration

Instant: TypeAlias = Stamp | None
"""A `Time`, the stamp of a message, or None. None and the time 0 ask for the latest time at which all transforms on the way are known."""

WAIT = 1.0
"""The default timeout of a lookup that waits, seconds."""


def instant_asked(time: Instant) -> int:
    """The time in nanoseconds; 0 for None."""
    return 0 if time is None else instant_of(time)


def seconds_of(duration: float | Duration) -> float:
    """A duration in seconds."""
    return duration.seconds if isinstance(duration, Duration) else duration


def header_of(message: Message) -> Header:
    """The header, which says the frame and the time. Raises ``TypeError`` for a message without one."""
    header: Header | None = getattr(message, "header", None)
    if header is None:
        raise TypeError(
            f"{type(message).__name__} has no header, so it has no frame and no time; "
            "look the transform up, and use do_transform"
        )
    return header


def refuse_wait(method: str, timeout: object) -> None:
    """Raise ``TypeError`` for a `timeout` of a method that cannot wait, with the one that can."""
    if timeout is not None:
        raise TypeError(
            f"{method} answers from what has come, and does not wait, which would hold up all nodes: write "
            f"`await buffer.{method}_async(..., timeout=1.0)`"
        )


class AsyncLookups(ABC):
    """The lookups that wait, of a buffer and of the client of a buffer: all that follow from the two that give a transform."""

    @abstractmethod
    async def lookup_transform_async(
        self, target_frame: str, source_frame: str, time: Instant = None, *, timeout: float | Duration | None = WAIT
    ) -> TransformStamped: ...

    @abstractmethod
    async def lookup_transform_full_async(
        self,
        target_frame: str,
        target_time: Instant,
        source_frame: str,
        source_time: Instant,
        fixed_frame: str,
        *,
        timeout: float | Duration | None = WAIT,
    ) -> TransformStamped: ...

    async def can_transform_async(
        self, target_frame: str, source_frame: str, time: Instant = None, *, timeout: float | Duration | None = WAIT
    ) -> bool:
        """Whether `lookup_transform_async` has an answer in time."""
        return await _comes(self.lookup_transform_async(target_frame, source_frame, time, timeout=timeout))

    async def can_transform_full_async(
        self,
        target_frame: str,
        target_time: Instant,
        source_frame: str,
        source_time: Instant,
        fixed_frame: str,
        *,
        timeout: float | Duration | None = WAIT,
    ) -> bool:
        """Whether `lookup_transform_full_async` has an answer in time."""
        asked = target_frame, target_time, source_frame, source_time, fixed_frame
        return await _comes(self.lookup_transform_full_async(*asked, timeout=timeout))

    async def transform_async(self, message: M, target_frame: str, *, timeout: float | Duration | None = WAIT) -> M:
        """As `Buffer.transform`, but wait as `lookup_transform_async` does."""
        header = header_of(message)
        there = await self.lookup_transform_async(target_frame, header.frame_id, header.stamp, timeout=timeout)
        return do_transform(message, there)

    async def transform_full_async(
        self,
        message: M,
        target_frame: str,
        target_time: Instant,
        fixed_frame: str,
        *,
        timeout: float | Duration | None = WAIT,
    ) -> M:
        """As `Buffer.transform_full`, but wait as `lookup_transform_async` does."""
        header = header_of(message)
        asked = target_frame, target_time, header.frame_id, header.stamp, fixed_frame
        return do_transform(message, await self.lookup_transform_full_async(*asked, timeout=timeout))


async def _comes(lookup: Coroutine[object, object, object]) -> bool:
    """Whether a lookup has an answer."""
    try:
        await lookup
    except TransformException:
        return False
    return True
