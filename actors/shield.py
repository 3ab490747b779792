"""What has to come to its end, whoever is canceled meanwhile."""

from __future__ import annotations

import asyncio
import sys
from contextlib import AbstractContextManager, nullcontext

__all__ = ["see_through", "shield"]


def shield() -> AbstractContextManager[object]:
    """Keep the canceled scopes of anyio around this block from canceling its awaits, as they would do in every turn of the loop."""
    if "anyio" not in sys.modules:  # then there is no scope, and its import would hold up the loop
        return nullcontext()
    from anyio import CancelScope

    return CancelScope(shield=True)


async def see_through(end: asyncio.Future[None]) -> None:
    """Wait until `end` is done, however often the caller is canceled meanwhile; then raise the first of its cancellations.

    Whoever completes `end` bounds the time. `end` itself is not canceled, and what it raises is not raised here.
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
