"""Who blocks the event loop: the handler, how long, on which line, and which timer had to wait for it.

A handler that computes, sleeps or reads without an `await` holds up every node of its process. There are two ways to find it:

- A thread looks five times a second: if the loop does not turn for half a second while a task runs, it notes which node's handler that is
  and on which line. When the loop turns again, that is one warning in the log.
- A shorter block is told when it has harmed somebody: a timer of any node that is late by a period or more says so. The one to blame ran
  without an await for at least that period (and 10 ms): either its time has just been measured, which is done for the first items of every node
  and for some of the others, or the thread has seen it. For five seconds after a delay that nobody accounts for, the thread looks closely.

Each handler is told once. A handler that awaits blocks nobody, however long it takes. On the virtual clock handlers take no time.
"""

from __future__ import annotations

import asyncio
import math
from threading import Event, Thread
from time import monotonic
from typing import TYPE_CHECKING, Any, NamedTuple

from actors.inbox.inbox import HOLDING_SECONDS, STEP_SECONDS
from actors.places import line_of

if TYPE_CHECKING:
    from actors.inbox.inbox import Inbox
    from actors.runtime.record import NodeRecord
    from actors.runtime.runtime import Runtime

__all__ = ["CLOSE_FOR", "CLOSE_POLL", "CLOSE_REST", "POLL_SECONDS", "StallWatch"]

POLL_SECONDS = 0.2
CLOSE_POLL = 0.005
"""How often the thread looks when it looks closely, seconds: each look costs the loop a wake-up."""
CLOSE_FOR, CLOSE_REST = 5.0, 25.0
"""For how long it does so, and how long it does not afterwards."""


class _Block(NamedTuple):
    """A step of a task during which the loop did not turn; times on the monotonic clock."""

    node: str
    incarnation: int
    handler: str
    line: str
    begun: float
    ended: float


class StallWatch:
    """Watches the loop of one system that runs on the real clock. It costs the loop one empty callback per look, and only while it works."""

    def __init__(self, runtime: Runtime) -> None:
        self._runtime = runtime
        self._end = Event()
        self._asked = False
        """Whether the loop owes a sign of life."""
        self._suspect: tuple[object, int] = (None, 0)
        """What ran at the last look: a task, and the number of items its inbox had worked off."""
        self._since = 0.0
        """When that was first seen, seconds on the monotonic clock."""
        self._close_until = self._rested = -math.inf
        self._limit = HOLDING_SECONDS
        """What blocks for so long is noted, when the thread looks closely."""
        self._reported: set[tuple[str, str]] = set()
        self._block: _Block | None = None
        """The newest step that is known to have blocked the loop."""
        self._harm: tuple[_Block, int, str] | None = None
        """What is told when all that were delayed have said so: who blocked, and the worst of them: ticks lost, node."""
        self._telling: asyncio.TimerHandle | None = None
        self.caught: tuple[NodeRecord | None, str, str, float] | None = None
        """Node, handler and line of what blocks the loop now, and when it was seen to, on the monotonic clock."""
        self._thread = Thread(target=self._run, name="robactor stall watch", daemon=True)

    def start(self) -> None:
        """Begin to look."""
        self._thread.start()

    def stop(self) -> None:
        """Look no more."""
        self._end.set()
        self._thread.join()
        self.tell_harm()

    # -- in the thread ------------------------------------------------------------------------------------------------------

    def _run(self) -> None:
        while not self._end.wait(CLOSE_POLL if monotonic() < self._close_until else POLL_SECONDS):
            self.look(monotonic())

    def look(self, now: float) -> None:
        """One look, from the thread, at `now` seconds on the monotonic clock."""
        task = asyncio.current_task(self._runtime.loop)
        if task is None or self.caught is not None:
            return
        record = self._runtime.directory.owner_of(task)
        suspect = (task, record.inbox.handled if record is not None else 0)
        if not self._asked or suspect != self._suspect:
            self._suspect, self._since = suspect, now
            self._ask()
        elif now - self._since >= (self._limit if now < self._close_until else HOLDING_SECONDS):
            self.caught = (record, _work_of(record, task), line_of(self._runtime.thread), now)

    def _ask(self) -> None:
        if self._asked:
            return
        self._asked = True
        try:
            self._runtime.loop.call_soon_threadsafe(self.turned)
        except RuntimeError:  # the loop has been closed under a system that nobody stopped
            self._end.set()

    # -- in the loop --------------------------------------------------------------------------------------------------------

    def turned(self) -> None:
        """The loop's sign of life: if it was blocked meanwhile, note by whom; if for long, tell."""
        self._asked = False
        caught, self.caught = self.caught, None
        if caught is None:
            return
        record, handler, line, seen = caught
        node, life = ("", 0) if record is None else (record.identity.fqn, record.incarnation)
        self._block = block = _Block(node, life, handler, line, self._since, max(seen, monotonic()))
        if block.ended - block.begun >= HOLDING_SECONDS:
            self._tell(block, {})

    def ran(self, inbox: Inbox, handler: str, seconds: float) -> None:
        """An item of this inbox has just run for so long without an await."""
        now = monotonic()
        for record in self._runtime.directory.records.values():
            if record.inbox is inbox:
                self._block = _Block(record.identity.fqn, record.incarnation, handler, "", now - seconds, now)

    def delayed(self, node: str, period: float, seconds: float, lost: int) -> None:
        """A tick of this node is so many seconds late, which is a period or more and not its own fault, and so many were lost."""
        now, block = monotonic(), self._block
        if block is None or block.ended < now - seconds or block.ended - block.begun < max(period, STEP_SECONDS):
            self._look_closely(now, period)
        elif self._harm is None:
            self._harm = (block, lost, node)
            self._telling = self._runtime.loop.call_later(STEP_SECONDS, self.tell_harm)
        elif lost > self._harm[1]:
            self._harm = (block, lost, node)

    def _look_closely(self, now: float, period: float) -> None:
        if now >= self._rested:
            self._close_until = now + CLOSE_FOR
            self._rested = self._close_until + CLOSE_REST
            self._limit = HOLDING_SECONDS
        self._limit = min(self._limit, max(period, STEP_SECONDS))

    def tell_harm(self) -> None:
        """Say who was delayed by whom, if there is anything to say."""
        if self._harm is None or self._telling is None:
            return
        block, lost, node = self._harm
        self._telling.cancel()
        self._harm = self._telling = None
        self._tell(block, {"delayed": node, "ticks_lost": lost})

    def _tell(self, block: _Block, harm: dict[str, Any]) -> None:
        if (block.node, block.handler) in self._reported:
            return
        self._reported.add((block.node, block.handler))
        log = self._runtime.journal.log(block.node, block.incarnation) if block.node else self._runtime.log
        fields: dict[str, Any] = {"at": block.line, **harm} if block.line else harm
        log.warning(
            f"handler blocked the event loop for {block.ended - block.begun:.2f} s", handler=block.handler, **fields,
            remedy="await self.offload(function, ...) what computes or waits; await self.clock.sleep(s) instead of time.sleep(s)",
        )  # fmt: skip


def _work_of(record: NodeRecord | None, task: asyncio.Task[Any]) -> str:
    """The handler that a node's task runs, or the task's name."""
    inbox = record.inbox if record is not None else None
    if inbox is None or inbox.task is not task or inbox.current is None:
        return task.get_name()
    return inbox.current.label
