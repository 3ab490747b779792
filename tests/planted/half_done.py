"""A transfer in two steps in a store that outlives the node: one that dies between them has taken what nobody was given."""

from __future__ import annotations

from actors import ActorError, Child, Node, Service, Supervisor, every
from actors.interfaces.std_srvs.srv import Trigger
from tests.planted.kit import ok

STAMP = Service(Trigger, "stamp")


class Notary(Node):
    @STAMP.serve()
    async def stamp(self, request: Trigger.Request) -> Trigger.Response:
        await self.clock.sleep(0.01)
        return ok()


class Clerk(Node):
    def __init__(self, store: dict[str, int], careful: bool) -> None:
        self.store = store
        self.careful = careful

    async def on_start(self) -> None:
        assert sum(self.store.values()) == 100, f"{self.store} is not 100"

    @every(hz=1)
    async def transfer(self) -> None:
        store = self.store
        try:
            if self.careful:
                await self.call(STAMP, Trigger.Request())
                store.update(left=store["left"] - 1, right=store["right"] + 1)
            else:
                store["left"] -= 1
                try:
                    await self.call(STAMP, Trigger.Request())
                except ActorError:
                    store["left"] += 1
                    raise
                store["right"] += 1
        except ActorError as error:
            self.log.warning("not stamped", why=str(error))


def office(*, careful: bool) -> Supervisor:
    return Supervisor("office", children=[Child(Notary), Child(Clerk, args=({"left": 60, "right": 40}, careful))])


def tree() -> Supervisor:
    return office(careful=False)


def healthy() -> Supervisor:
    """Waits first, and changes both in one step."""
    return office(careful=True)
