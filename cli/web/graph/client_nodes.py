"""What clients do in the graph: they publish by one hidden node, and serve and carry out by others, which leave with them."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from itertools import count
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from actors import ActorError, Child, DeclarationError, Node, QoS, System, Topic, qos
from actors.interfaces import InterfaceError, Message
from cli.web.clients.errors import Refused

if TYPE_CHECKING:
    from actors.runtime.joined import JoinedNode
    from actors.typing import Publisher

MOST: Final = 256
"""The topics that a client may publish on, and the services and actions that it may serve."""

_numbers = count(1)

LATCHED: Final = qos.DEFAULT.replace(depth=1, durability=qos.Durability.TRANSIENT_LOCAL)


class _Offer(NamedTuple):
    """What a publisher offers."""

    topic: str
    type: str
    latch: bool
    depth: int


class ClientNodes:
    """Lets nodes join a system beside its tree, each under a name of its own, and publishes for clients.

    A node for each client that publishes would cost 0.1 MB that no transport gives back. Invariant: `_publishers` holds the publishers of which
    there are users, and how many; a topic that several clients publish alike has one.
    """

    def __init__(self, system: System) -> None:
        self._system = system
        self._numbers = count(1)
        self._publishing: JoinedNode | None = None
        self._joining = asyncio.Lock()
        self._publishers: dict[_Offer, tuple[Publisher[Any], int]] = {}

    async def publisher(self, offer: _Offer, kind: type[Message]) -> Publisher[Any]:
        """A publisher, to be given back by `release`. Raises `Refused`."""
        async with self._joining:
            if self._publishing is None:
                self._publishing = await self._join(Node, f"_web_publishing_{next(_numbers)}")
        node = self._publishing.node
        publisher, users = self._publishers.get(offer, (None, 0))
        if publisher is None:
            offered: QoS = LATCHED if offer.latch else qos.DEFAULT.replace(depth=offer.depth)
            try:
                publisher = node.publisher(Topic(kind, offer.topic), qos=offered)
            except (ActorError, DeclarationError, ValueError) as error:
                raise Refused(f"{offer.topic}: {error}") from None
        self._publishers[offer] = publisher, users + 1
        return publisher

    def release(self, offer: _Offer) -> None:
        """Close a publisher that nobody else uses."""
        publisher, users = self._publishers.pop(offer)
        if users > 1:
            self._publishers[offer] = publisher, users - 1
        else:
            publisher.close()

    async def join(self, kind: type[Node], *arguments: Any) -> JoinedNode:
        """A new node. Raises `Refused` if it cannot start."""
        return await self._join(kind, f"_web_client_{next(self._numbers)}", *arguments)

    async def serve(self, kind: type[Node], check: Callable[[], None]) -> JoinedNode:
        """A new node that serves something. Raises `Refused` if it cannot start, and what `check` raises: it is called when nodes that were
        asked for before have started, so that of two for the same name the second sees the first."""
        async with self._joining:
            check()
            return await self.join(kind)

    async def close(self) -> None:
        """Publish nothing any more."""
        if self._publishing is not None:
            await self.leave(self._publishing)

    async def _join(self, kind: type[Node], name: str, *arguments: Any) -> JoinedNode:
        try:
            return await self._system.join(Child(kind, name=name, args=arguments))
        except (ActorError, DeclarationError, InterfaceError) as error:
            raise Refused(str(error)) from None

    async def leave(self, node: JoinedNode) -> None:
        """The end of a node."""
        await self._system.leave(node, "its client has gone")


class Publications:
    """What one client publishes.

    Invariant: a topic of one type has at most one publisher, latched or not, which stays until `close`, as the client may come back to it.
    """

    def __init__(self, nodes: ClientNodes) -> None:
        self._nodes = nodes
        self._publishers: dict[tuple[str, str, bool], tuple[_Offer, Publisher[Any]]] = {}

    async def open(self, topic: str, kind: type[Message], *, latch: bool = False, depth: int = 10) -> Publisher[Any]:
        """A publisher; that of before, if the client has had one. Raises `Refused`."""
        key = (topic, kind.__ros_type__, latch)
        if key not in self._publishers:
            if len(self._publishers) >= MOST:
                raise Refused(f"a client publishes on at most {MOST} topics")
            offer = _Offer(*key, 0 if latch else depth)
            self._publishers[key] = offer, await self._nodes.publisher(offer, kind)
        return self._publishers[key][1]

    def close(self) -> None:
        """Stop publishing."""
        for offer, _ in self._publishers.values():
            self._nodes.release(offer)
        self._publishers.clear()
