"""Questions and answers on two topics, without numbers: the answer to the last question is taken for that to this one."""

from __future__ import annotations

import asyncio

from actors import Child, Node, Supervisor, Topic, every, publishes, subscribes
from actors.interfaces.std_msgs.msg import Int32

QUESTION, ANSWER = Topic(Int32, "question", 10), Topic(Int32, "answer", 10)


class Oracle(Node):
    out = publishes(ANSWER)

    @QUESTION.on()
    def answer(self, message: Int32) -> None:
        self.out(Int32(data=10 * message.data))


class Seeker(Node):
    ask = publishes(QUESTION)
    answers = subscribes(ANSWER)

    def __init__(self, careful: bool) -> None:
        self.careful = careful
        self.number = 0

    @every(hz=4)
    async def seek(self) -> None:
        self.number += 1
        self.ask(Int32(data=self.number))
        try:
            async with asyncio.timeout(0.1):
                answer = (await anext(aiter(self.answers))).data
                while self.careful and answer != 10 * self.number:
                    answer = (await anext(aiter(self.answers))).data
        except TimeoutError:
            return
        assert answer == 10 * self.number, f"the answer to {self.number} is not {answer}"


def tree() -> Supervisor:
    return Supervisor("oracle", children=[Child(Oracle), Child(Seeker, args=(False,))])


def healthy() -> Supervisor:
    """Leaves the answers to other questions alone."""
    return Supervisor("oracle", children=[Child(Oracle), Child(Seeker, args=(True,))])
