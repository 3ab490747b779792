"""`Journal`: keeps journals of nodes and subtrees while their system runs, so that each can be replayed alone."""

from __future__ import annotations

import os
import shutil
import tempfile
import weakref
from collections.abc import Callable
from pathlib import Path
from typing import Self

from actors.inbox.boundary import BOUNDARY
from actors.replay.alone import check_alone
from actors.replay.encoding import frozen
from actors.replay.errors import ReplayError
from actors.replay.journaled_loop import journaled
from actors.replay.parts import Spool
from actors.replay.recording import Recording, Start, is_subtree, named
from actors.replay.recording_boundary import RecordedLife, RecordingBoundary
from actors.runtime.interceptor import Interceptor
from actors.runtime.runtime import NodeRecord
from actors.suggest import did_you_mean
from actors.supervision.peers import Life
from actors.system import System


class Journal:
    """Keeps a journal of each of the nodes that are named, from the start of its first life on::

        journal = Journal("/navigation")
        async with run(tree, observers=(journal,)) as system: ...
        journal.save("navigation.journal", "/navigation")

    Nodes are given by their name or full name. A path, such as ``robot/navigation``, is that of a supervisor: one journal is then kept of all
    nodes below it, of what crosses the boundary around them. A node that cannot be journaled, because an argument of it cannot be kept,
    runs on without, as does a subtree with such a node, and `refused` says why. Nodes of a subtree that run in other processes are
    outside of its boundary; with one, a journal can be kept from the start, but not begun by a restart. A journal is written to a file as it
    grows: ``<node>.journal``, or ``<path with dots>.subtree.journal``, in `folder`, or in a temporary one that is removed with this object.
    With `publish` each journal is a topic, too, ``<node>/_journal``, or ``/<path>/_subtree_journal``, which is recorded into bags. The run is
    otherwise the same, but slower: see docs/howto/replay.md.

    With `on_request` it publishes, and further nodes are added while the system runs: by `begin`, or from another process by the parameter
    ``nodes`` of the node ``/_replay_journal``, as `bag record --replay NODE --restart` does. Until then it costs next to nothing: one
    node, which ticks twice a second.
    """

    # Invariants: a journal that is asked for is in `_boundaries` or in `refused` from the first journaled start of a node on, or in neither;
    # that of a subtree may come into both, and is then not whole. `_folder` is None until the first journal is opened, unless it was given.

    def __init__(
        self,
        *nodes: str,
        publish: bool = False,
        folder: str | os.PathLike[str] | None = None,
        on_request: bool = False,
    ) -> None:
        if not nodes and not on_request:
            raise ReplayError("Journal(): say of which nodes, by their names: Journal('/navigation')")
        self._nodes = set(nodes)
        self._publish = publish or on_request
        self._folder = None if folder is None else Path(folder)
        self._boundaries: dict[str, RecordingBoundary] = {}
        self._system: System | None = None
        self.refused: dict[str, str] = {}
        """Full name of a node, or path of a subtree -> why no journal of it is kept."""

    def __repr__(self) -> str:
        return f"<journal of {', '.join(sorted(self._nodes)) or 'no node yet'}>"

    @property
    def nodes(self) -> tuple[str, ...]:
        """The nodes and subtrees of which a journal is kept, or is to be kept from their start on, as they were called, sorted."""
        return tuple(sorted(self._nodes))

    def attach(self, system: System) -> Self:
        """Keep journals of `system`, whose tree has not started yet. Raises `ReplayError` for an event loop that cannot be watched."""
        if self._nodes:
            journaled(system.loop)
        self._system = system
        system.runtime.observers.closed.append(self._end)
        system.runtime.observers.dismissed.append(self._dismissed)
        system.runtime.intercept(_Lives(self._life), first=True)
        if self._publish:
            system.runtime.observers.opening.append(self._publish_journals)
        return self

    def recording(self, node: str) -> Recording:
        """The journal of a node, or of a subtree by its path, so far. Raises `ReplayError` if there is none."""
        return self._boundary_of(node).spool.recording()

    def _boundary_of(self, node: str) -> RecordingBoundary:
        refused, kept = named(self.refused, node), named(self._boundaries, node)
        if refused is not None or kept is None:
            why = "it has not started" if refused is None else self.refused[refused]
            raise ReplayError(f"there is no journal of {node}: {why}")
        boundary = self._boundaries[kept]
        boundary.flush()
        return boundary

    def save(self, path: str | os.PathLike[str], node: str) -> Path:
        """Write the journal of a node or subtree so far to a file, and return its path."""
        file = Path(path)
        self._boundary_of(node).spool.save(file)
        return file

    def _end(self) -> None:
        assert self._system is not None
        for boundary in self._boundaries.values():
            boundary.flush()
            if boundary.spool.failure:
                self._system.log.error(
                    "a journal is not whole", node_name=boundary.spool.node, because=boundary.spool.failure
                )

    def _dismissed(self, record: NodeRecord) -> None:
        if (boundary := self._boundaries.get(self._name_of(record))) is not None:
            boundary.dismissed(record)

    async def _publish_journals(self) -> None:
        from actors.replay.publishing import JournalPublisher
        from actors.supervision.child import Child

        assert self._system is not None
        await self._system.join(Child(JournalPublisher, args=(self, self._boundaries)))

    # -- nodes that run already ----------------------------------------------------------------------------------------------

    def check(self, node: str) -> str:
        """The name of the journal of a node, or of a subtree by its path, that could be begun now.

        Raises `LookupError` if there is no such node or path, and `ReplayError` if no journal of it can be begun.
        """
        if self._system is None:
            raise ReplayError("this journal has not been attached: run(tree, observers=(journal,))")
        directory = self._system.runtime.directory
        path = tuple(node.split("/"))
        records = (
            [one for one in directory.below(path) if one.path != path] if is_subtree(node) else [directory.named(node)]
        )
        if not records:
            paths = sorted({"/".join(path[:-1]) for path in directory.records if len(path) > 2})
            raise LookupError(f"no node runs below {node}{did_you_mean(node, paths)}")
        name = node if is_subtree(node) else records[0].identity.fqn
        for record in records:
            who = "it" if record.identity.fqn == name else record.identity.fqn
            if record.process or not self._system.runtime.tree.holds(record.path):
                where = "runs in another process" if record.process else "has no supervisor that could restart it"
                raise ReplayError(f"no journal of {name} can be begun: {who} {where}")
            if (other := self._name_of(record)) not in ("", name):
                raise ReplayError(f"no journal of {name} can be begun: {who} is in that of {other}")
            self._start_of(record, name)
        return name

    async def begin(self, node: str) -> None:
        """Keep a journal of a node, or of a subtree by its path, that runs, from the next life on: its supervisor stops it in order and
        restarts it at once.

        What waits for it then is lost. Returns when it is ready, at once if its journal is kept already. Raises what `check` raises;
        `ReplayError`, too, if the journal cannot be written, and the node runs on without; and `StartFailed`, and the node is stopped.
        """
        await self.restart(self.check(node))

    async def restart(self, name: str) -> None:
        """As `begin`, for a name that `check` has returned. Raises `LookupError` if what it names has gone since."""
        if name in self._boundaries:
            return
        assert self._system is not None
        assert self._system.supervisor is not None
        journaled(self._system.loop)
        self._nodes.add(name)
        directory = self._system.runtime.directory
        path = tuple(name.split("/")) if is_subtree(name) else directory.named(name).path
        supervisor = next((one for one in self._system.supervisor.below() if one.path == path[:-1]), None)
        if supervisor is None:
            raise LookupError(f"{name} has gone with its supervisor")
        if is_subtree(name):
            await supervisor.terminate_child(path[-1])
            await supervisor.restart_child(path[-1])
        else:
            await supervisor.replace(path[-1], directory.named(name).child.factory)
        if name in self.refused:
            raise ReplayError(f"no journal of {name} is kept: {self.refused[name]}")

    # -- between supervisor and node -----------------------------------------------------------------------------------------

    def _life(self, path: tuple[str, ...], make: Callable[[], Life]) -> Life:
        assert self._system is not None
        record = self._system.runtime.directory.records[path]
        name = self._name_of(record)
        if name == "" or name in self.refused:
            return make()
        try:
            start = self._start_of(record, name)
            boundary = self._boundaries.get(name) or self._open(name)
        except ReplayError as error:
            self._refuse(name, f"{record.identity.fqn}: {error}" if is_subtree(name) else str(error))
            return make()
        except OSError as error:
            self._refuse(name, f"its journal cannot be written: {error}")
            return make()
        if start.node not in boundary.members:
            self._system.runtime.renew(record)  # what is left of an earlier life is in no journal
        boundary.begins(start, record.inbox)
        token = BOUNDARY.set(boundary)
        try:
            life = make()
        finally:
            BOUNDARY.reset(token)
        assert record.life is not None
        return RecordedLife(boundary, record.life, life)

    def _name_of(self, record: NodeRecord) -> str:
        """The name of the journal to which a node belongs, that of a subtree before its own; empty if none is asked for."""
        below = ("/".join(record.path[:depth]) for depth in range(2, len(record.path)))
        own = record.identity.fqn if self._nodes & {record.identity.name, record.identity.fqn} else ""
        return next((path for path in below if path in self._nodes), own)

    def _refuse(self, name: str, why: str) -> None:
        assert self._system is not None
        self.refused[name] = why
        if (boundary := self._boundaries.get(name)) is not None:
            boundary.give_up(why)
        self._system.log.warning("no journal is kept", node_name=name, because=why)

    def _open(self, name: str) -> RecordingBoundary:
        assert self._system is not None
        runtime = self._system.runtime
        path = self._made() / f"{name.strip('/').replace('/', '.')}{'.subtree' if is_subtree(name) else ''}.journal"
        boundary = RecordingBoundary(Spool(name, path, publish=self._publish), journaled(runtime.loop))
        self._boundaries[name] = boundary
        runtime.intercept(boundary, first=True)
        runtime.graph.watchers.append(boundary)
        runtime.graph.on_change(boundary.look)
        return boundary

    def _made(self) -> Path:
        """The folder of the journals."""
        if self._folder is None:
            self._folder = Path(tempfile.mkdtemp(prefix="robactor_journals_"))
            weakref.finalize(self, shutil.rmtree, self._folder, ignore_errors=True)
        self._folder.mkdir(parents=True, exist_ok=True)
        return self._folder

    def _start_of(self, record: NodeRecord, name: str) -> Start:
        assert self._system is not None
        runtime, child = self._system.runtime, record.child
        check_alone(child)
        return Start(
            journal=name, node=record.identity.fqn, incarnation=record.incarnation + 1, path=record.path, child=frozen(child),
            options=frozen(runtime.options), saved=frozen(record.saved), state=record.asked_state, seed=runtime.seed,
            process=runtime.process, level=runtime.system_log.level, virtual=runtime.clock.virtual, origin=runtime.clock.origin,
            epoch=runtime.clock.epoch, id_streams=runtime.id_streams[record.identity.fqn],
        )  # fmt: skip


class _Lives(Interceptor):
    """Has `begin` make the lives of nodes."""

    def __init__(self, begin: Callable[[tuple[str, ...], Callable[[], Life]], Life]) -> None:
        self._begin = begin

    def life(self, path: tuple[str, ...], make: Callable[[], Life], /) -> Life:
        return self._begin(path, make)
