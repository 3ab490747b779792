"""How long commands look at a graph: until it seems complete, and longer for what they are asked for by its name.

No process can know that it has found all others. So a graph counts as complete when nothing has changed for a moment, which may be too early where
a process has just been started; and no command says that a name is not there before it has waited for it. On a busy machine all of it takes longer.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from contextlib import suppress
from typing import Any, Final

from actors.time.processor import Processor

LATE: Final = 1.0
"""Seconds for which something that is asked for by its name is waited for at least."""

QUIET: Final = 0.06
"""Seconds without news after which the graph counts as complete: other processes of a host are found within 40 ms."""

SLOW: Final = 4.0
"""Seconds at most until those that have been found have told of all that they have. Fast DDS does so with its heartbeats, every 1 and 3 s."""


def stretched(seconds: float) -> float:
    """The real time, up to `SLOW`, that stands for `seconds` of an idle machine: longer by the ratio of the time that this thread has waited for
    a processor to the time that it has run."""
    processor = Processor("thread-self")
    ran, waited = processor.share()
    processor.close()
    return max(seconds, min(SLOW, seconds * (1.0 + waited / ran))) if ran else seconds


async def settle(news: asyncio.Event, found: Callable[[], bool], complete: Callable[[], bool], most: float) -> None:
    """Return when others have been `found`, have told of all that they have, and there has been no news for `QUIET` seconds.

    It takes `most` seconds at most, `stretched`, or `SLOW` if that is longer and the others have not told of all. `news` is set at every change of
    the graph.
    """
    most = stretched(most)
    with suppress(TimeoutError):
        async with asyncio.timeout(most):
            await _quiet(news, lambda: found() and complete())
            return
    if not complete():
        with suppress(TimeoutError):
            async with asyncio.timeout(SLOW - most):
                await _quiet(news, complete)


async def _quiet(news: asyncio.Event, enough: Callable[[], bool]) -> None:
    """Return when there is `enough`, and no news for `QUIET` seconds."""
    while True:
        news.clear()
        with suppress(TimeoutError):
            async with asyncio.timeout(stretched(QUIET)):
                await news.wait()
        if news.is_set():  # also where this process was held up, and finds the news when the time is over
            continue
        if enough():
            return
        await news.wait()


async def late(news: asyncio.Event, wanted: Callable[[], bool], most: float) -> bool:
    """Wait until `wanted`, which looks at the graph, is true, and return whether it is; `most` seconds, or `LATE` if that is longer, `stretched`.

    `news` is set at every change of the graph.
    """
    with suppress(TimeoutError):
        async with asyncio.timeout(stretched(max(most, LATE))):
            while not wanted():
                news.clear()
                await news.wait()
            return True
    return wanted()


async def until_one_ends(*work: Coroutine[Any, Any, object]) -> None:
    """Do all of this together until one part has ended, and cancel the others. Raises the error of that part."""
    tasks = [asyncio.ensure_future(one) for one in work]
    try:
        done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        for task in done:
            task.result()
    finally:
        for task in tasks:
            task.cancel()
