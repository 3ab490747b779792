"""The directory of a system: its nodes by path and by name."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any

from actors.errors import DeclarationError
from actors.inbox.inbox import Inbox
from actors.runtime.options import identity_of
from actors.runtime.record import Books, NodeRecord
from actors.suggest import did_you_mean

if TYPE_CHECKING:
    from actors.names.identity import Identity
    from actors.runtime.incarnation import Incarnation
    from actors.runtime.options import RunOptions
    from actors.runtime.stall import StallWatch
    from actors.supervision.declarations import Child

__all__ = ["Directory", "class_of"]


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
            ", ".join(sorted(_introduced(record) for record in self.records.values() if record.supervised)) or "none"
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
