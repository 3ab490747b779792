"""A node, its client and a script: no error, and every type that a user meets is inferred completely."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import assert_type

import numpy as np
from numpy.typing import NDArray

from actors import (
    Aborted,
    Action,
    Child,
    Done,
    Node,
    Parameter,
    Reject,
    Service,
    SetResult,
    Steps,
    Supervisor,
    Tick,
    Topic,
    background,
    blocking,
    every,
    open_node,
    parameter,
    publishes,
    qos,
    run,
    subscribes,
)
from actors.actions.peers import Outcome
from actors.interfaces.example_interfaces.action import Fibonacci, Fibonacci_Feedback, Fibonacci_Goal, Fibonacci_Result
from actors.interfaces.example_interfaces.srv import AddTwoInts, AddTwoInts_Request, AddTwoInts_Response
from actors.interfaces.std_msgs.msg import Int32, String
from actors.nodes.parameter_server import set_global
from actors.parameters import ParameterDeclaration, on_set, post_set, pre_set
from actors.runtime.retry import retry
from actors.typing import Goal, Publisher, Stream

WORDS = Topic(String, "words")
NUMBERS = Topic(Int32, "numbers", qos.SENSOR_DATA)
ADD = Service(AddTwoInts, "add")
COUNT = Action(Fibonacci, "count")

assert_type(WORDS, Topic[String])
assert_type(ADD, Service[AddTwoInts_Request, AddTwoInts_Response])
assert_type(COUNT, Action[Fibonacci_Goal, Fibonacci_Result, Fibonacci_Feedback])


class Server(Node):
    """Everything that a class can declare."""

    words = publishes(WORDS)
    numbers = subscribes(NUMBERS)
    speed = parameter(0.5, unit="m/s", ge=0.0, le=2.0)
    legs = parameter(4)
    gait = parameter("trot", choices=("trot", "walk"))
    armed = parameter(False)
    gains = parameter([1.0, 2.0])
    sources = parameter([], of=str)

    @speed.validate
    def sane(self, value: float) -> str | None:
        return "too fast" if value > 1.5 else None

    @gains.changed
    def tuned(self, value: tuple[float, ...]) -> None:
        assert_type(self.gains, tuple[float, ...])

    @pre_set
    def rewrite(self, parameters: Sequence[Parameter]) -> Iterable[Parameter]:
        return [one for one in parameters if one.name != "gait"]

    @on_set
    def together(self, parameters: Sequence[Parameter]) -> SetResult:
        return SetResult(len(parameters) < 9, "too many")

    @post_set
    def told(self, parameters: Sequence[Parameter]) -> None: ...

    @every(hz=10)
    async def tick(self) -> None:
        self.words(String(data="tick"))
        await self.words.send(String(data="tock"))

    @every(period=0.5)
    def measured(self, tick: Tick) -> None:
        assert_type(tick.late, float)

    @NUMBERS.on()
    def take(self, message: Int32) -> None:
        assert_type(message.data, int)

    @WORDS.on(concurrent=2)
    async def take_slowly(self, message: String) -> None:
        await self.clock.sleep(1.0)

    @ADD.serve()
    async def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        return AddTwoInts.Response(sum=request.a + request.b)

    @COUNT.accepts
    def check(self, goal: Fibonacci.Goal) -> None:
        if goal.order < 0:
            raise Reject("negative")

    @COUNT.cancels
    async def may_cancel(self, goal: Fibonacci.Goal) -> bool:
        return goal.order > 1

    @COUNT.serve(arrivals="preempt")
    async def count(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
        if goal.order > 1000:
            yield Aborted(Fibonacci.Result(), "too long")
            return
        yield Fibonacci.Feedback(sequence=[1])
        yield Done(Fibonacci.Result(sequence=[1, goal.order]))

    @background
    async def read(self) -> None:
        async for message in self.numbers:
            assert_type(message, Int32)


assert_type(Server.words, Topic[String])
assert_type(Server.numbers, Topic[Int32])
assert_type(Server.speed, ParameterDeclaration[float])


def instance(server: Server) -> None:
    """What is a contract on the class is an endpoint, or a value, on the instance."""
    assert_type(server.words, Publisher[String])
    assert_type(server.numbers, Stream[Int32])
    assert_type(server.numbers.latest, Int32 | None)
    assert_type(server.speed, float)
    assert_type(server.legs, int)
    assert_type(server.gait, str)
    assert_type(server.armed, bool)
    assert_type(server.gains, tuple[float, ...])
    assert_type(server.sources, tuple[str, ...])
    assert_type(server.set_parameter("speed", 1.0), SetResult)


async def client(node: Node) -> None:
    """The asking side."""
    reply = await node.call(ADD, AddTwoInts.Request(a=1, b=2), timeout=1.0)
    assert_type(reply, AddTwoInts_Response)
    assert_type(reply.sum, int)
    assert_type(node.subscribe(WORDS), Stream[String])
    async for word in node.subscribe(WORDS):
        assert_type(word, String)
    assert_type(await node.subscribe(NUMBERS).next(timeout=2.0), Int32)
    assert_type(node.publisher(WORDS), Publisher[String])
    async with node.send_goal(COUNT, Fibonacci.Goal(order=3)) as goal:
        assert_type(goal, Goal[Fibonacci_Result, Fibonacci_Feedback])
        async for feedback in goal:
            assert_type(feedback, Fibonacci_Feedback)
            assert_type(feedback.sequence, NDArray[np.int32])
        result = await goal
        assert_type(result, Fibonacci_Result)
        assert_type(await goal.ended(), Outcome)
    await node.wait_for(ADD, COUNT, timeout=1.0)


async def main() -> None:
    """A tree and a script."""
    tree = Supervisor("robot", children=[Child(Server, parameters={"speed": 1.0})])
    async with run(tree) as system, open_node("script") as node:
        assert_type(system.clock.now(), float)
        assert_type(node, Node)
        node.on(WORDS, lambda message: print(message.data))


def script() -> None:
    """Without an event loop."""
    with blocking.open_node("script", tree=Supervisor("robot", children=[Child(Server)])) as node:
        assert_type(node.call(ADD, AddTwoInts.Request(a=1, b=2)), AddTwoInts_Response)
        assert_type(node.next(WORDS, timeout=1.0), String)
        node.publish(NUMBERS, Int32(data=1))
        result = node.run_goal(COUNT, Fibonacci.Goal(order=1), on_feedback=lambda feedback: print(feedback.sequence))
        assert_type(result, Fibonacci_Result)
        assert_type(node.subscribe(WORDS).next(timeout=1.0), String)
        for message in node.subscribe(WORDS):
            assert_type(message, String)
        with node.send_goal(COUNT, Fibonacci.Goal(order=1)) as goal:
            for feedback in goal:
                assert_type(feedback, Fibonacci_Feedback)
            assert_type(goal.result(), Fibonacci_Result)
        assert_type(node.set_parameter("speed", 1.0), SetResult)
        assert_type(node.run(lambda inner: set_global(inner, "speed", 1.0)), SetResult)


async def again(node: Node) -> None:
    """Retried."""
    assert_type(await retry(node, ADD, AddTwoInts.Request(a=1, b=2), attempts=2), AddTwoInts_Response)
    assert_type(await retry(node, COUNT, Fibonacci.Goal(order=1), on_feedback=print), Fibonacci_Result)
