"""Looks at a parameter before and after a wait and takes it for unchanged, though it has changed, and changed back."""

from __future__ import annotations

from actors import ActorError, Child, Node, Service, Supervisor, background, every, parameter
from actors.interfaces.std_srvs.srv import Trigger
from tests.planted.kit import ok, turns

GUARD = Service(Trigger, "guard")


class Guard(Node):
    @GUARD.serve()
    async def agree(self, request: Trigger.Request) -> Trigger.Response:
        return ok()


class Mover(Node):
    mode = parameter("go")

    def __init__(self, careful: bool) -> None:
        self.careful = careful

    async def on_start(self) -> None:
        self.holds = 0

    @background
    async def hold_now_and_then(self) -> None:
        while True:
            await self.clock.sleep(1.0)
            await turns(12)  # whoever moves has moved by now
            self.set_parameter("mode", "hold")
            self.holds += 1
            await turns(2)
            self.set_parameter("mode", "go")

    @every(hz=1)
    async def move(self) -> None:
        mode, holds = self.mode, self.holds
        try:
            await self.call(GUARD, Trigger.Request())
        except ActorError as error:
            self.log.warning("may not move", why=str(error))
            return
        if self.mode != mode or (self.careful and holds != self.holds):
            return
        assert mode != "go" or holds == self.holds, "moves, and was told to hold meanwhile"


def tree() -> Supervisor:
    return Supervisor("moving", children=[Child(Guard), Child(Mover, args=(False,))])


def healthy() -> Supervisor:
    """Counts the changes, and compares the counts."""
    return Supervisor("moving", children=[Child(Guard), Child(Mover, args=(True,))])
