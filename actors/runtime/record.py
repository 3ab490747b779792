"""`NodeRecord`: one node over all its lives, with its identity, the messages that wait for it, and its counts; `Directory`: those of a system."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any, Final, Protocol

from actors.errors import DeclarationError
from actors.inbox.inbox import Inbox
from actors.runtime.options import identity_of
from actors.runtime.stall import Runner
from actors.suggest import did_you_mean
from actors.topics.handler import ConcurrentSubscription, HandlerSubscription

if TYPE_CHECKING:
    from actors.actions.server import ActionServer
    from actors.inbox.load import Load
    from actors.names.identity import Identity
    from actors.runtime.incarnation import Incarnation
    from actors.runtime.node import Node
    from actors.runtime.options import RunOptions
    from actors.runtime.stall import StallWatch
    from actors.runtime.timers import TimerRecord
    from actors.services.server import Server
    from actors.supervision.child import Child
    from actors.supervision.refs import ChildState

KEPT_RESTARTS: Final = 100
"""How many restarts of one node are kept with their time and reason."""


class Books(Protocol):
    """The source of the states of all nodes, which the supervisors keep."""

    def state_of(self, path: tuple[str, ...], /) -> ChildState: ...
    def holds(self, path: tuple[str, ...], /) -> bool: ...


class GraphEntry(Protocol):
    """A topic, service or action in the graph, as `NodeRecord.forget` uses it."""

    def forget(self, node: str) -> None:
        """Remove all that is kept for `node`, which will not come back."""
        ...


class NodeRecord:
    """One node, by its place in the tree, over all its lives: the state that outlives a life, and the figures for reports and tools.

    It has no public constructor: `System.nodes` holds them.

    Invariants:

    - `life` is the one incarnation that uses this record, or None. It is set when an incarnation is made and cleared when that one is
      released, so two incarnations never hold endpoints or take messages under one name.
    - `incarnation` counts the lives and never falls; `life.incarnation` equals it.
    - `state` is not stored here: the node's supervisor keeps it.
    - Between two lives the subscriptions, with their messages, and the servers stay here, and no handler runs. After `close` it has none.
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
        "process",
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
        self.process = 0
        """The id of the process in which the node runs or has run last; 0 for this process."""
        self.incarnation = 0
        """The number of the present or last life, from 1; 0 before the first."""
        self.life: Incarnation | None = None
        self.node_class: type | None = None
        """The class of the last node object that became ready."""
        self.restarts: list[tuple[float, str]] = []
        """The newest `KEPT_RESTARTS` ends that led to a restart: (seconds on the system's clock, reason)."""
        self.restart_count = 0
        """How many ends led to a restart, in all."""
        self.ended_at: float | None = None
        """When its last life ended, seconds on the event loop's clock; None before."""
        self.asked_state: str | None = None
        """The primary state that was last requested of a lifecycle node; None before the first request."""
        self.saved: Any = None
        """The state that the node left for its next incarnation by `checkpoint` or `handover`; None without any."""
        self.timers: dict[str, TimerRecord] = {}
        self.subscriptions: list[HandlerSubscription[Any]] = []
        self.services: dict[str, Server] = {}
        self.actions: dict[str, ActionServer] = {}
        self.used: set[GraphEntry] | None = None
        """The graph entries that endpoints of this node used and left; see `forget`. None instead of an empty set."""

    def __repr__(self) -> str:
        return f"<record of {self.identity.fqn}, {self.state}, incarnation {self.incarnation}>"

    @property
    def path(self) -> tuple[str, ...]:
        """The path of the node in the tree, from the root to the node."""
        return self.identity.path

    @property
    def state(self) -> ChildState:
        """ "starting", "running", "stopping" (its end was asked for, or it cleans up), "restarting", or "stopped" for good."""
        return self._books.state_of(self.identity.path)

    @property
    def running(self) -> Incarnation | None:
        """The present incarnation from the moment it is ready until it has ended; else None."""
        life = self.life
        return life if life is not None and life.phase == "running" else None

    @property
    def node(self) -> Node | None:
        """The node object of the `running` incarnation, or None."""
        life = self.running
        return None if life is None else life.node

    @property
    def load(self) -> Load:
        """The measured load of the node: times of its handlers, and waiting times in its inbox."""
        return self.inbox.load

    def note_restart(self, at: float, why: str) -> None:
        """Count an end that leads to a restart. `at` is in seconds on the system's clock."""
        self.restart_count += 1
        self.restarts.append((at, why))
        del self.restarts[:-KEPT_RESTARTS]

    def note(self, entries: Iterable[GraphEntry]) -> None:
        """Remember the graph entries of endpoints that are about to end, for `forget`."""
        if self.used is None:
            self.used = set()
        self.used.update(entries)

    # -- between two lives --------------------------------------------------------------------------------------------------

    def park(self, error: Callable[[], Exception]) -> None:
        """Suspend the endpoints after the end of an incarnation: waiting callers get `error()`, messages of subscriptions are kept."""
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
        """Let concurrent subscriptions go on with their waiting messages, after an error that did not end the node."""
        for subscription in self.subscriptions:
            if isinstance(subscription, ConcurrentSubscription):
                subscription.work()

    def sweep(self, life: Incarnation) -> int:
        """Close the subscriptions and servers of the last incarnation that `life` has not opened. Returns how many messages were lost."""
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
        """Close all endpoints, because there will be no next life. Returns how many messages waited for one."""
        dead_letters = 0
        if self.subscriptions:
            dead_letters = sum(len(each.messages) for each in self.subscriptions)
            self.note(each.entry for each in self.subscriptions)
            for subscription in self.subscriptions:
                subscription.close()
            self.subscriptions.clear()
        if servers := self._servers():
            self.note(server.entry for server in servers)
            for server in servers:
                if server.entry.server is None:
                    server.entry.close(self.identity.fqn)
            self.services.clear()
            self.actions.clear()
        self.inbox.clear(keep=lambda item: False)
        return dead_letters

    def forget(self) -> None:
        """Remove from the graph what was kept there for this node. To be called after `close`, when nothing will ask for the node again."""
        for entry in self.used or ():
            entry.forget(self.identity.fqn)

    def _servers(self) -> list[Server | ActionServer]:
        return [*self.services.values(), *self.actions.values()]


class Directory:
    """The records of all nodes of one system.

    Invariants:

    - `records` has one record for each path, from the start of the node's first life until its supervisor forgets it.
    - A full name belongs to at most one path. A node that has ended for good gives up its name; its record stays until it is removed.
    """

    def __init__(self, books: Books, loop: asyncio.AbstractEventLoop, options: RunOptions | None) -> None:
        self.records: dict[tuple[str, ...], NodeRecord] = {}
        self._books = books
        self._options = options
        self._loop = loop
        self._paths: dict[str, tuple[str, ...]] = {}

    def enter(self, child: Child, path: tuple[str, ...], stalls: StallWatch | None) -> NodeRecord:
        """The record for the next life of the child at `path`: that of its earlier lives, or a new one.

        Raises `DeclarationError` when another node has the child's full name, `InvalidName` when one of the child's names is invalid.
        """
        record = self.records.get(path)
        if record is not None and record.child is child and self._paths.get(record.identity.fqn) == path:
            return record
        identity = self._identity(child, path, record)
        if record is None:
            record = self.records[path] = NodeRecord(child, identity, self._books, self._inbox(stalls))
        record.child, record.identity = child, identity
        return record

    def renew(self, record: NodeRecord, stalls: StallWatch | None) -> int:
        """Let the next life of a node find nothing of the earlier ones but their number, and what they have saved.

        To be called between two lives. Returns how many messages were lost.
        """
        lost = record.close()
        record.inbox, record.timers = self._inbox(stalls), {}
        return lost

    def _inbox(self, stalls: StallWatch | None) -> Inbox:
        return Inbox(self._loop, None if stalls is None else stalls.ran)

    def find(self, fqn: str) -> Incarnation | None:
        """The running incarnation of the node with this full name; None if there is none."""
        path = self._paths.get(fqn)
        record = self.records.get(path) if path is not None else None
        return record.running if record is not None else None

    def owner_of(self, task: asyncio.Task[Any]) -> NodeRecord | None:
        """The node that `task` belongs to: its main task or one that it owns. None for any other task. May be called from any thread."""
        for record in list(self.records.values()):
            life = record.life
            if record.inbox.task is task or (life is not None and task in life.tasks):
                return record
        return None

    def runner_of(self, one: asyncio.Task[Any] | Inbox) -> Runner | None:
        """The node of a task or of an inbox, for the stall watch."""
        of_inbox = (each for each in self.records.values() if each.inbox is one)
        record = next(of_inbox, None) if isinstance(one, Inbox) else self.owner_of(one)
        return None if record is None else Runner(record.identity.fqn, record.incarnation, record.inbox)

    def below(self, path: tuple[str, ...]) -> list[NodeRecord]:
        """The record of the node at `path`; for the path of a supervisor, the records of all nodes below it."""
        record = self.records.get(path)
        if record is not None:
            return [record]
        return [each for each in self.records.values() if each.path[: len(path)] == path]

    def release_name(self, record: NodeRecord) -> None:
        """Give up the full name of a node that has ended for good, so that another node may take it."""
        self._paths.pop(record.identity.fqn, None)

    def remove(self, record: NodeRecord) -> None:
        """Remove a node that its supervisor has forgotten, here and from the graph."""
        record.forget()
        del self.records[record.path]

    def named(self, node: type | str) -> NodeRecord:
        """The one node of this class (or a derived one), name or full name. Raises `LookupError` when there is none, or several."""
        found = [record for record in self.records.values() if _is_called(record, node)]
        if len(found) == 1:
            return found[0]
        asked = f"called {node!r}" if isinstance(node, str) else f"a {node.__name__}"
        if found:
            several = ", ".join(sorted(record.identity.fqn for record in found))
            raise LookupError(f"{len(found)} nodes are {asked}: say which one by its full name: {several}")
        known = (
            ", ".join(sorted(_introduced(record) for record in self.records.values() if self._books.holds(record.path)))
            or "none"
        )
        raise LookupError(f"no node in this system is {asked}; there are: {known}{self._meant(node)}")

    def _meant(self, node: type | str) -> str:
        identities = [record.identity for record in self.records.values()]
        candidates = [name for one in identities for name in (one.name, one.fqn)]
        candidates += [kind.__name__ for record in self.records.values() if (kind := class_of(record)) is not None]
        return did_you_mean(node if isinstance(node, str) else node.__name__, candidates)

    def _identity(self, child: Child, path: tuple[str, ...], before: NodeRecord | None) -> Identity:
        identity = identity_of(child, path, self._options)
        other = self._paths.get(identity.fqn)
        if other is not None and other != path:
            raise DeclarationError(
                f"{'/'.join(path)} would be the second node named {identity.fqn}, the first being {'/'.join(other)}: "
                "give it another name= or namespace="
            )
        if before is not None and self._paths.get(before.identity.fqn) == path:
            del self._paths[before.identity.fqn]
        self._paths[identity.fqn] = path
        return identity


def class_of(record: NodeRecord) -> type | None:
    """The class of a node, also before its first life if a class is its factory; None if a function is, until it has run."""
    made_by = record.child.factory
    return record.node_class or (made_by if isinstance(made_by, type) else None)


def _is_called(record: NodeRecord, node: type | str) -> bool:
    if isinstance(node, str):
        return node in (record.identity.name, record.identity.fqn)
    return (kind := class_of(record)) is not None and issubclass(kind, node)


def _introduced(record: NodeRecord) -> str:
    kind = class_of(record)
    return f"{record.identity.fqn} ({kind.__name__})" if kind is not None else record.identity.fqn
