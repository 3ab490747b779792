"""The thread for calls that may wait."""

from __future__ import annotations

import asyncio
import threading

import pytest

from actors.transport.worker import Worker


async def test_calls_are_made_in_order_and_their_errors_reach_the_one_who_waits() -> None:
    worker, made = Worker("a worker"), list[int]()

    def fail() -> None:
        raise LookupError("no such thing")

    worker.do(lambda: made.append(1))
    assert await worker.result(lambda: [*made, 2]) == [1, 2]
    with pytest.raises(LookupError, match="no such thing"):
        await worker.result(fail)
    worker.close()


def test_a_call_that_outlives_the_loop_of_the_one_who_waited_disturbs_nobody() -> None:
    """A start that failed while the session was being opened used to end with a traceback of the thread."""
    worker, go_on, done = Worker("a worker"), threading.Event(), threading.Event()

    async def wait() -> None:
        with pytest.raises(TimeoutError):
            await asyncio.wait_for(worker.result(go_on.wait), 0.01)

    asyncio.run(wait())
    go_on.set()
    worker.do(done.set)  # reached only by a thread that is alive
    assert done.wait(10.0)
    worker.close()
