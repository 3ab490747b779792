"""Programs for the tests: ``python -m tests.stories.programs NODE`` runs one of these nodes as a user would, until it is ended."""

from __future__ import annotations

import asyncio
import os
import sys

from actors import Action, ActorError, Child, Done, Node, Service, Steps, run
from actors.interfaces.example_interfaces.action import Fibonacci, Fibonacci_Feedback, Fibonacci_Goal, Fibonacci_Result
from actors.interfaces.std_srvs.srv import Trigger, Trigger_Request, Trigger_Response
from actors.transport.environment import transport_from_environment

PING, PONG, SLOW = (Service(Trigger, name) for name in ("ping", "pong", "slow"))
COUNT = Action(Fibonacci, "count")


class Ping(Node):
    """Answers ping with what pong says."""

    @PING.serve()
    async def ping(self, request: Trigger_Request) -> Trigger_Response:
        try:
            return await self.call(PONG, request, timeout=20.0)
        except ActorError as error:
            return Trigger.Response(message=f"{type(error).__name__}: {error}")


class Pong(Node):
    """Answers pong with what ping says."""

    @PONG.serve()
    async def pong(self, request: Trigger_Request) -> Trigger_Response:
        try:
            return await self.call(PING, request, timeout=20.0)
        except ActorError as error:
            return Trigger.Response(message=f"{type(error).__name__}: {error}")


class Slow(Node):
    """Serves what it never finishes, and fails when it is pinged."""

    @SLOW.serve(concurrent=2)
    async def slow(self, request: Trigger_Request) -> Trigger_Response:
        print("asked", flush=True)
        await asyncio.Event().wait()
        return Trigger.Response()

    @PING.serve()
    async def ping(self, request: Trigger_Request) -> Trigger_Response:
        raise OSError("no such port")

    @COUNT.serve()
    async def count(self, goal: Fibonacci_Goal) -> Steps[Fibonacci_Feedback, Fibonacci_Result]:
        yield Fibonacci.Feedback(sequence=[0, 1])
        await asyncio.Event().wait()
        yield Done(Fibonacci.Result(sequence=[]))


async def main(name: str) -> None:
    node = {"ping": Ping, "pong": Pong, "slow": Slow}[name]
    async with run(Child(node), transport=transport_from_environment(os.environ)) as system:
        await system.wait()


if __name__ == "__main__":
    asyncio.run(main(sys.argv[1]))
