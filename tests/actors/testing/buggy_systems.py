"""Small systems, each with one planted bug that plain runs never show. For the tests of the simulation."""

from __future__ import annotations

import asyncio

from actors import (
    Action,
    Backoff,
    Child,
    Done,
    GoalCanceled,
    Intensity,
    Node,
    Steps,
    Supervisor,
    Topic,
    every,
    publishes,
)
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.std_msgs.msg import Int32

TICKS = Topic(Int32, "ticks", 10)
WORK = Action(Fibonacci, "work")


class Source(Node):
    """1, 2, 3, ... at 10 Hz."""

    out = publishes(TICKS)

    async def on_start(self) -> None:
        self.count = 0

    @every(hz=10)
    def tick(self) -> None:
        self.count += 1
        self.out(Int32(data=self.count))


class Registry:
    """What two nodes share that should not: a counter, and two locks."""

    def __init__(self) -> None:
        self.total = 0
        self.done = 0
        self.left, self.right = asyncio.Lock(), asyncio.Lock()


class Increment(Node):
    """The race: reads, waits one turn, writes. It works on every tenth number, as its twin does: in plain order one after the other."""

    def __init__(self, shared: Registry, first: bool) -> None:
        self.shared = shared
        self.first = first

    @TICKS.on()
    async def take(self, message: Int32) -> None:
        shared = self.shared
        if message.data % 10:
            return
        if not self.first:  # in plain order this one turn lets the twin finish
            await asyncio.sleep(0)
        before = shared.total
        await asyncio.sleep(0)
        shared.total = before + 1
        shared.done += 1
        assert shared.total == shared.done, "an increment was lost"


def race() -> Supervisor:
    shared = Registry()
    return Supervisor(
        "race",
        children=[
            Child(Source),
            Child(Increment, name="one", args=(shared, True)),
            Child(Increment, name="two", args=(shared, False)),
        ],
    )


class Philosopher(Node):
    """The deadlock: two locks, taken in different orders, with one turn between them."""

    def __init__(self, shared: Registry, turned: bool) -> None:
        self.shared = shared
        self.turned = turned

    @TICKS.on()
    async def eat(self, message: Int32) -> None:
        forks = [self.shared.left, self.shared.right]
        if self.turned:
            await asyncio.sleep(0)  # in plain order the other one is through by now
            await asyncio.sleep(0)
            await asyncio.sleep(0)
            forks.reverse()
        async with forks[0]:
            await asyncio.sleep(0)
            async with forks[1]:
                pass


def deadlock() -> Supervisor:
    shared = Registry()
    return Supervisor(
        "deadlock",
        children=[
            Child(Source),
            Child(Philosopher, name="one", args=(shared, False)),
            Child(Philosopher, name="two", args=(shared, True)),
        ],
    )


class Worker(Node):
    """The lost cancel: whoever cancels during the last of its steps is not heard."""

    @WORK.serve()
    async def work(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
        for k in range(goal.order):
            try:
                await self.clock.sleep(0.05)
            except asyncio.CancelledError:
                if k < goal.order - 1:
                    raise
                await self.clock.sleep(60.0)  # it believes that it is nearly done
            yield Fibonacci.Feedback(sequence=[k])
        yield Done(Fibonacci.Result())


class Boss(Node):
    """Starts work with every tenth number, and cancels it with the one after the next."""

    async def on_start(self) -> None:
        self.newest = 0

    @TICKS.on(concurrent=2)
    async def take(self, message: Int32) -> None:
        self.newest = message.data
        if message.data % 10:
            return
        async with self.send_goal(WORK, Fibonacci.Goal(order=7)) as goal:
            while self.newest < message.data + 2:
                await self.clock.sleep(0.01)
            await goal.cancel()
            try:
                await goal
            except GoalCanceled:
                return


def lost_cancel() -> Supervisor:
    return Supervisor("lost_cancel", children=[Child(Source), Child(Worker), Child(Boss)])


class Fragile(Node):
    """The restart storm: what it says when it starts makes the other one fail, and the other way round, once one of them has failed."""

    said = publishes(Topic(Int32, "said", 10))

    async def on_start(self) -> None:
        self.lives = int(self.__machinery__.incarnation) if self.__machinery__ is not None else 0
        if self.lives > 1:
            self.said(Int32(data=self.lives))

    @Topic(Int32, "said", 10).on()
    def hear(self, message: Int32) -> None:
        if message.data >= self.lives:
            raise RuntimeError("the peer has lost its memory")


def storm() -> Supervisor:
    return Supervisor(
        "storm",
        intensity=Intensity(5, within=10.0),
        children=[
            Child(Source),
            Child(Fragile, name="one", backoff=Backoff(0.1, 0.1)),
            Child(Fragile, name="two", backoff=Backoff(0.1, 0.1)),
        ],
    )


def sound() -> Supervisor:
    """Nothing is wrong with this one."""
    return Supervisor("sound", children=[Child(Source), Child(Listener)])


class Listener(Node):
    async def on_start(self) -> None:
        self.heard = 0

    @TICKS.on()
    def take(self, message: Int32) -> None:
        self.heard = message.data
