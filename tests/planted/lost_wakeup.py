"""Clears the event when the work is done: a wake-up that came during the work is cleared with it."""

from __future__ import annotations

import asyncio

from actors import Child, Node, Supervisor, Topic, background, every, publishes
from actors.interfaces.std_msgs.msg import Int32
from tests.planted.kit import turns

PARTS = Topic(Int32, "parts", 100)


class Belt(Node):
    out = publishes(PARTS)

    @background
    async def move(self) -> None:
        while True:
            await self.clock.sleep(1.0)
            for part in range(2):
                self.out(Int32(data=part))
                await turns(10)


class Packer(Node):
    def __init__(self, careful: bool) -> None:
        self.careful = careful

    async def on_start(self) -> None:
        self.waiting = 0
        self.come = asyncio.Event()

    @PARTS.on()
    def take(self, message: Int32) -> None:
        self.waiting += 1
        self.come.set()

    @background
    async def pack(self) -> None:
        while True:
            await self.come.wait()
            if self.careful:
                self.come.clear()
            parts, self.waiting = self.waiting, 0
            await turns(3)
            self.log.debug("packed", parts=parts)
            if not self.careful:
                self.come.clear()

    @every(hz=3)
    async def look(self) -> None:
        await turns(40)
        assert not self.waiting or self.come.is_set(), f"{self.waiting} parts wait, and nobody packs them"


def tree() -> Supervisor:
    return Supervisor("packing", children=[Child(Belt), Child(Packer, args=(False,))])


def healthy() -> Supervisor:
    """Clears the event before it looks."""
    return Supervisor("packing", children=[Child(Belt), Child(Packer, args=(True,))])
