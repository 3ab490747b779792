"""Three nodes, each of which asks the next one when it is told to: told all at once, each waits for the next. They take the error easy."""

from __future__ import annotations

from actors import ActorError, Child, Node, Service, Supervisor, Topic, background, publishes
from actors.interfaces.std_msgs.msg import Int32
from actors.interfaces.std_srvs.srv import Trigger
from tests.planted.kit import ok, turns

GO = Topic(Int32, "go", 10)
NEXT = {k: Service(Trigger, f"/station_{k}/pass_on") for k in range(3)}


class Station(Node):
    def __init__(self, number: int, free: bool) -> None:
        self.number = number
        self.free = free

    async def on_start(self) -> None:
        self.serve(NEXT[self.number], self.pass_on)

    async def pass_on(self, request: Trigger.Request) -> Trigger.Response:
        return ok()

    @GO.on()
    async def go(self, message: Int32) -> None:
        if message.data != self.number:
            return
        if self.free:
            self.create_task(self.ask(), name="ask")
        else:
            await self.ask()

    async def ask(self) -> None:
        try:
            await self.call(NEXT[(self.number + 1) % 3], Trigger.Request())
        except ActorError as error:
            self.log.warning("not passed on", why=str(error))


class Starter(Node):
    go = publishes(GO)

    @background
    async def start_all(self) -> None:
        while True:
            await self.clock.sleep(1.0)
            for number in range(3):
                self.go(Int32(data=number))
                await turns(10)  # each is done before the next begins


def stations(*, free: bool) -> Supervisor:
    ring = [Child(Station, name=f"station_{k}", args=(k, free)) for k in range(3)]
    return Supervisor("stations", children=[*ring, Child(Starter)])


def tree() -> Supervisor:
    return stations(free=False)


def healthy() -> Supervisor:
    """Each asks in a task, and answers also while it asks."""
    return stations(free=True)
