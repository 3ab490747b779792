"""The blocking face used wrongly: each marked line is one error, for the checkers that it names."""

from __future__ import annotations

from actors import Action, Service, Topic, blocking
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import Int32, String

WORDS = Topic(String, "words")
ADD = Service(AddTwoInts, "add")
COUNT = Action(Fibonacci, "count")


def take_number(message: Int32) -> None: ...


with blocking.open_node("script") as node:
    node.publish(WORDS, Int32(data=1))  # E
    node.call(ADD, AddTwoInts.Response(sum=1))  # E
    number: Int32 = node.next(WORDS)  # E
    node.next(WORDS, 1.0)  # E
    node.run_goal(COUNT, Fibonacci.Result())  # E
    node.run_goal(COUNT, Fibonacci.Goal(order=1), on_feedback=take_number)  # E
    total: int = node.run_goal(COUNT, Fibonacci.Goal(order=1))  # E
    node.send_goal(COUNT, Fibonacci.Result())  # E
    odd: Int32 = node.subscribe(WORDS).next()  # E

with blocking.open_node("script", tree=WORDS):  # E
    pass
