"""What the graph and the connection with other processes know of each other."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple, Protocol

if TYPE_CHECKING:
    from actors.graph.servers import S, ServerEntry
    from actors.topics.peers import PublisherPeer, SubscriptionPeer


class GraphWatcher(Protocol):
    """Is told of every endpoint that joins or leaves the graph, after the graph has changed. Its methods must not raise."""

    def publisher_joined(self, publisher: PublisherPeer) -> None: ...

    def publisher_left(self, publisher: PublisherPeer) -> None: ...

    def subscription_joined(self, subscription: SubscriptionPeer) -> None: ...

    def subscription_left(self, subscription: SubscriptionPeer) -> None: ...

    def server_changed(self, entry: ServerEntry[S]) -> None:
        """The server of this process for a name has been opened, or has gone, for a time or for good."""
        ...

    def server_sought(self, entry: ServerEntry[S]) -> None:
        """A node looks for the server of a service that has none; a standard one has been opened by that."""
        ...


class KnownLink(Protocol):
    """What has been exchanged with another process; see `actors.transport.protocol.Link`."""

    @property
    def session(self) -> str: ...

    @property
    def host(self) -> str: ...

    @property
    def process(self) -> int: ...

    @property
    def sent_bytes(self) -> int: ...

    @property
    def received_bytes(self) -> int: ...

    @property
    def dropped(self) -> int: ...


class NodeElsewhere(NamedTuple):
    """A node of another process, as a snapshot shows it."""

    fqn: str
    """Its fully qualified name."""
    host: str
    """The name or address of its machine; empty if it is not known."""
    process: int
    """The id of its process on that machine; 0 if it is not known."""
    session: str
    """The identity of its process on the network."""
