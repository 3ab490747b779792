"""Guests: nodes beside the tree, such as a script's own or a test's. Nobody supervises them; they end when they leave, or with the system."""

from __future__ import annotations

import asyncio
import math
from typing import TYPE_CHECKING

from actors.errors import NotRunning, described
from actors.logs import ERROR
from actors.places import place_of
from actors.supervision.incarnation import GRACE
from actors.supervision.reasons import Stop

if TYPE_CHECKING:
    from actors.identity import Identity
    from actors.life import NodeLife
    from actors.supervisor import Child
    from actors.system import System

__all__ = ["Guests"]


class Guests:
    """The nodes beside the tree of one system: in the order in which they joined, each with its task."""

    __slots__ = ("_system", "_tasks")

    def __init__(self, system: System) -> None:
        self._system = system
        self._tasks: dict[NodeLife, asyncio.Task[None]] = {}

    def __len__(self) -> int:
        return len(self._tasks)

    async def join(self, child: Child) -> NodeLife:
        """See `System.join`."""
        system = self._system
        if system.stop_reason is not None:
            raise NotRunning(f"{system!r} has been stopped ({system.stop_reason}): no node can join it any more")
        name = child.name if not child.namespace else f"{child.namespace.strip('/')}/{child.name}"
        try:
            life = system.life(child, ("guests", name), 1)
        except Exception:
            system.close_if_empty()
            raise
        ready: asyncio.Future[None] = system.loop.create_future()
        task = self._tasks[life] = system.loop.create_task(
            life.run(lambda: ready.set_result(None)), name=f"guest {name}"
        )
        task.add_done_callback(lambda task: self._ended(life, task))
        try:
            await asyncio.wait([ready, task], return_when=asyncio.FIRST_COMPLETED)
        except asyncio.CancelledError:
            await self.leave(life, "the start was canceled")
            raise
        if not ready.done():
            await self.leave(life, "left")
            raise NotRunning(f"{life.identity.fqn} ended before it was ready")
        return life

    async def leave(self, life: NodeLife, reason: str) -> None:
        """See `System.leave`."""
        task = self._tasks.get(life)
        if task is None:
            return
        await self._end(life, reason)
        self._system.close_if_empty()
        if task.done() and not task.cancelled() and (error := task.exception()) is not None:
            raise error

    async def end_all(self, reason: str, *, at_once: bool = False) -> None:
        """End them, the last one first; `at_once` leaves them no time."""
        for life in reversed(list(self._tasks)):
            await self._end(life, reason, at_once=at_once)

    def failed(self) -> list[tuple[Identity, BaseException]]:
        """See `System.failed_beside`."""
        return [
            (life.identity, error)
            for life, task in self._tasks.items()
            if task.done() and not task.cancelled() and (error := task.exception()) and not isinstance(error, Stop)
        ]

    async def _end(self, life: NodeLife, reason: str, *, at_once: bool = False) -> None:
        """Ask, then kill, then give up: nobody else watches over a node beside the tree."""
        task = self._tasks[life]
        timeout = 0.0 if at_once or life.child.stop == "kill" else life.child.stop
        try:
            if not task.done():
                life.stop(reason)
                if life.phase != "running":
                    task.cancel()
                await asyncio.wait([task], timeout=None if timeout == math.inf else timeout)
        finally:
            system = self._system
            if not task.done():
                task.cancel()
                await asyncio.wait([task], timeout=GRACE)
            if not task.done():
                system.log.error("a node beside the tree refused to die and was abandoned", node_name=life.identity.fqn)
            del self._tasks[life]
            system.gone(life.identity.path, kept=False)

    def _ended(self, life: NodeLife, task: asyncio.Task[None]) -> None:
        if life in self._tasks:  # by itself: nobody will start it again
            self._system.gone(life.identity.path, kept=True)
        error = None if task.cancelled() else task.exception()
        if error is not None and not isinstance(error, Stop):
            fields = {"node_name": life.identity.fqn, "error": described(error), "at": place_of(error)}
            self._system.log.write(ERROR, "a node beside the tree failed", fields, *self._system.new_error(error))
