"""Nodes of clients: what a client publishes, serves or carries out is done by hidden nodes, which leave with it."""

from __future__ import annotations

from itertools import count
from typing import TYPE_CHECKING, Any, Final

from actors import ActorError, Child, DeclarationError, Node, Topic, qos
from actors.interfaces import InterfaceError
from cli.web.errors import Refused

if TYPE_CHECKING:
    from actors import Publisher, QoS, System
    from actors.interfaces import Message
    from actors.runtime.unsupervised import UnsupervisedNode

__all__ = ["Guests", "Publications"]

MOST: Final = 256
"""The topics that a client may publish on, and the services and actions that it may serve."""

LATCHED: Final = qos.DEFAULT.replace(depth=1, durability=qos.Durability.TRANSIENT_LOCAL)


class Guests:
    """Lets nodes join a system beside its tree, each under a name of its own."""

    def __init__(self, system: System) -> None:
        self._system = system
        self._numbers = count(1)

    async def join(self, kind: type[Node], *arguments: Any) -> UnsupervisedNode:
        """A new node. Raises `Refused` if it cannot start."""
        try:
            return await self._system.join(Child(kind, name=f"_web_client_{next(self._numbers)}", args=arguments))
        except (ActorError, DeclarationError, InterfaceError) as error:
            raise Refused(str(error)) from None

    async def leave(self, node: UnsupervisedNode) -> None:
        """The end of a node."""
        await self._system.leave(node, "its client has gone")


class Publications:
    """What one client publishes: by one node, which joins with the first topic.

    Invariant: a topic of one type has at most one publisher, which stays until `close`, as the client may come back to it.
    """

    def __init__(self, guests: Guests) -> None:
        self._guests = guests
        self._node: UnsupervisedNode | None = None
        self._publishers: dict[tuple[str, str, bool], Publisher[Any]] = {}

    async def open(self, topic: str, kind: type[Message], *, latch: bool = False, depth: int = 10) -> Publisher[Any]:
        """A publisher; that of before, if the client has had one. Raises `Refused`."""
        key = (topic, kind.__ros_type__, latch)
        if key not in self._publishers:
            if len(self._publishers) >= MOST:
                raise Refused(f"a client publishes on at most {MOST} topics")
            if self._node is None:
                self._node = await self._guests.join(Node)
            offered: QoS = LATCHED if latch else qos.DEFAULT.replace(depth=depth)
            try:
                self._publishers[key] = self._node.node.publisher(Topic(kind, topic), qos=offered)
            except (ActorError, DeclarationError, ValueError) as error:
                raise Refused(f"{topic}: {error}") from None
        return self._publishers[key]

    async def close(self) -> None:
        """Stop publishing."""
        node, self._node = self._node, None
        self._publishers.clear()
        if node is not None:
            await self._guests.leave(node)
