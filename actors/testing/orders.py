"""Which of the task steps that are ready together run first: two ways in which a seed chooses another legal order.

`Shuffled` mixes them anew in every turn of the loop: good at changing many pairs. `ByPriority` lets one task be late for as long as the
others have anything to do: good at what takes one particular task, and many turns. It is the scheduler of Burckhardt et al., "A
randomized scheduler with probabilistic guarantees of finding bugs" (2010), made fair.
"""

from __future__ import annotations

import asyncio
from collections import deque
from heapq import heappop, heappush
from random import Random
from typing import Any, Protocol
from weakref import WeakKeyDictionary

from actors.time.handles import owner

__all__ = ["ByPriority", "Order", "Shuffled", "order_of"]

HELD_BACK = 0.25
"""How often all but one of the steps that are ready together wait, so that one task gets ahead of the others."""

MOST_IN_A_ROW = 40
"""The number of steps in a row after which a task that others wait for falls behind them: it polls for what they have to do."""
LONGEST_WAIT = 1000
"""After so many turns a step has its own, whatever its priority: two tasks that keep each other busy must not stop a third for ever."""
AFRESH = 0.05
"""Of the changes, the share that draws all priorities anew."""


class Order(Protocol):
    """A way to choose what runs."""

    @property
    def held(self) -> int:
        """How many steps wait here, though they are ready."""
        ...

    def arrange(self, ready: deque[Any]) -> None:
        """Leave in `ready` what runs in this turn of the loop, in its order; keep, or give back, the rest.

        Plain callbacks stay, in their order, and no step that was kept gets ahead of them: a transport is closed, or a future's other
        callbacks have run, when the task that waited for it goes on.
        """
        ...


def order_of(seed: int, rng: Random) -> Order:
    """Even seeds give a task priority, odd ones shuffle."""
    return Shuffled(rng) if seed % 2 else ByPriority(rng)


class Shuffled:
    """Permutes the steps; sometimes only the first one runs now."""

    def __init__(self, rng: Random) -> None:
        self._rng = rng
        self._held: list[Any] = []

    @property
    def held(self) -> int:
        return len(self._held)

    def arrange(self, ready: deque[Any]) -> None:
        ready.extend(self._held)
        self._held.clear()
        if sum(map(_is_step, ready)) < 2:
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


class ByPriority:
    """Runs one step in each turn: of the task with the highest priority.

    Priorities are drawn when a task is first seen. At some steps, few or many as the seed says, the task that would run falls behind
    all others that are ready; so does one that goes on for too long while they wait.
    """

    def __init__(self, rng: Random) -> None:
        self._rng = rng
        self._changes = 10.0 ** rng.uniform(-2.5, -0.3)
        """The share of steps at which priorities change."""
        self._priorities: WeakKeyDictionary[Any, float] = WeakKeyDictionary()  # whoever forgets a task must see it go
        self._waiting: dict[int, tuple[int, Any]] = {}
        """Number -> the turn in which the step came, the step; the oldest first."""
        self._ranks: list[tuple[float, int]] = []
        """A heap of (minus the priority, number); some of those numbers wait no more."""
        self._turn = self._number = 0
        self._last: object = None
        self._in_a_row = 0

    @property
    def held(self) -> int:
        return len(self._waiting)

    def arrange(self, ready: deque[Any]) -> None:
        come = [handle for handle in ready if _is_step(handle)]
        if not self._waiting and len(come) < 2:
            self._last = None
            return
        self._turn += 1
        for handle in come:
            self._put(handle)
        chosen = self._choose()
        if any(handle is chosen for handle in come):
            queue = [handle for handle in ready if handle is chosen or not _is_step(handle)]
        else:
            queue = [*(handle for handle in ready if not _is_step(handle)), chosen]
        ready.clear()
        ready.extend(queue)

    def _put(self, handle: Any) -> None:
        self._number += 1
        self._waiting[self._number] = self._turn, handle
        heappush(self._ranks, (-self._priority(handle), self._number))

    def _priority(self, handle: Any) -> float:
        task = owner(handle)
        priority = self._priorities.get(task)
        if priority is None:
            priority = self._priorities[task] = self._rng.random()
        return priority

    def _choose(self) -> Any:
        """Take the next step out of those that wait."""
        oldest = next(iter(self._waiting))
        if self._turn - self._waiting[oldest][0] > LONGEST_WAIT:
            return self._waiting.pop(oldest)[1]
        handle = self._highest()
        task = owner(handle)
        self._in_a_row = self._in_a_row + 1 if task is self._last else 1
        if self._waiting and (self._in_a_row > MOST_IN_A_ROW or self._rng.random() < self._changes):
            self._demote(task)
            self._put(handle)
            handle = self._highest()
            task = owner(handle)
            self._in_a_row = 1
        self._last = task
        return handle

    def _highest(self) -> Any:
        while (number := heappop(self._ranks)[1]) not in self._waiting:
            pass
        return self._waiting.pop(number)[1]

    def _demote(self, task: object) -> None:
        """Put a task behind all that are ready; now and then, all those that are not ready get another priority, too."""
        lowest = min(self._priority(handle) for _, handle in self._waiting.values())
        if self._rng.random() < AFRESH:
            self._priorities.clear()
        self._priorities[task] = lowest - self._rng.random()


def _is_step(handle: asyncio.Handle) -> bool:
    return isinstance(owner(handle), asyncio.Task)
