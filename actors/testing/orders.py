"""Orders of execution: two ways in which a seed chooses which of the task steps that are ready together run first.

`Shuffled` permutes them in every turn of the loop, which changes the order of many pairs. `ByPriority` can delay one task for as long as
the others have anything to do, which finds failures that need one particular task to be late for many turns. It is the scheduler of
Burckhardt et al., "A randomized scheduler with probabilistic guarantees of finding bugs" (2010), with added fairness.
"""

from __future__ import annotations

import asyncio
from collections import deque
from heapq import heappop, heappush
from random import Random
from typing import Protocol
from weakref import WeakKeyDictionary

from actors.time.handles import owner

HELD_BACK = 0.25
"""The share of turns in which only one of the ready steps runs, so that one task gets ahead of the others."""

MOST_IN_A_ROW = 40
"""The number of steps in a row after which a task is moved behind the others that are ready: it may be polling for their results."""
LONGEST_WAIT = 1000
"""The number of turns after which a step runs regardless of its priority, so that two tasks that keep each other busy cannot starve a
third."""
AFRESH = 0.05
"""The share of priority changes that draw all priorities again."""


class Order(Protocol):
    """A way to choose which steps run next."""

    @property
    def held(self) -> int:
        """The number of steps that are ready but held back here."""
        ...

    def arrange(self, ready: deque[asyncio.Handle]) -> None:
        """Leave in `ready`, in order, what runs in this turn of the loop. Hold back the rest, and put back steps that were held back
        before.

        Plain callbacks stay in their order, and no step that was held back runs before them: a transport has been closed, and the other
        callbacks of a future have run, before the task that waited for it resumes.
        """
        ...


def order_of(seed: int, rng: Random) -> Order:
    """Return the order for a seed: `ByPriority` for an even seed, `Shuffled` for an odd one."""
    return Shuffled(rng) if seed % 2 else ByPriority(rng)


class Shuffled:
    """Permutes the steps. In some turns only the first of them runs."""

    def __init__(self, rng: Random) -> None:
        self._rng = rng
        self._held: list[asyncio.Handle] = []

    @property
    def held(self) -> int:
        return len(self._held)

    def arrange(self, ready: deque[asyncio.Handle]) -> None:
        ready.extend(self._held)
        self._held.clear()
        if sum(map(_is_step, ready)) < 2:
            return
        rng = self._rng
        queue: list[asyncio.Handle] = []
        waiting: list[asyncio.Handle] = []
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
    """Runs one step per turn, that of the task with the highest priority.

    The priority of a task is drawn when it is first seen. At some steps, few or many depending on the seed, the task that would run is
    moved behind all others that are ready. So is a task that has run for too many steps in a row while others wait.

    Invariants:

    * Each step that is held back is in `_waiting` under its number, oldest first, and has an entry in `_ranks`.
    * A number in `_ranks` that is not in `_waiting` belongs to a step that has run; it is skipped.
    """

    def __init__(self, rng: Random) -> None:
        self._rng = rng
        self._changes = 10.0 ** rng.uniform(-2.5, -0.3)
        """The share of steps at which priorities change."""
        # Weak, so that a task that the program has dropped is not kept alive.
        self._priorities: WeakKeyDictionary[object, float] = WeakKeyDictionary()
        self._waiting: dict[int, tuple[int, asyncio.Handle]] = {}
        """Number -> (the turn in which the step arrived, the step), oldest first."""
        self._ranks: list[tuple[float, int]] = []
        """A heap of (minus the priority, number)."""
        self._turn = self._number = 0
        self._last: object = None
        self._in_a_row = 0

    @property
    def held(self) -> int:
        return len(self._waiting)

    def arrange(self, ready: deque[asyncio.Handle]) -> None:
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

    def _put(self, handle: asyncio.Handle) -> None:
        self._number += 1
        self._waiting[self._number] = self._turn, handle
        heappush(self._ranks, (-self._priority(handle), self._number))

    def _priority(self, handle: asyncio.Handle) -> float:
        task = owner(handle)
        priority = self._priorities.get(task)
        if priority is None:
            priority = self._priorities[task] = self._rng.random()
        return priority

    def _choose(self) -> asyncio.Handle:
        """Take the next step from those held back."""
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

    def _highest(self) -> asyncio.Handle:
        while (number := heappop(self._ranks)[1]) not in self._waiting:
            pass
        return self._waiting.pop(number)[1]

    def _demote(self, task: object) -> None:
        """Give a task a lower priority than all that are ready. Sometimes all priorities of other tasks are drawn again."""
        lowest = min(self._priority(handle) for _, handle in self._waiting.values())
        if self._rng.random() < AFRESH:
            self._priorities.clear()
        self._priorities[task] = lowest - self._rng.random()


def _is_step(handle: asyncio.Handle) -> bool:
    return isinstance(owner(handle), asyncio.Task)
