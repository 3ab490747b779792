"""A place is reserved when a goal is accepted and given back by its body: canceled before its first step it is never given back."""

from __future__ import annotations

from actors import Action, ActorError, Child, Done, GoalFailed, Node, Reject, Steps, Supervisor, every
from actors.interfaces.example_interfaces.action import Fibonacci
from tests.planted.kit import turns

PARK = Action(Fibonacci, "park")


class Garage(Node):
    def __init__(self, careful: bool) -> None:
        self.careful = careful

    async def on_start(self) -> None:
        self.reserved = 0

    @PARK.accepts
    def reserve(self, goal: Fibonacci.Goal) -> None:
        if not self.careful:
            self.reserved += 1
            assert self.reserved <= 3, "places are reserved for nobody"
        elif self.reserved >= 3:
            raise Reject("no place is free")

    @PARK.serve(arrivals="preempt")
    async def park(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
        try:
            self.reserved += self.careful
            await self.clock.sleep(0.5)
            yield Done(Fibonacci.Result())
        finally:
            self.reserved -= 1


class Driver(Node):
    """Changes its mind at once, every second time."""

    @every(hz=1)
    async def drive(self) -> None:
        try:
            async with self.send_goal(PARK, Fibonacci.Goal(order=1)) as goal:
                await turns(2)
                await goal.cancel()
                await goal
        except GoalFailed:
            pass
        except ActorError as error:
            self.log.warning("not parked", why=str(error))


def tree() -> Supervisor:
    return Supervisor("garage", children=[Child(Garage, args=(False,)), Child(Driver)])


def healthy() -> Supervisor:
    """What is taken within the body is given back."""
    return Supervisor("garage", children=[Child(Garage, args=(True,)), Child(Driver)])
