"""A pulse of its own making, work and then sleep: what the work takes is added to every period."""

from __future__ import annotations

from actors import ActorError, Child, Node, Service, Supervisor, Topic, background, publishes
from actors.interfaces.std_msgs.msg import Int32
from actors.interfaces.std_srvs.srv import Trigger
from tests.planted.kit import ok

PULSE = Topic(Int32, "pulse", 10)
CHECK = Service(Trigger, "check")
PERIOD = 0.2


class Checker(Node):
    @CHECK.serve()
    async def check(self, request: Trigger.Request) -> Trigger.Response:
        await self.clock.sleep(0.0)
        return ok()


class Pulse(Node):
    out = publishes(PULSE)

    def __init__(self, on_a_grid: bool) -> None:
        self.on_a_grid = on_a_grid

    @background
    async def beat(self) -> None:
        start, count = self.clock.now(), 0
        while True:
            try:
                await self.call(CHECK, Trigger.Request(), timeout=2.0)
            except ActorError as error:
                self.log.warning("not checked", why=str(error))
            count += 1
            if self.on_a_grid:
                await self.clock.sleep_until(start + count * PERIOD)
                late = 0.0
            else:
                await self.clock.sleep(PERIOD)
                late = self.clock.now() - start - count * PERIOD
            assert late < 0.45, f"beat {count} is {late:.3f} s late"
            self.out(Int32(data=count))


def tree() -> Supervisor:
    return Supervisor("heart", children=[Child(Checker), Child(Pulse, args=(False,))])


def healthy() -> Supervisor:
    """Each beat is due at its own time, computed from the first one."""
    return Supervisor("heart", children=[Child(Checker), Child(Pulse, args=(True,))])
