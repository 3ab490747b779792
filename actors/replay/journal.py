"""`Journal`: keeps journals of nodes while their system runs, so that each can be replayed alone."""

from __future__ import annotations

import asyncio
import os
import shutil
import tempfile
import weakref
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any
from weakref import WeakKeyDictionary

from actors.inbox.border import INSIDE
from actors.replay.alone import check_alone
from actors.replay.encoding import frozen
from actors.replay.errors import ReplayError
from actors.replay.loop_seam import LoopSeam
from actors.replay.parts import Spool
from actors.replay.recording import RecordedLife, Recording
from actors.replay.tape import Start, Tape

if TYPE_CHECKING:
    from typing import Self

    from actors.runtime.incarnation import Incarnation
    from actors.runtime.record import NodeRecord
    from actors.supervision.seam import Life
    from actors.system import System

__all__ = ["Journal", "seam_of"]

_SEAMS: WeakKeyDictionary[asyncio.AbstractEventLoop, LoopSeam] = WeakKeyDictionary()


class Journal:
    """Keeps a journal of each of the nodes that are named, from the start of its first life on::

        journal = Journal("/navigation")
        async with run(tree, observers=(journal,)) as system: ...
        journal.save("navigation.journal", "/navigation")

    Nodes are given by their name or full name. A node that cannot be journaled, because an argument of it cannot be kept, runs on
    without, and `refused` says why. A journal is written to a file as it grows: ``<node>.journal`` in `folder`, or in a temporary one that is
    removed with this object. With `publish` each journal is a topic, too, ``<node>/_journal``, which is recorded into bags. The run is otherwise
    the same, but slower: see docs/replay.md.

    With `on_request` it publishes, and further nodes are added while the system runs: by `begin`, or from another process by the parameter
    ``nodes`` of the node ``/_replay_journal``, as `bag record --replay NODE --restart` does. Until then it costs nothing.
    """

    # Invariants: a node is in `_recordings` or in `refused` from its first journaled start on, or in neither. `_folder` is None until the
    # first journal is opened, unless it was given.

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
        self._recordings: dict[str, Recording] = {}
        self._system: System | None = None
        self.refused: dict[str, str] = {}
        """Full name -> why no journal of this node is kept."""

    def __repr__(self) -> str:
        return f"<journal of {', '.join(sorted(self._nodes)) or 'no node yet'}>"

    @property
    def nodes(self) -> tuple[str, ...]:
        """The names and full names of the nodes of which a journal is kept, or is to be kept from their start on, sorted."""
        return tuple(sorted(self._nodes))

    def attach(self, system: System) -> Self:
        """Keep journals of `system`, whose tree has not started yet. Raises `ReplayError` for an event loop that cannot be watched."""
        if self._nodes:
            seam_of(system.loop)
        self._system = system
        system.runtime.observers.closed.append(self._end)
        system.runtime.gates.append(self)
        if self._publish:
            system.runtime.observers.opening.append(self._publish_tapes)
        return self

    def tape(self, node: str) -> Tape:
        """The journal of a node so far. Raises `ReplayError` if there is none."""
        return self._recording(node).spool.tape()

    def _recording(self, node: str) -> Recording:
        for fqn, recording in self._recordings.items():
            if node in (fqn, fqn.rpartition("/")[2]):
                recording.flush()
                return recording
        whys = (why for fqn, why in self.refused.items() if node in (fqn, fqn.rpartition("/")[2]))
        raise ReplayError(f"there is no journal of {node}: {next(whys, 'it has not started')}")

    def save(self, path: str | os.PathLike[str], node: str) -> Path:
        """Write the journal of a node so far to a file, and return its path."""
        file = Path(path)
        self._recording(node).spool.save(file)
        return file

    def _end(self) -> None:
        assert self._system is not None
        for recording in self._recordings.values():
            recording.flush()
            if recording.spool.failure:
                self._system.log.error(
                    "a journal is not whole", node_name=recording.node, because=recording.spool.failure
                )

    async def _publish_tapes(self) -> None:
        from actors.replay.publishing import JournalPublisher
        from actors.supervision.declarations import Child

        assert self._system is not None
        await self._system.join(Child(JournalPublisher, args=(self, self._recordings)))

    # -- nodes that run already ----------------------------------------------------------------------------------------------

    def check(self, node: str) -> NodeRecord:
        """The record of a supervised node of which a journal can be kept. Raises `LookupError` if there is none, and `ReplayError`."""
        if self._system is None:
            raise ReplayError("this journal has not been attached: run(tree, observers=(journal,))")
        record = self._system.runtime.directory.named(node)
        if record.process or not record.supervised:
            where = "runs in another process" if record.process else "has no supervisor that could restart it"
            raise ReplayError(f"no journal of {record.identity.fqn} can be begun: it {where}")
        self._start_of(record)
        return record

    async def begin(self, node: str) -> None:
        """Keep a journal of a node that runs, from its next life on: its supervisor stops it in order and starts it anew at once.

        What waits for it then is lost. Returns when it is ready, at once if its journal is kept already. Raises what `check` raises, and
        `StartFailed`; the node is then stopped.
        """
        record = self.check(node)
        if record.identity.fqn in self._recordings:
            return
        assert self._system is not None
        assert self._system.supervisor is not None
        seam_of(self._system.loop)
        self._nodes.add(record.identity.fqn)
        supervisor = next(one for one in self._system.supervisor.below() if one.path == record.path[:-1])
        await supervisor.replace(record.path[-1], record.child.factory)

    # -- between supervisor and node -----------------------------------------------------------------------------------------

    def life(self, record: NodeRecord, make: Callable[[], Incarnation], /) -> Life | None:
        name, fqn = record.identity.name, record.identity.fqn
        if (name not in self._nodes and fqn not in self._nodes) or fqn in self.refused:
            return None
        assert self._system is not None
        try:
            start = self._start_of(record)
        except ReplayError as error:
            self.refused[fqn] = str(error)
            self._system.log.warning("no journal is kept", node_name=fqn, because=str(error))
            return None
        recording = self._recordings.get(fqn)
        if recording is None:
            recording = self._open(record)
            self._system.runtime.renew(record)  # what is left of an earlier life is in no journal
        record.inbox.border = recording  # that of the first record, or of a node that was removed and added again
        recording.begins(start)
        token = INSIDE.set(recording)
        try:
            return RecordedLife(recording, make())
        finally:
            INSIDE.reset(token)

    def _open(self, record: NodeRecord) -> Recording:
        assert self._system is not None
        runtime, fqn = self._system.runtime, record.identity.fqn

        def killed(task: asyncio.Task[Any]) -> float | None:
            child = None if record.life is None else runtime.child_of(record.life)
            return child.killed if child is not None and child.task is task else None

        path = self._made() / f"{fqn.strip('/').replace('/', '.')}.journal"
        recording = Recording(fqn, Spool(fqn, path, publish=self._publish), seam_of(runtime.loop), killed)
        self._recordings[fqn] = recording
        runtime.graph.borders.append(recording)
        runtime.graph.watchers.append(recording)
        runtime.graph.on_change(recording.look)
        return recording

    def _made(self) -> Path:
        """The folder of the journals."""
        if self._folder is None:
            self._folder = Path(tempfile.mkdtemp(prefix="robactor_journals_"))
            weakref.finalize(self, shutil.rmtree, self._folder, ignore_errors=True)
        self._folder.mkdir(parents=True, exist_ok=True)
        return self._folder

    def _start_of(self, record: NodeRecord) -> Start:
        assert self._system is not None
        runtime, child = self._system.runtime, record.child
        check_alone(child)
        return Start(
            node=record.identity.fqn, incarnation=record.incarnation + 1, path=record.path, child=frozen(child),
            options=frozen(runtime.options), saved=frozen(record.saved), state=record.asked_state, seed=runtime.seed,
            process=runtime.process, level=runtime.journal.level, virtual=runtime.clock.virtual, origin=runtime.clock.origin,
            epoch=runtime.clock.epoch, id_streams=runtime.id_streams[record.identity.fqn],
        )  # fmt: skip


def seam_of(loop: asyncio.AbstractEventLoop) -> LoopSeam:
    """The seam of an event loop, made at the first call."""
    seam = _SEAMS.get(loop)
    if seam is None:
        seam = _SEAMS[loop] = LoopSeam(loop)
    return seam
