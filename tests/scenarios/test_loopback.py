"""The stand-ins of the loop-back tests: what comes over is made from bytes, and is another object."""

from __future__ import annotations

import pytest

from actors import Done, Node, Reject, Steps
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.std_srvs.srv import SetBool
from tests.stage import COUNT, result, step

SWITCH = pytest.importorskip("actors").Service(SetBool, "switch")


class Server(Node):
    """Keeps what it was asked, and what it answered."""

    def __init__(self) -> None:
        self.seen: list[object] = []

    @SWITCH.serve()
    async def switch(self, request: SetBool.Request) -> SetBool.Response:
        self.seen = [request, SetBool.Response(message="\ud800" if request.data else "done")]
        return self.seen[1]  # type: ignore[return-value]

    @COUNT.accepts
    def check(self, goal: Fibonacci.Goal) -> None:
        if goal.order < 0:
            raise Reject("too few")

    @COUNT.serve()
    async def count(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
        self.seen = [goal, step(1), result(1)]
        yield self.seen[1]  # type: ignore[misc]
        yield Done(self.seen[2])  # type: ignore[misc]
