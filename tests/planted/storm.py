"""Whenever a base goes its tracker goes with it: one crash is two restarts, and two crashes are one more than the tree allows."""

from __future__ import annotations

from actors import ActorError, Child, Intensity, Node, Service, Supervisor, every
from actors.interfaces.std_srvs.srv import Trigger
from tests.planted.kit import ok

PING = {name: Service(Trigger, f"/{name}/ping") for name in ("base_a", "base_b")}


class Base(Node):
    async def on_start(self) -> None:
        await self.clock.sleep(0.3)
        self.serve(PING[self.name], self.ping)

    async def ping(self, request: Trigger.Request) -> Trigger.Response:
        return ok()


class Tracker(Node):
    def __init__(self, base: str, patient: bool) -> None:
        self.base = base
        self.patient = patient

    @every(hz=5)
    async def track(self) -> None:
        try:
            await self.call(PING[self.base], Trigger.Request())
        except ActorError as error:
            if not self.patient:
                raise
            self.log.warning("no base", why=str(error))


def bases(*, patient: bool) -> Supervisor:
    trackers = [Child(Tracker, name=f"tracker_{name[-1]}", args=(name, patient)) for name in PING]
    return Supervisor(
        "bases", intensity=Intensity(3, within=5.0), children=[*(Child(Base, name=name) for name in PING), *trackers]
    )


def tree() -> Supervisor:
    return bases(patient=False)


def healthy() -> Supervisor:
    """Who asks a base that restarts asks again later."""
    return bases(patient=True)
