"""Nodes to which others do something while a journal of them is kept."""

from __future__ import annotations

import asyncio
from threading import Event
from typing import Any

from actors import (
    Action,
    Done,
    Node,
    Service,
    Steps,
    Topic,
    background,
    publishes,
)
from actors.interfaces.example_interfaces.action import Fibonacci, Fibonacci_Feedback, Fibonacci_Goal, Fibonacci_Result
from actors.interfaces.std_msgs.msg import Float64, Int32, String
from actors.interfaces.std_srvs.srv import Trigger, Trigger_Request, Trigger_Response
from actors.qos import LATCHED
from actors.qos.policies import QoS
from tests.actors.replay.story import MEASURED, TOLD

MAPS = Topic(String, "maps", LATCHED.replace(depth=5))
SHORT = Topic(Int32, "short", QoS(depth=5, lifespan=0.05))
OWN = Service(Trigger, "own")
OWN_GOAL = Action(Fibonacci, "own_goal")
DONE = Event()
SHARED: list[Any] = []
"""Objects of the nodes of a test, with which other code reaches into them."""


class Closed(Node):
    """Asks itself, and follows a goal of its own."""

    told = publishes(TOLD)

    @background
    async def asks(self) -> None:
        answer = await self.call(OWN, Trigger.Request())
        async with self.send_goal(OWN_GOAL, Fibonacci.Goal(order=2)) as goal:
            self.told(String(data=f"{answer.message} {(await goal).sequence.tolist()}"))

    @OWN.serve(concurrent=1)
    async def answer(self, request: Trigger_Request) -> Trigger_Response:
        return Trigger.Response(success=True, message="mine")

    @OWN_GOAL.serve()
    async def follow(self, goal: Fibonacci_Goal) -> Steps[Fibonacci_Feedback, Fibonacci_Result]:
        yield Done(Fibonacci.Result(sequence=[goal.order]))


class Patient(Node):
    """Waits for an instant, for a server that comes late, and hears itself."""

    told = publishes(TOLD)

    @TOLD.on()
    def hears(self, message: String) -> None:
        self.log.info("heard", text=message.data)

    @background
    async def waits(self) -> None:
        await self.clock.sleep_until(self.clock.now() + 0.02)
        self.told(String(data=f"at {self.clock.now():.2f}"))
        answer = await self.call(OWN, Trigger.Request())
        self.told(String(data=f"{answer.message} at {self.clock.now():.2f}"))


class Computing(Node):
    """Has work done in a thread."""

    told = publishes(TOLD)

    @background
    async def computes(self) -> None:
        work = asyncio.get_running_loop().run_in_executor(None, DONE.wait)
        SHARED.append(work)
        try:
            await work
        except asyncio.CancelledError:
            self.told(String(data="the work was canceled"))


class Reading(Node):
    """Reads a map that several draw."""

    told = publishes(TOLD)

    @MAPS.on()
    def map(self, message: String) -> None:
        self.told(String(data=message.data))


class Drawing(Node):
    """Draws a map for those who come late."""

    map = publishes(MAPS)

    async def on_start(self) -> None:
        self.map(String(data=f"map of {self.name}"))


class Rash(Node):
    """Brings about its own crash, once."""

    @background
    async def rushes(self) -> None:
        await self.clock.sleep(0.01)
        if self.incarnation == 1:
            SHARED[0].crash("rash", RuntimeError("its own doing"))


class Interrupted(Node):
    """Has a task that other code can end."""

    told = publishes(TOLD)

    async def on_start(self) -> None:
        SHARED.append(self.create_task(self.waits()))

    async def waits(self) -> None:
        try:
            await self.clock.sleep(10)
        finally:
            self.told(String(data=f"interrupted at {self.clock.now():.2f}"))


class Stubborn(Node):
    """Does not end when it is asked to."""

    told = publishes(TOLD)

    async def on_stop(self, reason: object) -> None:
        try:
            await self.clock.sleep(10)
        finally:
            self.told(String(data="was killed"))


class Hearing(Node):
    """Takes messages that age."""

    told = publishes(TOLD)

    @SHORT.on()
    async def short(self, message: Int32) -> None:
        await self.clock.sleep(0.03)
        self.told(String(data=f"in time {message.data}"))


class Worker(Node):
    """Reads the clock and computes in threads."""

    told = publishes(TOLD)
    measured = publishes(MEASURED)

    @background
    async def works(self) -> None:
        await self.clock.sleep(0.001)
        self.measured(Float64(data=self.clock.now()))
        self.told(String(data=str(await asyncio.to_thread(pow, 12, 2))))
        self.told(String(data=str(await self.offload(pow, 13, 2, thread=True))))
        SHARED[0].set()


class Clockwatcher(Worker):
    """Looks at the clock before anything else, and computes nothing."""

    @background
    async def works(self) -> None:
        self.told(String(data=f"since {self.clock.now() - self.clock.now()}"))


class Hasty(Node):
    """Publishes more than a slow node can take before it is too old."""

    short = publishes(SHORT)

    @background
    async def hurries(self) -> None:
        await self.clock.sleep(0.01)
        for number in range(4):
            self.short(Int32(data=number))
