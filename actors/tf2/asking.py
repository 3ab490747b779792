"""What a buffer and the client of a buffer are asked by: times, timeouts, and the header of a message."""

from __future__ import annotations

from collections.abc import Coroutine
from typing import TYPE_CHECKING, TypeAlias

from actors.message_filters.stamps import Stamp, instant_of
from actors.tf2.errors import TransformException
from actors.time.values import Duration

if TYPE_CHECKING:
    from actors.interfaces.message import Message
    from actors.interfaces.std_msgs.msg import Header

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


async def comes(lookup: Coroutine[object, object, object]) -> bool:
    """Whether a lookup has an answer."""
    try:
        await lookup
    except TransformException:
        return False
    return True
