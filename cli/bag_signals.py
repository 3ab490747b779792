"""Commands that run until Ctrl-C, and have something to finish then."""

from __future__ import annotations

import asyncio
import contextlib
import signal
from collections.abc import Coroutine
from typing import Any

__all__ = ["until_signal"]


async def until_signal(work: Coroutine[Any, Any, None], seconds: float | None = None) -> bool:
    """Run `work` to its end, for `seconds`, or until SIGINT or SIGTERM; whether it was a signal. The work is then canceled."""
    loop = asyncio.get_running_loop()
    task = loop.create_task(work)
    signaled = asyncio.Event()

    def stop() -> None:
        signaled.set()
        task.cancel()

    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, stop)
    try:
        await asyncio.wait([task], timeout=seconds)
        task.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await task
    finally:
        for number in (signal.SIGINT, signal.SIGTERM):
            loop.remove_signal_handler(number)
    return signaled.is_set()
