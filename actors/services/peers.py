"""What the two sides of a call ask of each other, of their nodes and of the graph: the seams of this room.

A server may be an object of this process (`actors.services.server.Server`) or a stand-in for one elsewhere: a client cannot tell them
apart. Actions use the same seams, but for what a goal needs besides.
"""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

from actors.errors import CallCycle, WrongType
from actors.inbox.inbox import Inbox

if TYPE_CHECKING:
    from actors.time.deadlines import Deadlines

__all__ = [
    "Answering", "Awaited", "Caller", "OpenCall", "Registration", "ServedName", "ServiceName", "ServicePeer",
    "refuse_cycle", "refuse_other_type",
]  # fmt: skip

P_co = TypeVar("P_co", covariant=True)


class Caller(Protocol):
    """What a call asks of the node that makes it, and of the node that serves it."""

    incarnation: int
    serving: bool
    waits_for: Awaited | None
    """What the node's present handler waits for; None while it waits for no answer."""

    @property
    def fqn(self) -> str: ...

    @property
    def inbox(self) -> Inbox: ...

    @property
    def thread(self) -> int: ...

    @property
    def deadlines(self) -> Deadlines: ...

    def spawn(self, work: Coroutine[Any, Any, None], *, name: str = "") -> asyncio.Task[None]: ...

    def check_thread(self) -> None: ...

    def service_failed(self, service: str, error: Exception) -> None: ...


class Answering(Protocol):
    """A server of a service or an action, as those who wait for its answer see it."""

    @property
    def node(self) -> Caller | None:
        """The node of this process that answers in its own turn; None for a server elsewhere, of which nothing is known."""
        ...

    @property
    def host(self) -> str:
        """The full name of the node that serves."""
        ...


class Awaited(Protocol):
    """What a handler waits for that holds its node's inbox: the answer to a call, or to the request for a goal."""

    @property
    def server(self) -> Answering: ...

    @property
    def answered(self) -> bool: ...


class OpenCall(Awaited, Protocol):
    """A request that has been submitted.

    `future` is completed exactly once, with the response or an error, at the latest when the call's time is over. A caller that gives up
    cancels it; an answer that comes after that is dropped.
    """

    @property
    def future(self) -> asyncio.Future[Any]: ...


class ServicePeer(Answering, Protocol):
    """What a client asks of a server of its service, here or elsewhere."""

    @property
    def type(self) -> type[Any]:
        """The service type that it serves; a client of another one is refused."""
        ...

    @property
    def concurrent(self) -> int:
        """How many requests it serves in tasks of their own; 0 when they wait for its node's turn."""
        ...

    def submit(self, message: Any, caller: Caller, timeout: float) -> OpenCall:
        """Take a request, which the client has checked to be of the service's request type. Never blocks.

        Raises ValueError when `timeout` is no number of seconds.
        """
        ...


class ServedName(Protocol[P_co]):
    """One service or action name of the graph, as its clients see it."""

    @property
    def name(self) -> str:
        """The full name."""
        ...

    @property
    def server(self) -> P_co | None:
        """Who serves it now; it may have gone after any await."""
        ...

    async def require(self) -> P_co:
        """The server; waits for the first one, but not for one that has ended.

        Raises `NodeRestarting` between two lives of its node, and `NotRunning` when its node has stopped for good.
        """
        ...

    def forget(self, node: str) -> None:
        """`node` will not come back."""
        ...


class ServiceName(ServedName[ServicePeer], Protocol):
    """One service name of the graph, as its clients see it. Those that ROS 2 gives every node are opened by `require`."""

    @property
    def current(self) -> ServiceName:
        """This entry, or the one by its name that has come into the graph after this one had left it."""
        ...

    @property
    def clients(self) -> dict[str, int]:
        """The nodes that are clients here."""
        ...

    def unavailable(self, seconds: float, type: str) -> Exception:
        """The error of a client for whom no server, of the named type, came within `seconds`."""
        ...


class Registration(Protocol):
    """The entry of a server's name in the graph, as the server and its node see it."""

    @property
    def name(self) -> str:
        """The full name."""
        ...

    @property
    def server(self) -> object | None:
        """Who serves the name now."""
        ...

    def pause(self, node: str, incarnation: int) -> None:
        """The server's node has ended; nobody knows yet whether for good."""
        ...

    def close(self, node: str) -> None:
        """The server's node has ended for good."""
        ...

    def withdraw(self) -> None:
        """The server has gone, and may be opened again when somebody asks for it."""
        ...

    def forget(self, node: str) -> None:
        """`node` will not come back."""
        ...


def refuse_cycle(node: Caller, other: Caller | None) -> None:
    """Raise `CallCycle` if `node`, whose handler holds its inbox, is about to wait for `other`, which waits for `node`.

    A node whose answer has come waits no more, also before its task has run again.
    """
    chain: list[str] = [node.fqn]
    while other is not None:
        if other is node:
            raise CallCycle(tuple(chain))
        chain.append(other.fqn)
        awaited = other.waits_for
        other = awaited.server.node if awaited is not None and not awaited.answered else None


def refuse_other_type(name: str, host: str, served: type[Any], client: Caller, asked: type[Any]) -> None:
    """Raise `WrongType` if a service or action is served as one ROS type and asked as another."""
    if served.__ros_type__ != asked.__ros_type__:
        raise WrongType(
            f"{name} is served by {host} as {served.__ros_type__}, and asked by {client.fqn} as {asked.__ros_type__}: "
            "give one of the two another name, or both sides the same type"
        )
