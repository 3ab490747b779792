"""A node that does everything that a journal carries, and those around it."""

from __future__ import annotations

import asyncio
from contextlib import suppress

from actors import (
    Aborted,
    Action,
    CallTimeout,
    Child,
    Done,
    GoalAborted,
    GoalCanceled,
    Node,
    Service,
    ServiceFailed,
    ServiceUnavailable,
    Steps,
    System,
    Tick,
    Topic,
    every,
    parameter,
    publishes,
    run,
)
from actors.errors import NodeRestarting
from actors.interfaces.example_interfaces.action import Fibonacci, Fibonacci_Feedback, Fibonacci_Goal, Fibonacci_Result
from actors.interfaces.std_msgs.msg import Float64, Int32, String
from actors.interfaces.std_srvs.srv import (
    SetBool,
    SetBool_Request,
    SetBool_Response,
    Trigger,
    Trigger_Request,
    Trigger_Response,
)
from actors.qos import LATCHED
from actors.replay import Journal
from actors.runtime.declarations import background

NUMBERS = Topic(Int32, "numbers")
MAP = Topic(String, "map", LATCHED)
STREAMED = Topic(Int32, "streamed")
SLOWLY = Topic(Int32, "slowly")
TOLD = Topic(String, "told", 100)
MEASURED = Topic(Float64, "measured", 100)
ASK = Service(Trigger, "ask")
ASK_MANY = Service(Trigger, "ask_many")
SWITCH = Service(SetBool, "switch")
SILENT = Service(Trigger, "silent")
FAILING = Service(Trigger, "failing")
ABSENT = Service(Trigger, "absent")
COUNT = Action(Fibonacci, "count")
CLIMB = Action(Fibonacci, "climb")


def squared(number: int) -> int:
    """Work for another thread or process."""
    return number * number


class Hero(Node):
    """Takes, asks, serves, waits, draws, computes, fails and is restarted; tells all of it on the topic told."""

    told = publishes(TOLD)
    measured = publishes(MEASURED)
    factor = parameter(2, ge=0, le=10)

    async def on_start(self) -> None:
        self.heard = 0
        self.say(f"life {self.incarnation} factor {self.factor} draws {self.rng.random()}")

    def resume(self, state: int) -> None:
        self.before = state

    async def on_stop(self, reason: object) -> None:
        self.say(f"stops: {reason}")

    def say(self, text: str) -> None:
        self.told(String(data=text))

    @NUMBERS.on()
    async def number(self, message: Int32) -> None:
        self.heard += 1
        self.checkpoint(self.heard)
        self.measured(Float64(data=self.factor * message.data + self.clock.now()))
        if message.data % 4 == 0:
            await self.clock.sleep(0.013)
            self.say(f"slept at {self.clock.wall()}")

    @MAP.on()
    def map(self, message: String) -> None:
        self.say(f"map {message.data}")

    @SLOWLY.on(concurrent=2)
    async def slow(self, message: Int32) -> None:
        await asyncio.sleep(0.03)
        self.say(f"slow {message.data}")

    @every(hz=20)
    def tick(self, tick: Tick) -> None:
        self.measured(Float64(data=tick.late))

    @background
    async def streams(self) -> None:
        async for message in self.subscribe(STREAMED):
            self.say(f"streamed {message.data}")

    @background
    async def asks(self) -> None:
        await self.clock.sleep(0.1)
        for service, timeout in ((ASK, 1.0), (FAILING, 1.0), (SILENT, 0.05), (ABSENT, 0.05)):
            try:
                answer = await self.call(service, Trigger.Request(), timeout=timeout)
                self.say(f"answer {answer.message}")
            except (ServiceFailed, CallTimeout, ServiceUnavailable, NodeRestarting) as error:
                self.say(f"{type(error).__name__}: {error}")

    @background
    async def follows(self) -> None:
        with suppress(GoalAborted, GoalCanceled):
            async with self.send_goal(COUNT, Fibonacci.Goal(order=3)) as goal:
                self.say(f"goal {goal.goal_id.hex()}")
                async for feedback in goal:
                    self.say(f"feedback {feedback.sequence.tolist()}")
                self.say(f"result {(await goal).sequence.tolist()}")
        async with self.send_goal(COUNT, Fibonacci.Goal(order=50)) as goal:
            await self.clock.sleep(0.04)
            await goal.cancel("enough")
            self.say(f"ended {await goal.ended()}")

    @background
    async def computes(self) -> None:
        self.say(f"thread {await self.offload(squared, 12, takes=0.02, thread=True)}")
        self.say(f"executor {await asyncio.to_thread(squared, 13)}")

    @ASK_MANY.serve(concurrent=3)
    async def many(self, request: Trigger_Request) -> Trigger_Response:
        await self.clock.sleep(0.02)
        return Trigger.Response(success=True, message=str(self.heard))

    @SWITCH.serve()
    async def switch(self, request: SetBool_Request) -> SetBool_Response:
        if not request.data:
            raise ValueError("not off")
        return SetBool.Response(success=True, message=str(self.clock.now()))

    @CLIMB.accepts
    def may_climb(self, goal: Fibonacci_Goal) -> None:
        self.say(f"asked to climb {goal.order}")

    @CLIMB.serve(arrivals="preempt")
    async def climb(self, goal: Fibonacci_Goal) -> Steps[Fibonacci_Feedback, Fibonacci_Result]:
        climbed: list[int] = []
        for step in range(goal.order):
            climbed.append(step)
            yield Fibonacci.Feedback(sequence=climbed)
            await self.clock.sleep(0.02)
        if goal.order == 2:
            yield Aborted(Fibonacci.Result(sequence=climbed), "too low")
        else:
            yield Done(Fibonacci.Result(sequence=climbed))


class Others(Node):
    """What the hero hears and asks."""

    numbers = publishes(NUMBERS)
    map = publishes(MAP)
    streamed = publishes(STREAMED)
    slowly = publishes(SLOWLY)

    async def on_start(self) -> None:
        self.map(String(data="house"))

    @every(hz=100)
    def more(self, tick: Tick) -> None:
        self.numbers(Int32(data=tick.k))
        if tick.k % 10 == 0:
            self.streamed(Int32(data=tick.k))
            self.slowly(Int32(data=tick.k))

    @ASK.serve()
    async def answer(self, request: Trigger_Request) -> Trigger_Response:
        return Trigger.Response(success=True, message="yes")

    @SILENT.serve(concurrent=10)
    async def never(self, request: Trigger_Request) -> Trigger_Response:
        await asyncio.Event().wait()
        raise AssertionError

    @FAILING.serve()
    async def fail(self, request: Trigger_Request) -> Trigger_Response:
        raise LookupError("nothing there")

    @COUNT.serve(arrivals="parallel")
    async def count(self, goal: Fibonacci_Goal) -> Steps[Fibonacci_Feedback, Fibonacci_Result]:
        for step in range(goal.order):
            yield Fibonacci.Feedback(sequence=[step])
            await self.clock.sleep(0.01)
        yield Done(Fibonacci.Result(sequence=[goal.order]))


class Visitor(Node):
    """Who asks the hero."""

    async def visit(self) -> list[str]:
        """Ask for everything, and give up some of it; what became of it."""
        became: list[str] = []
        became += [str(await self.call(ASK_MANY, Trigger.Request())) for _ in range(2)]
        became.append(str(await self.call(SWITCH, SetBool.Request(data=True))))
        with suppress(ServiceFailed):
            await self.call(SWITCH, SetBool.Request(data=False))
        with suppress(TimeoutError):
            await asyncio.wait_for(self.call(ASK_MANY, Trigger.Request()), 0.005)
        for order in (2, 3):
            async with self.send_goal(CLIMB, Fibonacci.Goal(order=order)) as goal:
                became.append(repr(await goal.ended()))
        async with self.send_goal(CLIMB, Fibonacci.Goal(order=50)) as goal:
            await self.clock.sleep(0.05)
            async with self.send_goal(CLIMB, Fibonacci.Goal(order=1)) as second:  # preempts the first
                became.append(repr(await second.ended()))
            became.append(repr(await goal.ended()))
        async with self.send_goal(CLIMB, Fibonacci.Goal(order=50)) as goal:
            await goal.cancel("changed my mind")
            became.append(repr(await goal.ended()))
        return became


HERO, OTHERS = Child(Hero), Child(Others)


async def story(*more: Child, hero: Child = HERO, seconds: float = 0.3) -> tuple[Journal, list[str]]:
    """The hero's two lives, with a crash in between: its journal, and what the visitor was told."""
    journal = Journal(hero.name)
    async with run(OTHERS, hero, Visitor, *more, observers=(journal,), sinks=(), seed=5) as system:
        became = await lived(system, seconds)
    return journal, became


async def lived(system: System, seconds: float) -> list[str]:
    """What happens to the hero from outside."""
    await system.clock.sleep(seconds)
    became = await system.node("visitor").visit()
    refused, taken = (system.node(Hero).set_parameter("factor", value) for value in (99, 3))
    assert (refused.successful, taken.successful) == (False, True)
    await system.clock.sleep(0.1)
    system.crash(Hero, RuntimeError("struck by lightning"))
    await system.clock.sleep(seconds)
    return became + await system.node("visitor").visit()
