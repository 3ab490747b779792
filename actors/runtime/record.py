"""`NodeRecord`: one node over all its lives: its identity, the messages that wait for it, and its counts."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any, Final, Protocol

from actors.topics.handler import ConcurrentSubscription, HandlerSubscription

if TYPE_CHECKING:
    from actors.actions.server import ActionServer
    from actors.inbox.inbox import Inbox
    from actors.inbox.load import Load
    from actors.names.identity import Identity
    from actors.node.node import Node
    from actors.runtime.incarnation import Incarnation
    from actors.runtime.timers import TimerRecord
    from actors.services.server import Server
    from actors.supervision.declarations import Child
    from actors.supervision.refs import ChildState

__all__ = ["BESIDE", "KEPT_RESTARTS", "Books", "NodeRecord"]

KEPT_RESTARTS: Final = 100
"""How many restarts of one node are kept, with time and reason."""

BESIDE: Final = "guests"
"""The first part of the path of every node beside the tree."""


class Books(Protocol):
    """Where the states of all nodes are stored: with those that start and stop them."""

    def state_of(self, path: tuple[str, ...], /) -> ChildState: ...


class GraphEntry(Protocol):
    """A name in the graph, as far as a node's end matters to it."""

    def forget(self, node: str) -> None:
        """`node` will not come back."""
        ...


class NodeRecord:
    """One node, by its place in the tree, over all its lives: what outlives a life, and what reports and tools ask for.

    It has no public constructor: `System.nodes` holds them.

    Invariants:

    - `life` is the one incarnation that works from this record, or None. It is set when an incarnation is made and cleared when that one is
      released, so two incarnations never hold endpoints or take messages under one name.
    - `incarnation` counts the lives and never falls. `life.incarnation` equals it.
    - `state` is not stored here: it is what the books of the node's supervisor say.
    - Between two lives the subscriptions and servers stay here with their messages; nobody runs them. After `close` there are none.
    """

    __slots__ = (
        "_books",
        "actions",
        "asked_state",
        "child",
        "ended_at",
        "identity",
        "inbox",
        "incarnation",
        "life",
        "node_class",
        "restart_count",
        "restarts",
        "saved",
        "services",
        "subscriptions",
        "timers",
        "used",
    )

    def __init__(self, child: Child, identity: Identity, books: Books, inbox: Inbox) -> None:
        self._books = books
        self.child = child
        self.identity = identity
        self.inbox = inbox
        self.incarnation = 0
        """How many lives have begun; the number of the present or last one."""
        self.life: Incarnation | None = None
        self.node_class: type | None = None
        """The class of the last node object that became ready."""
        self.restarts: list[tuple[float, str]] = []
        """(seconds on the system's clock, why) of the newest ends that a restart follows or followed, at most `KEPT_RESTARTS`."""
        self.restart_count = 0
        """How many there were in all."""
        self.ended_at: float | None = None
        """When its last life ended, seconds on the event loop's clock; None before."""
        self.asked_state: str | None = None
        """The primary state that was last asked of a lifecycle node."""
        self.saved: Any = None
        """What the node left for its next incarnation."""
        self.timers: dict[str, TimerRecord] = {}
        self.subscriptions: list[HandlerSubscription[Any]] = []
        self.services: dict[str, Server] = {}
        self.actions: dict[str, ActionServer] = {}
        self.used: set[GraphEntry] | None = None
        """What ended endpoints of this node used, as far as it is known: see `forget`."""

    def __repr__(self) -> str:
        return f"<record of {self.identity.fqn}, {self.state}, incarnation {self.incarnation}>"

    @property
    def path(self) -> tuple[str, ...]:
        """Where the node stands in the tree, from the root to it."""
        return self.identity.path

    @property
    def state(self) -> ChildState:
        """starting, running, stopping (its end was asked for, or it cleans up), restarting or stopped (for good)."""
        return self._books.state_of(self.identity.path)

    @property
    def supervised(self) -> bool:
        """Whether it is a node of the tree, and not one beside it."""
        return self.identity.path[0] != BESIDE

    @property
    def running(self) -> Incarnation | None:
        """The present incarnation once it has become ready, until it has ended; else None."""
        life = self.life
        return life if life is not None and life.phase == "running" else None

    @property
    def node(self) -> Node | None:
        """The node object of the `running` incarnation, or None."""
        life = self.running
        return None if life is None else life.node

    @property
    def load(self) -> Load:
        """How busy the node is: handler times, and how long what comes waits for its turn."""
        return self.inbox.load

    def note_restart(self, at: float, why: str) -> None:
        """The node has ended, and a restart follows."""
        self.restart_count += 1
        self.restarts.append((at, why))
        del self.restarts[:-KEPT_RESTARTS]

    def note(self, entries: Iterable[GraphEntry]) -> None:
        """Remember what endpoints used that are about to end."""
        if self.used is None:
            self.used = set()
        self.used.update(entries)

    # -- between two lives --------------------------------------------------------------------------------------------------

    def park(self, error: Callable[[], Exception]) -> None:
        """The incarnation has ended: fail those who wait for an answer, keep the messages, and let callers know."""
        for subscription in self.subscriptions:
            if isinstance(subscription, ConcurrentSubscription):
                subscription.pause()
        for server in self._servers():
            server.fail_all(error)
            if server.entry.server is server:
                server.entry.pause(self.identity.fqn, self.incarnation)
        inbox = self.inbox
        inbox.clear(keep=lambda item: isinstance(item, HandlerSubscription))
        inbox.leave()

    def work_on(self) -> None:
        """A handler failed and the node goes on: what waits behind it is not to wait for the next message."""
        for subscription in self.subscriptions:
            if isinstance(subscription, ConcurrentSubscription):
                subscription.work()

    def sweep(self, life: Incarnation) -> int:
        """Close what the last incarnation took and served and this one, `life`, does not. Returns how many messages that has cost."""
        if self.incarnation == 1:
            return 0
        gone = [each for each in self.subscriptions if each.node is not life]
        lost = sum(len(each.messages) for each in gone)
        for subscription in gone:
            subscription.close()
        self.inbox.clear(keep=lambda item: not isinstance(item, HandlerSubscription) or item.node is life)
        self.subscriptions = [each for each in self.subscriptions if each.node is life]
        held: tuple[dict[str, Any], ...] = (self.services, self.actions)
        for servers in held:
            for name, server in list(servers.items()):
                if server.node is not life:
                    del servers[name]
                    if server.entry.server is None:
                        server.entry.close(self.identity.fqn)
        return lost

    def close(self) -> int:
        """There will be no next life: leave the graph. Returns how many messages waited for one."""
        dead_letters = sum(len(each.messages) for each in self.subscriptions)
        servers = self._servers()
        self.note(each.entry for each in self.subscriptions)
        self.note(server.entry for server in servers)
        for subscription in self.subscriptions:
            subscription.close()
        self.subscriptions.clear()
        for server in servers:
            if server.entry.server is None:
                server.entry.close(self.identity.fqn)
        self.services.clear()
        self.actions.clear()
        self.inbox.clear(keep=lambda item: False)
        return dead_letters

    def forget(self) -> None:
        """Nobody will ask for this node again: after `close`, take out of the graph what was there because of it."""
        for entry in self.used or ():
            entry.forget(self.identity.fqn)

    def _servers(self) -> list[Server | ActionServer]:
        return [*self.services.values(), *self.actions.values()]
