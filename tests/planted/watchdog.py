"""Each goal starts a watchdog and calls it off at its end: a goal that is preempted leaves its own behind."""

from __future__ import annotations

import asyncio

from actors import Action, ActorError, Child, Done, Node, Steps, Supervisor, every
from actors.interfaces.example_interfaces.action import Fibonacci

DOCK = Action(Fibonacci, "dock")


class Docker(Node):
    def __init__(self, careful: bool) -> None:
        self.careful = careful

    @DOCK.serve(arrivals="preempt")
    async def dock(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
        watchdog = self.create_task(self.watch(), name="watch")
        if self.careful:
            try:
                await self.clock.sleep(1.0)
            finally:
                watchdog.cancel()
        else:
            await self.clock.sleep(1.0)
            watchdog.cancel()
        yield Done(Fibonacci.Result())

    async def watch(self) -> None:
        await asyncio.sleep(2.5)
        raise AssertionError("docking takes too long")


class Boss(Node):
    """Docks every 2 s; the goal before has ended by then."""

    @every(hz=0.5)
    async def dock(self) -> None:
        self.create_task(self.one_goal(), name="one_goal")

    async def one_goal(self) -> None:
        try:
            async with self.send_goal(DOCK, Fibonacci.Goal(order=1)) as goal:
                await goal
        except ActorError as error:
            self.log.warning("not docked", why=str(error))


def tree() -> Supervisor:
    return Supervisor("dock", children=[Child(Docker, args=(False,)), Child(Boss)])


def healthy() -> Supervisor:
    """The watchdog is called off however the goal ends."""
    return Supervisor("dock", children=[Child(Docker, args=(True,)), Child(Boss)])
