"""Tasks that wait to be woken: one mechanism for every list of them."""

from __future__ import annotations

import asyncio
from typing import TypeVar

__all__ = ["Waiters", "wake"]

T = TypeVar("T")


def wake(future: asyncio.Future[T], value: T) -> None:
    """Complete `future` with `value`, unless it has been completed or canceled already."""
    if not future.done():
        future.set_result(value)


class Waiters(list["asyncio.Future[None]"]):
    """The tasks that wait for one condition, in the order in which they came. As trio's ``ParkingLot``, all of them are woken together.

    Invariants:

    * A task is in here exactly from the moment it begins to wait until it is woken or gives up.
    * A task that gives up, because it is canceled or its coroutine is closed, takes itself out; nobody else has to.
    * Being woken says only that the condition may hold: between `wake_all` and its next step another task may have run. Wait in a loop.

    It is a list because its truth value ("does anybody wait?") is asked for every message, and must not cost a call. Nothing but the
    truth value, the length and the methods below is meant for use.
    """

    __slots__ = ()

    async def wait(self) -> None:
        """Wait until the next `wake_all`."""
        future: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self.append(future)
        try:
            await future
        except BaseException:
            if future in self:  # else it has been woken in the same moment
                self.remove(future)
            raise

    def wake_all(self) -> None:
        """Wake every task that waits now, in the order in which they began to. Without any, nothing happens."""
        for future in self:
            if not future.done():
                future.set_result(None)
        self.clear()
