"""The tasks that a node owns: running user code in one of them, and ending them."""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine
from typing import TYPE_CHECKING, Any

from actors.inbox.control import blame, in_task
from actors.places import awaited_in
from actors.supervision.child_task import GRACE

if TYPE_CHECKING:
    from actors.runtime.incarnation import Incarnation

__all__ = ["cancel_tasks", "spawn_contained", "tasks_ended"]


def spawn_contained(life: Incarnation, work: Coroutine[Any, Any, None], name: str) -> asyncio.Task[None]:
    """Run user code in a task of this incarnation. Its exception is reported as its failure, and `SystemExit` never reaches the loop."""
    name = name or getattr(work, "__qualname__", str(work))

    async def contained() -> None:
        try:
            await work
        except BaseException as error:
            failure = blame(error, f"{life.fqn} {name}")
            if failure is None or failure is error:
                raise
            raise failure from error

    contained.__qualname__ = getattr(work, "__qualname__", name)  # so that reports name the user's code
    task = life.spawn(contained(), name=name)
    task.add_done_callback(lambda _: work.close())  # for a task that was canceled before its first step
    return task


async def cancel_tasks(life: Incarnation) -> None:
    """Cancel the node's tasks, the newest first, and wait until each has ended. The caller's own task is left out."""
    current = asyncio.current_task()
    while tasks := [task for task in reversed(life.tasks) if task is not current]:
        for task in tasks:
            task.cancel()
            await asyncio.wait([task])


async def tasks_ended(life: Incarnation) -> None:
    """Wait until the canceled tasks of a killed node have ended; those that are left after half of `GRACE` are logged once.

    There is no timeout here: the supervisor abandons the node after `GRACE` seconds.
    """
    patience: float | None = GRACE / 2
    while in_task() and life.tasks:
        try:
            done, _ = await asyncio.wait(list(life.tasks), timeout=patience)
        except asyncio.CancelledError:
            continue
        if not done:
            patience = None
            refusing = [f"{task.get_name()} (waits at {awaited_in(task) or '?'})" for task in life.tasks]
            life.log.error(
                "refuses to be canceled", tasks=", ".join(refusing),
                remedy="let CancelledError out of what it catches, or raise it again after the clean-up",
            )  # fmt: skip
