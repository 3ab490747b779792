"""Says once that there is work: a worker whose host is cut off at that moment is not woken when it is back, and both wait for ever."""

from __future__ import annotations

from actors import Child, Node, Supervisor, Topic, every, publishes
from actors.interfaces.std_msgs.msg import Int32

WORK, DONE = Topic(Int32, "work"), Topic(Int32, "done")
PATIENCE = 12.0
"""Seconds for which a worker that is connected may not have done its work."""
PERIOD = 0.5


class Dispatcher(Node):
    work = publishes(WORK)

    def __init__(self, repeats: bool) -> None:
        self.repeats = repeats

    async def on_start(self) -> None:
        self.job = 1
        self.told = False
        self.waited = 0.0

    @DONE.on()
    def done(self, message: Int32) -> None:
        if message.data == self.job:
            self.job += 1
            self.told = False
            self.waited = 0.0

    @every(period=PERIOD)
    def dispatch(self) -> None:
        if not self.work.subscription_count:
            return
        if not self.told or self.repeats:
            self.told = True
            self.work(Int32(data=self.job))
        self.waited += PERIOD
        assert self.waited < PATIENCE, f"job {self.job} waits, and the worker as well"


class Worker(Node):
    done = publishes(DONE)

    @WORK.on()
    async def work(self, message: Int32) -> None:
        await self.clock.sleep(0.2)
        self.done(Int32(data=message.data))


def both(*, repeats: bool) -> dict[str, Supervisor]:
    return {
        "office": Supervisor("office_tree", children=[Child(Dispatcher, args=(repeats,))]),
        "shop": Supervisor("shop_tree", children=[Child(Worker)]),
    }


def tree() -> dict[str, Supervisor]:
    return both(repeats=False)


def healthy() -> dict[str, Supervisor]:
    """Says so until it is done."""
    return both(repeats=True)
