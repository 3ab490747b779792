"""How long commands look at a graph: until it seems complete, and longer for what they are asked for by its name.

No process can know that it has found all others. So a graph counts as complete when nothing has changed for a moment, which may be too early where the machine
is busy or a process has just been started; and no command says that a name is not there before it has waited for it.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from contextlib import suppress
from typing import Final

LATE: Final = 1.0
"""Seconds for which something that is asked for by its name is waited for at least."""

QUIET: Final = 0.06
"""Seconds without news after which the graph counts as complete: other processes of a host are found within 40 ms."""


async def settle(news: asyncio.Event, found: Callable[[], bool], most: float) -> None:
    """Return when others have been `found` and there has been no news for `QUIET` seconds; after `most` seconds in any case.

    `news` is set at every change of the graph.
    """
    with suppress(TimeoutError):
        async with asyncio.timeout(most):
            while True:
                news.clear()
                with suppress(TimeoutError):
                    async with asyncio.timeout(QUIET):
                        await news.wait()
                if news.is_set():  # also where this process was held up, and finds the news when the time is over
                    continue
                if found():
                    return
                await news.wait()


async def late(news: asyncio.Event, wanted: Callable[[], bool], most: float) -> bool:
    """Wait until `wanted`, which looks at the graph, is true, and return whether it is; `most` seconds, or `LATE` if that is longer.

    `news` is set at every change of the graph.
    """
    with suppress(TimeoutError):
        async with asyncio.timeout(max(most, LATE)):
            while not wanted():
                news.clear()
                await news.wait()
            return True
    return wanted()
