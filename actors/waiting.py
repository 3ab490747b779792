"""Tasks that wait for a condition: the one mechanism that all rooms use to let tasks wait and to wake them; and futures for which none waits."""

from __future__ import annotations

import asyncio
from typing import TypeVar

T = TypeVar("T")


def wake(future: asyncio.Future[T], value: T) -> None:
    """Complete `future` with `value`. If it is done or canceled already, nothing happens."""
    if not future.done():
        future.set_result(value)


def retrieve(future: asyncio.Future[T]) -> None:
    """Take the outcome of a done future that nobody waits for, so that an error in it is not reported as lost."""
    if not future.cancelled():
        future.exception()


class Waiters(list["asyncio.Future[None]"]):
    """The tasks that wait for one condition, in the order in which they began to wait. `wake_all` wakes all of them together.

    A task that is woken knows only that the condition may hold: another task may have run between `wake_all` and its next step. So check
    the condition, and wait again, in a loop.

    Invariants:

    - A task is listed exactly from the moment it begins to wait until it is woken or gives up.
    - A task that gives up, because it is canceled or its coroutine is closed, removes itself.

    It is a list because its truth value ("does any task wait?") is tested for every message, and must not cost a call. Only the truth
    value, the length and the methods below are meant for use.
    """

    __slots__ = ()

    async def wait(self) -> None:
        """Wait until the next `wake_all`. Must be called in a running event loop."""
        future: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self.append(future)
        try:
            await future
        except BaseException:
            if future in self:  # else `wake_all` has removed it in the same turn of the loop
                self.remove(future)
            raise

    def wake_all(self) -> None:
        """Wake every task that waits now, in the order in which they began to wait."""
        for future in self:
            if not future.done():
                future.set_result(None)
        self.clear()
