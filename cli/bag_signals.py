"""Commands that run until Ctrl-C, and have something to finish then."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Coroutine
from typing import Any

from actors.running.signals import listen

__all__ = ["until_signal"]


async def until_signal(work: Coroutine[Any, Any, None], seconds: float | None = None) -> int | None:
    """Run `work` to its end, for `seconds`, or until a signal asks for the end, which is returned. The work is then canceled."""
    loop = asyncio.get_running_loop()
    task = loop.create_task(work)
    came: list[int] = []

    def stop(number: int) -> bool:
        came.append(number)
        task.cancel()
        return True

    leave = listen(loop, stop)
    try:
        await asyncio.wait([task], timeout=seconds)
        task.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await task
    finally:
        leave()
    return came[0] if came else None
