"""Chains of nodes that wait for each other across processes, as far as this process knows them. Nothing here sends.

A request carries the chain of the nodes whose handlers hold their inboxes until it is answered, the longest wait first.
"""

from __future__ import annotations

from asyncio import current_task
from typing import Any, NamedTuple, Protocol, runtime_checkable

from actors.actions.server import GoalRequest
from actors.services.peers import Caller, CallId, OpenCall
from actors.services.server import Request
from actors.time.deadlines import Deadlines
from actors.transport.format.extensions import Waiting


class NodesHere(Protocol):
    """Knows the nodes of this process."""

    def identity(self, fqn: str) -> tuple[str, int]:
        """The session and the number of a node of this process, as the network knows them."""
        ...

    def find(self, fqn: str) -> Caller | None:
        """The node, if it is running."""
        ...


@runtime_checkable
class Chained(Protocol):
    """The sender of a request from another process."""

    @property
    def chain(self) -> tuple[Waiting, ...]: ...


class RemoteCaller(NamedTuple):
    """A node of another process that calls a service of this one."""

    fqn: str
    deadlines: Deadlines
    chain: tuple[Waiting, ...]
    """The nodes that wait for the answer."""
    sent: CallId
    """What identifies its call."""

    def call_id(self, service: str, number: int) -> CallId:
        """See `Requester.call_id`: the client has numbered the call itself."""
        return self.sent


class Waits(NamedTuple):
    """What a node of this process waits for."""

    nodes: tuple[Waiting, ...]
    """The nodes on the way, each waiting for the next one."""
    last: OpenCall
    """What the last of them waits for: an answer from another process, or from a node that closes a cycle."""
    cycle: tuple[str, ...]
    """The names of the nodes of a cycle, each waiting for the next one; empty if the way leads to another process."""


def chain_of(here: NodesHere, caller: Caller) -> tuple[Waiting, ...]:
    """The nodes whose handlers wait for the answer to a request that `caller` is about to send, the longest wait first."""
    inbox = caller.inbox
    if inbox.waiter is not None or inbox.task is not current_task(inbox.loop):
        return ()  # it is not a handler that waits
    links: list[Waiting] = []
    following: Any = caller
    while following is not None:
        session, number = here.identity(following.fqn)
        links.insert(0, Waiting(session=session, node_id=number, name=following.fqn))
        current = following.inbox.current
        asker = _asker(current)
        if isinstance(asker, Chained):
            return (*asker.chain, *links)
        following = None if asker is None else here.find(asker.fqn if isinstance(current, Request) else asker.owner)
        if following is not None and following.waits_for is not current:
            break
    return tuple(links)


def _asker(current: object) -> Any:
    """The sender of the request that a handler is working on; None if it is working on none."""
    if isinstance(current, Request):
        return current.caller
    return current.client if isinstance(current, GoalRequest) else None


def waits_of(here: NodesHere, node: Caller, chain: tuple[Waiting, ...]) -> Waits | None:
    """What `node` waits for, as far as this process knows, if the nodes of `chain` wait for `node`. None if it can go on by itself."""
    positions = {(waiting.session, waiting.node_id): index for index, waiting in enumerate(chain)}
    passed: list[Waiting] = []
    last: Any = None
    following: Any = node
    while following is not None:
        awaited = following.waits_for
        if awaited is None or awaited.answered:
            return None
        session, number = here.identity(following.fqn)
        at = positions.get((session, number))
        if at is not None:
            cycle = *(waiting.name for waiting in chain[at:]), *(waiting.name for waiting in passed)
            return Waits(tuple(passed), last or awaited, cycle)
        passed.append(Waiting(session=session, node_id=number, name=following.fqn))
        last, following = awaited, awaited.server.node
    return Waits(tuple(passed), last, ())
