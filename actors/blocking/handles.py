"""Streams and goals of a `BlockingNode`: their methods block a thread until the event loop has the answer."""

from __future__ import annotations

from collections.abc import Callable, Coroutine, Iterator
from types import TracebackType
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

from actors.errors import ActorError

if TYPE_CHECKING:
    from actors.actions.client import Goal
    from actors.actions.goals import GoalStatus
    from actors.interfaces.message import Message
    from actors.node.node import Node
    from actors.topics.stream import Stream

__all__ = ["BlockingGoal", "BlockingStream", "Do"]

M = TypeVar("M", bound="Message")
R = TypeVar("R", bound="Message")
F = TypeVar("F", bound="Message")
T = TypeVar("T")


class Do(Protocol):
    """Run a coroutine function of the node in its event loop and wait for it; `remedy` is what to await inside an event loop."""

    def __call__(self, work: Callable[[Node], Coroutine[Any, Any, T]], remedy: str) -> T: ...


class _End:
    """Marks the end of a stream or of a goal's feedback."""


_END = _End()


class BlockingStream(Generic[M]):
    """A subscription to iterate from a thread, as a `Stream` is from a coroutine. It ends with `close()` and with its node.

    It has no public constructor: `BlockingNode.subscribe` gives one.
    """

    def __init__(self, do: Do, stream: Stream[M]) -> None:
        self._do = do
        self._stream = stream

    def __repr__(self) -> str:
        return f"<blocking {self._stream!r}>"

    @property
    def latest(self) -> M | None:
        """The newest message that arrived, taken out or not; None before the first."""
        return self._stream.latest

    def next(self, timeout: float | None = None) -> M:
        """The next message. Raises `CallTimeout` after `timeout` seconds without one, `Ended` once the stream has ended."""
        return self._do(lambda _: self._stream.next(timeout), "`await stream.next()`")

    def __iter__(self) -> Iterator[M]:
        return self

    def __next__(self) -> M:
        async def work(_: Node) -> M | _End:
            return await anext(self._stream, _END)

        message = self._do(work, "`async for message in stream`")
        if isinstance(message, _End):
            raise StopIteration
        return message

    def close(self) -> None:
        """Stop listening."""

        async def work(_: Node) -> None:
            self._stream.close()

        self._do(work, "`stream.close()`")


class BlockingGoal(Generic[R, F]):
    """One goal as a thread sees it: enter it, iterate it for feedback, and ask for its `result()`; see `Goal`.

    It has no public constructor: `BlockingNode.start` gives one.
    """

    def __init__(self, do: Do, goal: Goal[R, F]) -> None:
        self._do = do
        self._goal = goal

    def __repr__(self) -> str:
        return f"<blocking {self._goal!r}>"

    @property
    def status(self) -> GoalStatus:
        """Where the goal stands now; UNKNOWN before it is accepted."""
        return self._goal.status

    def __enter__(self) -> BlockingGoal[R, F]:
        self._do(lambda _: self._goal.__aenter__(), "`async with node.start(...) as goal`")
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            self._do(lambda _: self._goal.__aexit__(kind, error, trace), "`async with node.start(...) as goal`")
        except ActorError:
            if error is None:  # else what ended the block says more
                raise

    def __iter__(self) -> Iterator[F]:
        return self

    def __next__(self) -> F:
        async def work(_: Node) -> F | _End:
            return await anext(self._goal, _END)

        feedback = self._do(work, "`async for feedback in goal`")
        if isinstance(feedback, _End):
            raise StopIteration
        return feedback

    def result(self) -> R:
        """Wait for the end and give the result. Raises `GoalCanceled` and `GoalAborted`, which carry `.result` and `.reason`."""

        async def work(_: Node) -> R:
            return await self._goal

        return self._do(work, "`await goal`")

    def cancel(self, reason: str = "canceled by its client") -> bool:
        """Ask the server to cancel. True when it began to; False when the goal has ended or the server refuses."""
        return self._do(lambda _: self._goal.cancel(reason), "`await goal.cancel()`")
