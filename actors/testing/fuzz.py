"""An event loop on virtual time that runs a program in a different legal order for every seed, and in the same order for the same seed."""

# pyright: reportPrivateUsage=false
from __future__ import annotations

import random
from heapq import heappop, heappush

from actors.testing.orders import order_of
from actors.time.handles import is_dead
from actors.time.virtual_loop import Entry, VirtualLoop


class FuzzLoop(VirtualLoop):
    """A `VirtualLoop` in which `seed` chooses the order of task steps that are ready together and of deadlines at the same instant.

    asyncio does not define these orders: a wake-up from a thread or a socket may delay a task by any number of turns. A program that fails
    under some seed therefore has a race. Plain callbacks keep their order, because transports and protocols depend on it. A failing run is
    repeated by its seed. The exception is the order in which anyio cancels the tasks of a group: it depends on memory addresses and is not
    controlled by the seed.
    """

    def __init__(self, seed: int, start: float = 0.0) -> None:
        super().__init__(start)
        self.seed = seed
        self._rng = random.Random(seed)
        self._order_of_steps = order_of(seed, self._rng)
        self._share = 0
        """The number of steps still to run until they count as one turn of the loop: in the plain order, all of them run in one turn."""

    def __repr__(self) -> str:
        return f"{super().__repr__()[:-1]} seed={self.seed}>"

    @property
    def idle(self) -> bool:
        return super().idle and not self._order_of_steps.held

    def advance_to(self, when: float) -> bool:
        return not self._order_of_steps.held and super().advance_to(when)

    def _run_once(self) -> None:
        steps = self._order_of_steps
        steps.arrange(self._ready)
        if held := steps.held:
            self._share -= 1
            if self._share > 0:
                self._spins -= 1
            else:
                self._share = held
        super()._run_once()

    def _jump(self) -> None:
        self._shuffle_ties()
        super()._jump()
        self._order_of_steps.arrange(self._ready)

    def _shuffle_ties(self) -> None:
        """Permute the deadlines of the next instant among their places in the order of scheduling."""
        timers = self._timers
        while timers and is_dead(timers[0][3]):
            heappop(timers)
        ties: list[Entry] = []
        while timers and timers[0][0] == (ties or timers)[0][0]:
            ties.append(heappop(timers))
        orders = [order for _, order, _, _ in ties]
        self._rng.shuffle(ties)
        for order, (instant, _, when, item) in zip(orders, ties, strict=True):
            heappush(timers, (instant, order, when, item))
