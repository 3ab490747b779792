"""An action with room for one goal that waits. The urgent goal is sure to find room, as long as the others are on time."""

from __future__ import annotations

from actors import Action, ActorError, Child, Done, GoalRejected, Node, Steps, Supervisor, every
from actors.actions import queue
from actors.interfaces.example_interfaces.action import Fibonacci

LIFT = Action(Fibonacci, "lift")


class Crane(Node):
    @LIFT.serve(arrivals=queue(1))
    async def lift(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
        await self.clock.sleep(goal.order / 10.0)
        yield Done(Fibonacci.Result())


class Routine(Node):
    """Lifts something for 1.2 s, every 4 s."""

    @every(hz=0.25)
    async def lift(self) -> None:
        try:
            async with self.send_goal(LIFT, Fibonacci.Goal(order=12)) as goal:
                await goal
        except ActorError as error:
            self.log.warning("not lifted", why=str(error))


class Urgent(Node):
    """Must lift something while the second routine goal is under way."""

    def __init__(self, retries: bool) -> None:
        self.retries = retries

    @every(hz=0.25)
    async def lift(self) -> None:
        await self.clock.sleep(1.5)
        while True:
            try:
                async with self.send_goal(LIFT, Fibonacci.Goal(order=1)) as goal:
                    await goal
                    return
            except GoalRejected:
                assert self.retries, "an urgent goal was refused"
            except ActorError as error:
                self.log.warning("not lifted", why=str(error))
                return
            await self.clock.sleep(0.5)


def cranes(*, retries: bool) -> Supervisor:
    routine = [Child(Routine, name="one"), Child(Routine, name="two")]
    return Supervisor("cranes", children=[Child(Crane), *routine, Child(Urgent, args=(retries,))])


def tree() -> Supervisor:
    return cranes(retries=False)


def healthy() -> Supervisor:
    """An urgent goal that is refused is sent again."""
    return cranes(retries=True)
