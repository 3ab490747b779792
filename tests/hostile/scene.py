"""A victim, honest others, and a stranger who knows all their keys: three processes on one simulated network."""

from __future__ import annotations

from collections import Counter
from typing import Any

from actors import Done, Node, QoS, Service, Steps, Topic, publishes, subscribes
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import String
from actors.logs import LogRecord
from actors.qos import LATCHED, Reliability
from actors.transport.keyed.protocol import Outlet
from tests.stage import ADD, COUNT, result, step, total

WORDS = Topic(String, "words", QoS(depth=1000, reliability=Reliability.RELIABLE))
BUILT = Topic(String, "built", LATCHED)
ORACLE = Service(AddTwoInts, "oracle")


class Victim(Node):
    """Has an end of everything: topics, a kept topic, a service, an action."""

    built = subscribes(BUILT)

    def __init__(self) -> None:
        self.heard: list[str] = []

    @WORDS.on()
    def word(self, message: String) -> None:
        if message.data.startswith("honest "):  # what a stranger says can also be readable
            self.heard.append(message.data)

    @ADD.serve()
    async def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        return total((request.a + request.b) % 2**31)

    @COUNT.serve(arrivals="parallel")
    async def count(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
        yield step(goal.order)
        yield Done(result(goal.order))


class Honest(Node):
    """Tells the victim something now and then, and asks it."""

    words = publishes(WORDS)

    def __init__(self) -> None:
        self.told: list[str] = []

    async def talk(self, number: int) -> None:
        """A word, a call and a goal. Raises if the victim does not answer as it should."""
        self.told.append(f"honest {number}")
        self.words(String(data=self.told[-1]))
        answer = await self.call(ADD, AddTwoInts.Request(a=number, b=1), timeout=60.0)
        assert answer == total(number + 1)
        async with self.send_goal(COUNT, Fibonacci.Goal(order=7)) as goal:
            assert await goal == result(7)


class Stranger(Node):
    """The name under which the tokens of the hostile process stand."""


class Tokens:
    """The `Events` of the hostile process: it learns all tokens that the others show."""

    def __init__(self) -> None:
        self.tokens: list[str] = []

    def appeared(self, token: str) -> None:
        self.tokens.append(token)

    def vanished(self, token: str) -> None:
        """Nothing."""

    def wanted(self, outlet: Outlet) -> None:
        """Nothing."""

    def link(self, session: str, up: bool) -> None:
        """Nothing."""


class Logs:
    """What the victim has logged, counted by line and place; not kept, so that its size says nothing about the victim's."""

    def __init__(self) -> None:
        self.lines: Counter[tuple[str, str]] = Counter()
        self.unreadable = 0
        """The figure that the victim gives when it stops."""

    def __call__(self, record: LogRecord) -> None:
        fields: dict[str, Any] = dict(record.fields)
        place = fields.get("topic") or fields.get("service") or fields.get("key") or ""
        self.lines[record.event, str(place)] += 1
        if record.event == "data of other processes could not be read":
            self.unreadable = fields["count"]
