"""The border of a node, or of some nodes: what comes into their lives from outside, and what they send out, for a journal of both.

Without a journal there is no border: every seam tests `Inbox.border` for None, and nothing else happens. See `actors.replay`.
"""

from __future__ import annotations

from collections.abc import Callable
from contextvars import ContextVar, Token
from typing import TYPE_CHECKING, Any, Final, Protocol, TypeVar

if TYPE_CHECKING:
    import asyncio

    from actors.time.ticker import Ticking

T = TypeVar("T")


class Timed(Protocol):
    """A timer of a node."""

    hz: float

    @property
    def inbox(self) -> object:
        """The inbox of the node."""
        ...

    @property
    def label(self) -> str:
        """The handler's name, for reports."""
        ...

    @property
    def handle(self) -> Ticking | None:
        """The source of its ticks; None after its end."""
        ...

    def on_tick(self, k: int, due: float) -> None:
        """Take a tick."""
        ...


class Border(Protocol):
    """The border of one node, or of the nodes of a subtree, which is drawn by the context variable `INSIDE`: code in whose context it is this
    border belongs to a node inside.

    What other code does to a node goes through `enter`, `request` and `goal`; what a node does to others through `send`, `call`, `start_goal` and
    `cancel_goal`.
    """

    def enter(self, kind: str, details: tuple[Any, ...], function: Callable[..., T], *arguments: Any) -> T:
        """Note that something comes in, and call `function`, which takes it in, as code of the node."""
        ...

    def send(self, kind: str, name: str, value: Any) -> None:
        """Note what goes out, or is drawn."""
        ...

    def request(self, submit: Callable[..., Any], server: str, message: Any, caller: Any, timeout: float) -> Any:
        """Take in a request: call `submit(message, caller, timeout)`, and note what becomes of the future of what it returns."""
        ...

    def goal(self, submit: Callable[..., Any], server: str, goal_id: bytes, message: Any, client: Any) -> Any:
        """Take in a request for a goal: call `submit(goal_id, message, client)`, and note what the client is told."""
        ...

    def call(self, server: Any, name: str, message: Any, caller: Any, timeout: float) -> Any:
        """Let a request of the node out, to another node's server, and note what becomes of it."""
        ...

    def start_goal(self, server: Any, name: str, goal_id: bytes, message: Any, follower: Any) -> Any:
        """Let a request for a goal out, and note what its follower is told."""
        ...

    def cancel_goal(self, server: Any, name: str, goal_id: bytes, reason: str) -> Any:
        """Let a request to cancel a goal out, and note what becomes of it."""
        ...

    def tick(self, timer: Timed) -> Callable[[int, float], None]:
        """What a ticker shall call instead of the `on_tick` of the node's next timer."""
        ...

    def uses(self, entry: Any) -> None:
        """Note that the node depends on who serves this name of the graph."""
        ...

    def compute(self, function: Callable[..., T], arguments: tuple[Any, ...]) -> T:
        """The result of offloaded work that runs at once."""
        ...

    def elsewhere(self, name: str, work: Callable[[], Any]) -> asyncio.Future[Any]:
        """A future for the result of the coroutine that `work()` makes, which runs as code of others."""
        ...


INSIDE: Final[ContextVar[Border | None]] = ContextVar("INSIDE", default=None)
"""The border inside of which the present code runs; None for code that belongs to no journaled node."""


class outside:  # a context manager, used like a function
    """A block that runs as code of the system, not of the node in whose handler it happens to be."""

    __slots__ = ("_token",)

    _token: Token[Border | None]

    def __enter__(self) -> None:
        self._token = INSIDE.set(None)

    def __exit__(self, *_: object) -> None:
        INSIDE.reset(self._token)


def asked(question: Callable[..., T], *arguments: Any) -> T:
    """What others answer to a question of the present code. The journal of its node has it, too."""
    border = INSIDE.get()
    return question(*arguments) if border is None else border.compute(question, arguments)
