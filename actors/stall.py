"""Who blocks the event loop: a thread that looks, because nothing in a loop that stands still can.

A handler that computes, sleeps or reads without an `await` holds up every node of its process. Afterwards nobody in the loop can say
which one it was, so a thread looks five times a second: if the loop does not turn for half a second while a task runs, it notes
which node's handler that is and on which line. When the loop turns again, that is one warning in the log for each such handler.
"""

from __future__ import annotations

import asyncio
from threading import Event, Thread
from time import monotonic
from typing import TYPE_CHECKING, Any

from actors.inbox import HOLDING_SECONDS
from actors.places import line_of

if TYPE_CHECKING:
    from actors.system import NodeState, System

__all__ = ["POLL_SECONDS", "StallWatch"]

POLL_SECONDS = 0.2


class StallWatch:
    """Watches the loop of one system that runs on the real clock. It costs the loop one empty callback per look, and only while it works."""

    def __init__(self, system: System) -> None:
        self._system = system
        self._end = Event()
        self._asked = False
        """Whether the loop owes a sign of life."""
        self._suspect: tuple[object, int] = (None, 0)
        """What ran at the last look: a task, and the number of items its inbox had worked off."""
        self._since = 0.0
        """When that was first seen, seconds on the monotonic clock."""
        self._reported: set[tuple[str, str]] = set()
        self.caught: tuple[NodeState | None, str, str] | None = None
        """Node, handler and line of what blocks the loop now."""
        self._thread = Thread(target=self._run, name="robactor stall watch", daemon=True)

    def start(self) -> None:
        """Begin to look."""
        self._thread.start()

    def stop(self) -> None:
        """Look no more."""
        self._end.set()
        self._thread.join()

    def _run(self) -> None:
        while not self._end.wait(POLL_SECONDS):
            self.look(monotonic())

    def look(self, now: float) -> None:
        """One look, from the thread, at `now` seconds on the monotonic clock."""
        task = asyncio.current_task(self._system.loop)
        if task is None or self.caught is not None:
            return
        state = self._owner(task)
        suspect = (task, state.mailbox.inbox.handled if state is not None else 0)
        if not self._asked or suspect != self._suspect:
            self._suspect, self._since = suspect, now
            self._ask()
        elif now - self._since >= HOLDING_SECONDS:
            self.caught = (state, _work_of(state, task), line_of(self._system.thread))

    def _ask(self) -> None:
        if self._asked:
            return
        self._asked = True
        try:
            self._system.loop.call_soon_threadsafe(self.turned)
        except RuntimeError:  # the loop has been closed under a system that nobody stopped
            self._end.set()

    def turned(self) -> None:
        """The loop's sign of life: if it was blocked meanwhile, tell by whom."""
        self._asked = False
        caught, self.caught = self.caught, None
        if caught is None:
            return
        state, handler, line = caught
        node = state.identity.fqn if state is not None else ""
        if (node, handler) in self._reported:
            return
        self._reported.add((node, handler))
        log = self._system.log if state is None else self._system.node_log(node, state.incarnation)
        log.warning(
            f"handler blocked the event loop for {monotonic() - self._since:.1f} s", handler=handler, at=line,
            remedy="await self.offload(function, ...) what computes or waits; await self.clock.sleep(s) instead of time.sleep(s)",
        )  # fmt: skip

    def _owner(self, task: asyncio.Task[Any]) -> NodeState | None:
        """The node whose task this is."""
        for state in list(self._system.nodes.values()):
            core = state.core
            if state.mailbox.inbox.task is task or (core is not None and task in core.tasks):
                return state
        return None


def _work_of(state: NodeState | None, task: asyncio.Task[Any]) -> str:
    """The handler that a node's task runs, or the task's name."""
    inbox = state.mailbox.inbox if state is not None else None
    if inbox is None or inbox.task is not task or inbox.current is None:
        return task.get_name()
    return inbox.current.label
