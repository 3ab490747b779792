"""The timeouts of calls whose node has left the recording: the replay lets them pass, in the order in which they are due."""

from __future__ import annotations

import asyncio
import math
from dataclasses import dataclass, field
from typing import Any

from actors.replay.replay_loop import ReplayDeadlines


@dataclass
class Call:
    name: str
    future: asyncio.Future[Any] = field(default_factory=lambda: asyncio.get_running_loop().create_future())
    due: float = 0.0

    def late(self) -> BaseException:
        return TimeoutError(self.name)


async def test_the_call_that_is_due_first_fails_and_the_others_wait_on() -> None:
    deadlines = ReplayDeadlines(lambda: 10.0)
    long, short, answered = Call("long"), Call("short"), Call("answered")
    for call, timeout in ((long, 5.0), (short, 2.0), (answered, 1.0)):
        deadlines.watch(call, timeout)
    answered.future.set_result(None)
    assert (deadlines.due, deadlines.waiting()) == (12.0, [long, short])

    deadlines.expire()

    assert isinstance(short.future.exception(), TimeoutError)
    assert (long.future.done(), deadlines.due) == (False, 15.0)
    deadlines.close()
    assert (deadlines.waiting(), deadlines.due) == ([], math.inf)
