"""`MessageFilter`: messages of a topic, as soon as they can be transformed."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable
from enum import Enum
from typing import TYPE_CHECKING, Any, Literal, TypeVar

from actors.message_filters.simple_filter import PassThrough, SimpleFilter
from actors.message_filters.stamps import stamp_of_message
from actors.tf2.errors import ExtrapolationException, InvalidArgumentException, TransformException
from actors.time.values import Time

if TYPE_CHECKING:
    from actors.tf2.buffer import Buffer

M = TypeVar("M")

QUEUE_SIZE = 100
"""The default of how many messages wait."""


class FilterFailureReason(Enum):
    """Why a `MessageFilter` has dropped a message."""

    OUT_THE_BACK = "the time of the message is before all that is known of its frame"
    EMPTY_FRAME_ID = "the message names no frame"
    QUEUE_FULL = "too many messages were waiting"


class MessageFilter(PassThrough[M]):
    """Holds messages back until their frame can be transformed to every one of `target_frames` at their stamp, and lets them through then.

    With a `tolerance`, seconds, also at that time after their stamp. Messages come out in the order in which they become transformable. Of
    more than `queue_size` (0: no bound) the oldest is dropped; a message that can never be transformed any more is dropped at once.
    """

    # Invariant: the buffer calls `_check` exactly while messages wait.

    def __init__(
        self,
        buffer: Buffer,
        target_frames: str | Iterable[str],
        source: SimpleFilter[M] | None = None,
        *,
        queue_size: int = QUEUE_SIZE,
        tolerance: float = 0.0,
    ) -> None:
        frames = (target_frames,) if isinstance(target_frames, str) else tuple(target_frames)
        if not frames or queue_size < 0 or tolerance < 0:
            raise ValueError(
                f"MessageFilter(target_frames={frames}, queue_size={queue_size}, tolerance={tolerance}): "
                "there is one target frame or more, and the others are not negative"
            )
        super().__init__(source)
        self.target_frames = frames
        self._buffer = buffer
        self._queue_size = queue_size
        self._offsets = (0, round(tolerance * 1e9)) if tolerance else (0,)
        self._waiting: deque[M] = deque()
        self._stop_watching: Callable[[], None] | None = None
        self._failure_callbacks: list[Callable[[M, FilterFailureReason], object]] = []
        self.dropped = dict.fromkeys(FilterFailureReason, 0)
        """The number of messages dropped, for each reason."""

    def __repr__(self) -> str:
        return f"<MessageFilter to {', '.join(self.target_frames)}: {len(self._waiting)} wait>"

    def register_failure_callback(self, callback: Callable[[M, FilterFailureReason], object]) -> None:
        """Call ``callback(message, reason)`` for every message that is dropped."""
        self._failure_callbacks.append(callback)

    def add(self, message: M) -> None:
        """Take in a message, which must have a header."""
        stamp_of_message(message)
        if not _frame_of(message):
            self._drop(message, FilterFailureReason.EMPTY_FRAME_ID)
            return
        if self._queue_size and len(self._waiting) >= self._queue_size:
            self._drop(self._waiting.popleft(), FilterFailureReason.QUEUE_FULL)
        self._waiting.append(message)
        self._check()

    def clear(self) -> None:
        """Forget the messages that wait."""
        self._waiting.clear()
        self._watch()

    def _check(self) -> None:
        still: deque[M] = deque()
        while self._waiting:
            message = self._waiting.popleft()
            verdict = self._verdict(message)
            if verdict is True:
                self.signal_message(message)
            elif verdict is None:
                still.append(message)
            else:
                self._drop(message, verdict)
        self._waiting = still
        self._watch()

    def _verdict(self, message: object) -> FilterFailureReason | Literal[True] | None:
        """Whether the message can be transformed; None if not yet, or why it never can."""
        frame, stamp = _frame_of(message), stamp_of_message(message)
        try:
            for target in self.target_frames:
                for offset in self._offsets:
                    self._buffer.lookup_transform(target, frame, Time(nanoseconds=stamp + offset))
        except ExtrapolationException as error:
            return FilterFailureReason.OUT_THE_BACK if error.past else None
        except InvalidArgumentException:
            raise
        except TransformException:
            return None
        return True

    def _watch(self) -> None:
        """Watch the buffer while messages wait."""
        if self._waiting and self._stop_watching is None:
            self._stop_watching = self._buffer.on_change(self._check)
        elif not self._waiting and self._stop_watching is not None:
            self._stop_watching()
            self._stop_watching = None

    def _drop(self, message: M, reason: FilterFailureReason) -> None:
        self.dropped[reason] += 1
        for callback in self._failure_callbacks:
            callback(message, reason)


def _frame_of(message: Any) -> str:
    """The message's frame, without the slash with which it may begin."""
    frame: str = message.header.frame_id
    return frame.removeprefix("/")
