"""Waits that cancellation does not cut short."""

from __future__ import annotations

import asyncio
import sys
from contextlib import AbstractContextManager, nullcontext


def shield() -> AbstractContextManager[object]:
    """A context manager that shields its block from canceled scopes of anyio around it.

    Without it, a canceled scope cancels the await of the block again in every turn of the event loop.
    """
    if "anyio" not in sys.modules:  # then there is no scope to shield from, and the import would block the loop
        return nullcontext()
    from anyio import CancelScope

    return CancelScope(shield=True)


async def see_through(end: asyncio.Future[None]) -> None:
    """Wait until `end` is done, even if the caller is canceled, once or several times; then raise the first of these cancellations.

    There is no timeout: the code that completes `end` limits the wait. `end` is not canceled, and its exception is not raised here.
    """
    canceled: asyncio.CancelledError | None = None
    with shield():
        while not end.done():
            try:
                await asyncio.wait([end])
            except asyncio.CancelledError as error:
                canceled = canceled or error
    if canceled is not None:
        raise canceled
