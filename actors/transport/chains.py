"""Call cycles over several processes.

A request carries the chain of the nodes whose handlers hold their inboxes until it is answered, the longest wait first. A server whose node is
in the chain, or waits for a node in it, could never get to the request: it refuses it at once, as `refuse_cycle` does within one process.
"""

from __future__ import annotations

from asyncio import current_task
from typing import TYPE_CHECKING, NamedTuple, Protocol, cast

from actors.services.server import Request
from actors.transport.format.extensions import Waiting

if TYPE_CHECKING:
    from actors.services.introspection import CallId
    from actors.services.peers import Caller
    from actors.time.deadlines import Deadlines

__all__ = ["NodeNumbers", "RemoteCaller", "chain_of", "cycle_through"]


class NodeNumbers(Protocol):
    """Knows how the nodes of this process are called on the network."""

    def identity(self, fqn: str) -> tuple[str, int]:
        """The session and the number of a node of this process."""
        ...


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


def chain_of(numbers: NodeNumbers, caller: Caller) -> tuple[Waiting, ...]:
    """The nodes whose handlers wait for the answer to a request that `caller` is about to send, the longest wait first."""
    inbox = caller.inbox
    if inbox.waiter is not None or inbox.task is not current_task(inbox.loop):
        return ()  # it is not a handler that waits
    links: list[Waiting] = []
    while True:
        session, number = numbers.identity(caller.fqn)
        links.insert(0, Waiting(session=session, node_id=number, name=caller.fqn))
        current = caller.inbox.current
        if not isinstance(current, Request):
            return tuple(links)
        if isinstance(current.caller, RemoteCaller):
            return (*current.caller.chain, *links)
        caller = cast("Caller", current.caller)
        if caller.waits_for is not current:
            return tuple(links)


def cycle_through(numbers: NodeNumbers, node: Caller, chain: tuple[Waiting, ...]) -> tuple[str, ...] | None:
    """The nodes of the cycle that a request with this chain would close at `node`, each waiting for the next one; None if there is none."""
    positions = {(waiting.session, waiting.node_id): index for index, waiting in enumerate(chain)}
    waits: list[str] = []
    at: int | None = None
    while positions and (awaited := node.waits_for) is not None and not awaited.answered:
        at = positions.get(numbers.identity(node.fqn))
        if at is not None:
            break
        waits.append(node.fqn)
        following = awaited.server.node
        if following is None:  # it is in another process
            at = positions.get(getattr(awaited.server, "identity", ("", 0)))
            break
        node = following
    return None if at is None else (*(waiting.name for waiting in chain[at:]), *waits)
