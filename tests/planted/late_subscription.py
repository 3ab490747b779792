"""Asks for a reading and subscribes when it has been promised: if the reading comes first, it is waited for in vain."""

from __future__ import annotations

import asyncio

from actors import ActorError, Child, Node, Service, Supervisor, Topic, every, publishes
from actors.interfaces.std_msgs.msg import Int32
from actors.interfaces.std_srvs.srv import Trigger
from tests.planted.kit import ok, turns

READING = Topic(Int32, "reading", 1)
MEASURE = Service(Trigger, "measure")


class Sensor(Node):
    out = publishes(READING)

    @MEASURE.serve()
    async def measure(self, request: Trigger.Request) -> Trigger.Response:
        self.create_task(self.work(), name="work")
        return ok()

    async def work(self) -> None:
        await turns(8)
        self.out(Int32(data=1))


class Reader(Node):
    def __init__(self, careful: bool) -> None:
        self.careful = careful

    @every(hz=0.5)
    async def read(self) -> None:
        try:
            if self.careful:
                await self.subscribed_first()
            else:
                await self.asked_first()
        except (ActorError, TimeoutError) as error:
            self.log.warning("no reading", why=str(error))

    async def asked_first(self) -> None:
        await self.call(MEASURE, Trigger.Request())
        readings = self.subscribe(READING)
        await anext(aiter(readings))
        readings.close()

    async def subscribed_first(self) -> None:
        readings = self.subscribe(READING)
        try:
            await self.call(MEASURE, Trigger.Request())
            async with asyncio.timeout(1.0):
                await anext(aiter(readings))
        finally:
            readings.close()


def tree() -> Supervisor:
    return Supervisor("reading", children=[Child(Sensor), Child(Reader, args=(False,))])


def healthy() -> Supervisor:
    """Subscribes before it asks, and does not wait for ever."""
    return Supervisor("reading", children=[Child(Sensor), Child(Reader, args=(True,))])
