"""`PlayedNode`: the lives of a replayed node, which begin and end when its tape says so."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import TYPE_CHECKING

from actors.errors import described
from actors.inbox.border import INSIDE
from actors.replay.encoding import thawed
from actors.replay.loop_seam import OwnedTask
from actors.replay.recording import started_outside

if TYPE_CHECKING:
    from actors.replay.replaying import Replaying
    from actors.replay.tape import Start
    from actors.runtime.incarnation import Incarnation
    from actors.runtime.record import NodeRecord
    from actors.supervision.declarations import Child
    from actors.supervision.seam import Life
    from actors.system import System

__all__ = ["PlayedNode"]


class PlayedNode:
    """Stands between the replayed node and its supervisor, which restarts it at once and for ever.

    `change(child)` gives the declaration of the node that is played to, for that of each recorded life.

    Invariants:

    - While the node lives, `alive` is true. Its next life waits for `_gate` from the moment on at which the supervisor asks for it.
    - `present` is its present or last life; None before the first.
    """

    def __init__(self, system: System, edge: Replaying, change: Callable[[Child], Child]) -> None:
        self.present: Incarnation | None = None
        self.alive = False
        self.failure = ""
        """The error with which the last life of the node ended; empty if it did not fail."""
        self._system, self._edge, self._change = system, edge, change
        self._gate: asyncio.Future[Start] | None = None

    @property
    def waiting(self) -> bool:
        """Whether the next life can begin."""
        return self._gate is not None

    def life(self, record: NodeRecord, make: Callable[[], Incarnation], /) -> Life:
        return _PlayedLife(self, record)

    def begin(self, start: Start) -> None:
        """Let the next life begin."""
        assert self._gate is not None
        self._gate.set_result(start)

    def stop(self, reason: str, system: str | None) -> None:
        """Ask the present life for its end, as its supervisor did; `system` is why the whole system was to stop, or None."""
        self._system.runtime.tree.stop_reason = system
        assert self.present is not None
        self._edge.enter("stop", (), self.present.stop, reason)

    async def live(self, record: NodeRecord, started: Callable[[], None]) -> None:
        """One life of the node, from the moment at which the tape begins it."""
        self._gate = asyncio.get_running_loop().create_future()
        start = await self._gate
        self._gate, self.failure = None, ""
        self._prepare(record, start)
        child = self._change(thawed(start.child, trust=self._edge.tape.trusted))
        token = INSIDE.set(self._edge)
        try:
            self.present = self._system.runtime.incarnate(child, record)
            self.alive = True
            await self._run(self.present, started)
        except BaseException as error:
            if not self._edge.over:  # else it is the end of the replay that ends it
                self.failure = described(error)
            raise
        finally:
            INSIDE.reset(token)
            self.alive = False

    def _prepare(self, record: NodeRecord, start: Start) -> None:
        """Let the record be as it was when the life began."""
        if (
            record.incarnation != start.incarnation - 1
        ):  # it had lived before the tape, or was forgotten and added again
            self._system.runtime.renew(record)
            record.incarnation, record.saved = start.incarnation - 1, thawed(start.saved, trust=self._edge.tape.trusted)
            record.asked_state = start.state
        record.inbox.border = self._edge

    async def _run(self, life: Incarnation, started: Callable[[], None]) -> None:
        edge, task = self._edge, asyncio.current_task()
        assert isinstance(task, OwnedTask)
        edge.begin(task)
        try:
            await life.run(started_outside(started))
        except BaseException as error:
            edge.send("end", type(error).__name__, described(error))
            raise
        edge.send("end", "", "")


class _PlayedLife:
    """One life of the replayed node, for its supervisor."""

    def __init__(self, played: PlayedNode, record: NodeRecord) -> None:
        self._played = played
        self._record = record

    async def run(self, started: Callable[[], None], /) -> None:
        await self._played.live(self._record, started)

    def stop(self, reason: str, /) -> None:
        """Do nothing: only the tape stops a replayed node, and the end of the replay kills it."""
