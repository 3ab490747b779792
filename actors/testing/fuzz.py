"""A virtual loop that runs a program in another legal order for every seed: the same seed, the same order."""

# pyright: reportPrivateUsage=false
from __future__ import annotations

import asyncio
import random
from heapq import heappop, heappush
from typing import Any

from actors.testing.handles import owner
from actors.testing.loop import Entry, VirtualLoop

__all__ = ["FuzzLoop"]

HELD_BACK = 0.25
"""How often all but one of the steps that are ready together wait, so that one task gets ahead of the others."""


class FuzzLoop(VirtualLoop):
    """`VirtualLoop` that shuffles, from `seed`, task steps that are ready together and deadlines of one instant, and lets steps wait.

    asyncio promises no order for any of them: a task whose wake-up comes from a thread or a socket is late by as many
    turns. So a program that breaks under some seed has a race. Plain callbacks keep their order, because transports and
    protocols rely on it. A failing run is repeated by its seed (the order in which anyio cancels the tasks of a group
    follows memory addresses; that no seed can pin down).
    """

    def __init__(self, seed: int, start: float = 0.0) -> None:
        super().__init__(start)
        self.seed = seed
        self._rng = random.Random(seed)
        self._held: list[Any] = []  # steps that are ready and wait for the next iteration

    def __repr__(self) -> str:
        return f"{super().__repr__()[:-1]} seed={self.seed}>"

    @property
    def idle(self) -> bool:
        return super().idle and not self._held

    def advance_to(self, when: float) -> bool:
        return not self._held and super().advance_to(when)

    def _run_once(self) -> None:
        self._shuffle_steps()
        try:
            super()._run_once()
        finally:
            self._ready.extend(self._held)
            self._held.clear()

    def _jump(self) -> None:
        self._shuffle_ties()
        super()._jump()
        self._shuffle_steps()

    def _shuffle_steps(self) -> None:
        """Permute the task steps; sometimes only the first one runs now. None gets ahead of a plain callback that was ready before it: a
        transport is closed, or a future's other callbacks have run, when the task that waited for it goes on."""
        ready = self._ready
        steps = [handle for handle in ready if _is_step(handle)]
        if len(steps) < 2:
            return
        rng = self._rng
        queue: list[Any] = []
        waiting: list[Any] = []
        for handle in ready:
            if _is_step(handle):
                waiting.append(handle)
                continue
            if waiting and rng.random() < 0.5:
                rng.shuffle(waiting)
                queue += waiting
                waiting.clear()
            queue.append(handle)
        rng.shuffle(waiting)
        queue += waiting
        if rng.random() < HELD_BACK:
            _, *self._held = (handle for handle in queue if _is_step(handle))
            held = set(map(id, self._held))
            queue = [handle for handle in queue if id(handle) not in held]
        ready.clear()
        ready.extend(queue)

    def _shuffle_ties(self) -> None:
        """Permute the deadlines of the next instant among their places in the order of scheduling."""
        timers = self._timers
        while timers and self._is_dead(timers[0][3]):
            heappop(timers)
        ties: list[Entry] = []
        while timers and timers[0][0] == (ties or timers)[0][0]:
            ties.append(heappop(timers))
        orders = [order for _, order, _, _ in ties]
        self._rng.shuffle(ties)
        for order, (instant, _, when, item) in zip(orders, ties, strict=True):
            heappush(timers, (instant, order, when, item))


def _is_step(handle: asyncio.Handle) -> bool:
    return isinstance(owner(handle), asyncio.Task)
