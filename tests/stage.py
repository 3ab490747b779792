"""What the tests of the actors share: a few contracts, and short words for what tests say all the time."""

from __future__ import annotations

from collections.abc import Iterable

from actors import Action, Service, Topic
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import Int32, String
from actors.logs import LogRecord

NUMBERS = Topic(Int32, "numbers", 100)
WORDS = Topic(String, "words")
ADD = Service(AddTwoInts, "add")
COUNT = Action(Fibonacci, "count")


def number(value: int) -> Int32:
    return Int32(data=value)


def word(text: str) -> String:
    return String(data=text)


def two(a: int, b: int) -> AddTwoInts.Request:
    return AddTwoInts.Request(a=a, b=b)


def total(value: int) -> AddTwoInts.Response:
    return AddTwoInts.Response(sum=value)


def order(value: int) -> Fibonacci.Goal:
    return Fibonacci.Goal(order=value)


def step(*sequence: int) -> Fibonacci.Feedback:
    return Fibonacci.Feedback(sequence=sequence)


def result(*sequence: int) -> Fibonacci.Result:
    return Fibonacci.Result(sequence=sequence)


def values(messages: Iterable[Int32]) -> list[int]:
    return [message.data for message in messages]


def events(logs: Iterable[LogRecord], part: str = "") -> list[LogRecord]:
    """The log lines whose event contains `part`."""
    return [record for record in logs if part in record.event]
