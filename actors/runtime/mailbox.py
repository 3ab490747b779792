"""What one incarnation of a node leaves to the next: its inbox, and the queues and servers whose messages wait for it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any, Protocol

from actors.inbox.inbox import Inbox
from actors.topics.handler import ConcurrentSubscription, HandlerSubscription

if TYPE_CHECKING:
    from actors.actions.server import ActionServer
    from actors.runtime.core import Core
    from actors.runtime.timers import TimerRecord
    from actors.services.server import Server

__all__ = ["Mailbox"]


class GraphEntry(Protocol):
    """A name in the graph, as far as a node's end matters to it."""

    def forget(self, node: str) -> None:
        """`node` will not come back."""
        ...


class Mailbox:
    """What outlives an incarnation: the inbox, and the subscriptions and servers whose messages wait for the next life."""

    __slots__ = (
        "actions",
        "asked_state",
        "core",
        "feeds",
        "inbox",
        "incarnation",
        "saved",
        "services",
        "timers",
        "used",
    )

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self.timers: dict[str, TimerRecord] = {}
        self.inbox = Inbox(loop)
        self.incarnation = 0
        self.core: Core | None = None
        """The incarnation that works from this mailbox now."""
        self.asked_state: str | None = None
        """The primary state that was last asked of a lifecycle node."""
        self.saved: Any = None
        """What the node left for its next incarnation."""
        self.feeds: list[HandlerSubscription[Any]] = []
        self.services: dict[str, Server] = {}
        self.actions: dict[str, ActionServer] = {}
        self.used: set[GraphEntry] | None = None
        """What ended endpoints of this node used, as far as it is known: see `forget`."""

    def note(self, entries: Iterable[GraphEntry]) -> None:
        """Remember what endpoints used that are about to end."""
        if self.used is None:
            self.used = set()
        self.used.update(entries)

    def park(self, fqn: str, error: Callable[[], Exception]) -> None:
        """The incarnation has ended: fail who waits for an answer, keep the messages, and let callers know."""
        incarnation = self.incarnation
        inbox = self.inbox
        for feed in self.feeds:
            if isinstance(feed, ConcurrentSubscription):
                feed.pause()
        servers: list[Server | ActionServer] = [*self.services.values(), *self.actions.values()]
        for server in servers:
            server.fail_all(error)
            if server.entry.server is server:
                server.entry.pause(fqn, incarnation)
        inbox.clear(keep=lambda item: isinstance(item, HandlerSubscription))
        inbox.on_error = inbox.on_holding = None
        inbox.leave()

    def work_on(self) -> None:
        """A handler failed and the node goes on: what waits behind it is not to wait for the next message."""
        for feed in self.feeds:
            if isinstance(feed, ConcurrentSubscription):
                feed.work()

    def sweep(self, core: Core) -> None:
        """Forget what the last incarnation took and served and this one, `core`, does not."""
        if self.incarnation == 1:
            return
        gone = [feed for feed in self.feeds if feed.node is not core]
        core.system.lost(core.fqn, sum(len(feed.messages) for feed in gone))
        for feed in gone:
            feed.close()
        self.inbox.clear(keep=lambda item: not isinstance(item, HandlerSubscription) or item.node is core)
        self.feeds = [feed for feed in self.feeds if feed.node is core]
        held: tuple[dict[str, Any], ...] = (self.services, self.actions)
        for servers in held:
            for name, server in list(servers.items()):
                if server.node is not core:
                    del servers[name]
                    if server.entry.server is None:
                        server.entry.close(core.fqn)

    def close(self, fqn: str) -> int:
        """There will be no next life: leave the graph. Answers how many messages waited for one."""
        dead_letters = sum(len(feed.messages) for feed in self.feeds)
        servers: list[Server | ActionServer] = [*self.services.values(), *self.actions.values()]
        self.note(feed.entry for feed in self.feeds)
        self.note(server.entry for server in servers)
        for feed in self.feeds:
            feed.close()
        self.feeds.clear()
        for server in servers:
            if server.entry.server is None:
                server.entry.close(fqn)
        self.services.clear()
        self.actions.clear()
        self.inbox.clear(keep=lambda item: False)
        return dead_letters

    def forget(self, fqn: str) -> None:
        """Nobody will ask for this node again: after `close`, take out of the graph what was there because of it."""
        for entry in self.used or ():
            entry.forget(fqn)
