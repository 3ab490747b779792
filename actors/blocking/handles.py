"""The streams and goals of a `BlockingNode`: their methods block the calling thread until the event loop has the answer."""

from __future__ import annotations

from collections.abc import Callable, Coroutine, Iterator
from types import TracebackType
from typing import Generic, Protocol, TypeVar

from actors.actions.client import Goal
from actors.actions.goals import GoalStatus
from actors.checks import NoPublicConstructor
from actors.errors import ActorError
from actors.interfaces.message import F, M, R
from actors.runtime.node import Node
from actors.topics.stream import Stream

T = TypeVar("T")


class Do(Protocol):
    """Runs a coroutine function of the node in its event loop and waits for the result. `remedy` says what to await in an event loop."""

    def __call__(self, work: Callable[[Node], Coroutine[object, None, T]], remedy: str) -> T: ...


class _End:
    """Marks the end of a stream or of a goal's feedback."""


_END = _End()


class BlockingStream(Generic[M], metaclass=NoPublicConstructor):
    """A subscription that a thread iterates, as a coroutine iterates a `Stream`. It ends with `close()` or with its node.

    It has no public constructor: `BlockingNode.subscribe` gives one.
    """

    def __init__(self, do: Do, stream: Stream[M]) -> None:
        self._do = do
        self._stream = stream

    def __repr__(self) -> str:
        return f"<blocking {self._stream!r}>"

    @property
    def latest(self) -> M | None:
        """The newest message that arrived, also if it was not read yet; None before the first."""
        return self._stream.latest

    def next(self, timeout: float | None = None) -> M:
        """Wait for the next message. Raises `CallTimeout` after `timeout` seconds without one, `Ended` once the stream has ended."""
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
        """End the subscription."""

        async def work(_: Node) -> None:
            self._stream.close()

        self._do(work, "`stream.close()`")


class BlockingGoal(Generic[R, F], metaclass=NoPublicConstructor):
    """One goal for a thread: enter it, iterate it for feedback, and wait for its `result()`; see `Goal`.

    It has no public constructor: `BlockingNode.send_goal` gives one.
    """

    def __init__(self, do: Do, goal: Goal[R, F]) -> None:
        self._do = do
        self._goal = goal

    def __repr__(self) -> str:
        return f"<blocking {self._goal!r}>"

    @property
    def status(self) -> GoalStatus:
        """The present status of the goal; UNKNOWN before it is accepted."""
        return self._goal.status

    def __enter__(self) -> BlockingGoal[R, F]:
        self._do(lambda _: self._goal.__aenter__(), "`async with node.send_goal(...) as goal`")
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            self._do(lambda _: self._goal.__aexit__(kind, error, trace), "`async with node.send_goal(...) as goal`")
        except ActorError:
            if error is None:  # else the error of the block is raised
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
        """Wait for the end and return the result. Raises `GoalCanceled` and `GoalAborted`, which have `.result` and `.reason`."""

        async def work(_: Node) -> R:
            return await self._goal

        return self._do(work, "`await goal`")

    def cancel(self, reason: str = "canceled by its client") -> bool:
        """Ask the server to cancel the goal. True if it began to; False if the goal has ended or the server refuses."""
        return self._do(lambda _: self._goal.cancel(reason), "`await goal.cancel()`")
