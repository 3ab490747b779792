"""Actions used wrongly: each marked line is one error, for the checkers that it names."""

from __future__ import annotations

from actors import Aborted, Action, Done, Node, Steps
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.std_msgs.msg import Int32, String

COUNT = Action(Fibonacci, "count")


class Wrong(Node):
    @COUNT.serve()  # E
    async def takes_another_goal(self, goal: Int32) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
        yield Done(Fibonacci.Result())

    @COUNT.serve()  # E
    async def feeds_another_type(self, goal: Fibonacci.Goal) -> Steps[Int32, Fibonacci.Result]:
        yield Done(Fibonacci.Result())

    @COUNT.serve()  # E
    async def ends_with_another_type(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Int32]:
        yield Done(Int32(data=1))

    @COUNT.serve()
    async def yields_wrong_things(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
        yield Int32(data=1)  # E
        yield Fibonacci.Result()  # E
        yield Done(Fibonacci.Feedback())  # E
        yield Aborted(String(data="no"))  # E

    @COUNT.serve()  # E
    async def no_generator(self, goal: Fibonacci.Goal) -> Fibonacci.Result:
        return Fibonacci.Result()

    @COUNT.serve(arrivals="first")  # E
    async def unheard_of_policy(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
        yield Done(Fibonacci.Result())

    @COUNT.accepts  # E
    def checks_another_goal(self, goal: Int32) -> None: ...

    @COUNT.accepts  # E
    def answers_with_a_verdict(self, goal: Fibonacci.Goal) -> bool:
        return True

    @COUNT.cancels  # E
    def has_no_verdict(self, goal: Fibonacci.Goal) -> None: ...

    async def ask(self) -> None:
        self.send_goal(COUNT, Int32(data=1))  # E
        self.send_goal(COUNT, Fibonacci.Result())  # E
        self.send_goal(COUNT, Fibonacci.Goal(order="three"))  # E

    async def use(self) -> int:
        async with self.send_goal(COUNT, Fibonacci.Goal(order=3)) as goal:
            async for feedback in goal:
                number: Int32 = feedback  # E
                return number.data
            result: Fibonacci.Feedback = await goal  # E
            order: int = result.sequence  # E
            await goal.cancel(order)  # E
            return goal  # E


def declare() -> None:
    Action(String, "count")  # E
    Action(Fibonacci, 7)  # E
