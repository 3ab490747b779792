"""The Protocols between a client, a server, their nodes and the graph.

A server is either an object of this process (`actors.services.server.Server`) or an object that represents one of another process;
clients treat both alike. Actions use these Protocols too, and add their own in `actors.actions.peers`.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Collection, Coroutine, Mapping
from enum import IntEnum
from hashlib import blake2b
from typing import Any, Protocol, TypeAlias, TypeVar, runtime_checkable

from actors.errors import CallCycle, WrongType
from actors.inbox.inbox import Inbox
from actors.interfaces.foreign import difference
from actors.interfaces.message import Message, ServiceType
from actors.time.deadlines import Deadlines

CallId = tuple[bytes, int]
"""The identifier of a client, 16 bytes, and the number of one of its calls. Both ends of a call give the same."""


class CallStep(IntEnum):
    """A step of a call, by the numbers of `service_msgs/msg/ServiceEventInfo`."""

    REQUEST_SENT = 0
    REQUEST_RECEIVED = 1
    RESPONSE_SENT = 2
    RESPONSE_RECEIVED = 3


def caller_id(node: str, service: str) -> bytes:
    """The identifier of the client of a service in a node of this process."""
    return blake2b(f"{node} {service}".encode(), digest_size=16).digest()


P_co = TypeVar("P_co", covariant=True)


class Requester(Protocol):
    """What a server requires of the node that calls it, in this process or another."""

    @property
    def fqn(self) -> str: ...

    @property
    def deadlines(self) -> Deadlines: ...

    def call_id(self, service: str, number: int) -> CallId:
        """What identifies its call of `service` that the server counts as `number`."""
        ...


class Caller(Requester, Protocol):
    """What a call requires of the node that makes it and of the node that serves it."""

    incarnation: int
    serving: bool
    waits_for: Awaited | None
    """The call or goal request that the node's current handler waits for; None if it waits for none."""

    @property
    def inbox(self) -> Inbox: ...

    @property
    def thread(self) -> int: ...

    def create_task(self, work: Coroutine[object, None, None], *, name: str = "") -> asyncio.Task[None]: ...

    def check_thread(self) -> None: ...

    def service_failed(self, service: str, error: Exception) -> None: ...

    def service_took_long(self, service: str, seconds: float) -> None: ...

    def cycle_refused(self, error: CallCycle) -> None:
        """Called with the error for its call, or goal, that would wait for itself, before that is raised."""
        ...


class Answering(Protocol):
    """A server of a service or an action, as seen by the nodes that wait for its answer."""

    @property
    def node(self) -> Caller | None:
        """The node of this process that answers one request after another; None for a server of another process, whose state is unknown."""
        ...

    @property
    def host(self) -> str:
        """The fully qualified name of the node that serves."""
        ...


@runtime_checkable
class Elsewhere(Protocol):
    """A server of another process, which is the only one that knows what its node waits for."""

    def suspect(self, caller: Caller, node: Caller) -> None:
        """`caller`, whose handler holds its inbox, is about to wait for `node`, which waits for this server, perhaps by way of others.

        Finds out whether the server waits for `caller`: then a call of the cycle fails with `CallCycle`. Raises it if it is known at once.
        """
        ...


class Awaited(Protocol):
    """The answer that a handler waits for while it holds its node's inbox: that of a call or of a goal request."""

    @property
    def server(self) -> Answering: ...

    @property
    def answered(self) -> bool: ...


class OpenCall(Awaited, Protocol):
    """A submitted request.

    `future` is completed exactly once, with the response or an error, before the timeout of the call at the latest. A caller that gives up
    cancels it; a later answer is dropped.
    """

    @property
    def future(self) -> asyncio.Future[Any]: ...


class ServiceCall(OpenCall, Protocol):
    """A submitted call of a service."""

    @property
    def call_id(self) -> CallId:
        """What identifies the call at both of its ends."""
        ...


class ServicePeer(Answering, Protocol):
    """What a client requires of a server, in this process or another."""

    @property
    def type(self) -> type[Any]:
        """The service type that it serves. Clients of another type are refused."""
        ...

    @property
    def concurrent(self) -> int:
        """The number of requests that it serves at once in tasks of their own; 0 if they are served one after another in the node's
        inbox."""
        ...

    @property
    def calls(self) -> int:
        """The number of requests that it has been given in this process."""
        ...

    def open(self) -> Collection[OpenCall]:
        """Those of them that have not been answered."""
        ...

    def submit(self, message: Message, caller: Caller, timeout: float) -> ServiceCall:
        """Accept a request, whose type the client has checked. Never blocks.

        Raises ValueError if `timeout` is not a valid number of seconds.
        """
        ...


Served: TypeAlias = "tuple[type[ServiceType[Any, Any]], Callable[[Any], Coroutine[object, None, Message]]]"
"""The type of a service, and the coroutine function that answers its requests."""

Submit: TypeAlias = "Callable[[ServicePeer, Message, Caller, float], ServiceCall]"
"""Sends a request of a node, the third argument, to a server; else as `ServicePeer.submit`."""


class ServedName(Protocol[P_co]):
    """One service or action name of the graph, as seen by its clients."""

    @property
    def name(self) -> str:
        """The fully qualified name."""
        ...

    @property
    def server(self) -> P_co | None:
        """The present server, or None. It may change at any await."""
        ...

    async def require(self) -> P_co:
        """Return the server. Waits for the first server of the name, but not for one that has ended.

        Raises `NodeRestarting` between two incarnations of its node, and `NotRunning` if its node has stopped for good.
        """
        ...

    def meant(self) -> str:
        """``; did you mean '/add'?`` if something of nearly this name is served; else empty."""
        ...

    def forget(self, node: str) -> None:
        """Forget the node of this name, which has ended for good."""
        ...


class ServiceName(ServedName[ServicePeer], Protocol):
    """One service name of the graph, as seen by its clients. `require` opens the services that ROS 2 gives every node."""

    @property
    def current(self) -> ServiceName:
        """This entry, or the entry that has replaced it if its name has left the graph and been added again."""
        ...

    @property
    def clients(self) -> dict[str, int]:
        """The names of the nodes that are clients of this service."""
        ...

    def unavailable(self, seconds: float, type: str) -> Exception:
        """The error for a client that has found no server of this type within `seconds`."""
        ...


class Registration(Protocol):
    """The graph's entry for the name of a server, as seen by the server and its node."""

    @property
    def name(self) -> str:
        """The fully qualified name."""
        ...

    @property
    def server(self) -> object | None:
        """The present server of the name, or None."""
        ...

    @property
    def clients(self) -> Mapping[str, int]:
        """The nodes that are clients of the name."""
        ...

    def pause(self, node: str, incarnation: int) -> None:
        """Record that the server's node has ended. It may be started again."""
        ...

    def close(self, node: str) -> None:
        """Record that the server's node has ended for good."""
        ...

    def withdraw(self) -> None:
        """Remove the server, which may be opened again on demand."""
        ...

    def forget(self, node: str) -> None:
        """Forget the node of this name, which has ended for good."""
        ...


def refuse_cycle(node: Caller, other: Caller | None) -> None:
    """Raise `CallCycle` if `node`, whose handler holds its inbox, would wait for `other` while `other` waits for `node`.

    A node whose answer has arrived no longer counts as waiting, even before its task has resumed.
    """
    chain: list[str] = [node.fqn]
    first = other
    while other is not None:
        if other is node:
            error = CallCycle(tuple(chain))
            node.cycle_refused(error)
            raise error
        chain.append(other.fqn)
        awaited = other.waits_for
        if awaited is None or awaited.answered:
            return
        other = awaited.server.node
        if other is None and first is not None and isinstance(awaited.server, Elsewhere):
            awaited.server.suspect(node, first)


def refuse_other_type(name: str, host: str, served: type[Any], client: Caller, asked: type[Any]) -> None:
    """Raise `WrongType` if the ROS type of the server differs from that of the client."""
    if (unlike := difference(served, asked)) is not None:
        raise WrongType(
            f"{name} is served by {host} as {unlike[0]}, and asked by {client.fqn} as {unlike[1]}: "
            "give one of the two another name, or both sides the same type"
        )
