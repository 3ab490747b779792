"""The boundary around the nodes of which a journal is kept: what their code asks of others passes it. See `actors.replay`."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from contextvars import ContextVar, Token
from typing import TYPE_CHECKING, Final, Protocol, TypeVar

if TYPE_CHECKING:
    import asyncio

T = TypeVar("T")


class Boundary(Protocol):
    """What is around the nodes of a journal, as far as it concerns code that runs: what passes by way of endpoints, timers and lives is the
    subject of interceptors."""

    def send(self, kind: str, name: str, value: object) -> None:
        """Note what the nodes' code gives away."""
        ...

    def compute(self, function: Callable[..., T], arguments: tuple[object, ...]) -> T:
        """Return what `function(*arguments)` returns, which depends on others."""
        ...

    def elsewhere(self, name: str, work: Callable[[], Coroutine[object, None, object]]) -> asyncio.Future[object]:
        """Return a future for the result of the coroutine that `work()` makes, which runs as code of others."""
        ...


BOUNDARY: Final[ContextVar[Boundary | None]] = ContextVar("BOUNDARY", default=None)
"""The boundary around the node whose code runs; None for code that belongs to no journaled node."""


class outside:  # a context manager, used like a function
    """A block that runs as code of the system, not of the node in whose handler it happens to be."""

    __slots__ = ("_token",)

    _token: Token[Boundary | None]

    def __enter__(self) -> None:
        self._token = BOUNDARY.set(None)

    def __exit__(self, *_: object) -> None:
        BOUNDARY.reset(self._token)


def asked(question: Callable[..., T], *arguments: object) -> T:
    """What others answer to a question of the present code. The journal of its node has it, too."""
    boundary = BOUNDARY.get()
    return question(*arguments) if boundary is None else boundary.compute(question, arguments)
