"""`Tasks`: the tasks that one life of a node owns, and their end."""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine, Iterator
from typing import TYPE_CHECKING

from actors.inbox.control import blame, in_task
from actors.places import awaited_in
from actors.supervision.child_task import GRACE

if TYPE_CHECKING:
    from actors.actions.driver import Host
    from actors.logs import NodeLog


class Tasks:
    """The tasks of one life that have not ended. The failure of one is that of `host`."""

    __slots__ = ("_host", "running")

    def __init__(self, host: Host) -> None:
        self._host = host
        self.running: dict[asyncio.Task[object], None] = {}
        """Those that have not ended, in the order in which they began."""

    def __iter__(self) -> Iterator[asyncio.Task[object]]:
        return iter(self.running)

    def __len__(self) -> int:
        return len(self.running)

    def __contains__(self, task: object) -> bool:
        return task in self.running

    def add(self, task: asyncio.Task[object]) -> None:
        """Own `task` until it ends."""
        self.running[task] = None
        task.add_done_callback(self._ended)

    def _ended(self, task: asyncio.Task[object]) -> None:
        self.running.pop(task, None)
        if not task.cancelled() and (error := task.exception()) is not None:
            self._host.fail(error, task.get_name())

    async def cancel(self) -> None:
        """Cancel the tasks, the newest first, and wait until each has ended. The caller's own task is left out."""
        current = asyncio.current_task()
        while tasks := [task for task in reversed(self.running) if task is not current]:
            for task in tasks:
                task.cancel()
                await asyncio.wait([task])

    async def outlast_kill(self, log: NodeLog) -> None:
        """Wait until the canceled tasks of a killed node have ended; those that are left after half of `GRACE` are logged once.

        There is no timeout here: the supervisor abandons the node after `GRACE` seconds.
        """
        patience: float | None = GRACE / 2
        while in_task() and self.running:
            try:
                done, _ = await asyncio.wait(list(self.running), timeout=patience)
            except asyncio.CancelledError:
                continue
            if not done:
                patience = None
                refusing = [f"{task.get_name()} (waits at {awaited_in(task) or '?'})" for task in self.running]
                log.error(
                    "refuses to be canceled", tasks=", ".join(refusing),
                    remedy="let CancelledError out of what it catches, or raise it again after the clean-up",
                )  # fmt: skip


async def contained(work: Coroutine[object, None, None], label: str) -> None:
    """Await user code. What leaves it is raised as the failure that it means, so that `SystemExit` never reaches the loop."""
    try:
        await work
    except BaseException as error:
        failure = blame(error, label)
        if failure is None or failure is error:
            raise
        raise failure from error
