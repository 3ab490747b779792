"""Configured is what has begun to load: whoever activates it before that is over finds no map."""

from __future__ import annotations

import asyncio

from actors import ActorError, Child, LifecycleNode, Node, Service, Supervisor, Topic, background, publishes
from actors.interfaces.lifecycle_msgs.msg import Transition
from actors.interfaces.lifecycle_msgs.srv import ChangeState
from actors.interfaces.std_msgs.msg import Int32
from actors.lifecycle import HookResult, LifecycleState
from tests.planted.kit import turns

CHANGE = Service(ChangeState, "/planner/change_state")
ROUTE = Topic(Int32, "route", 1)


class Planner(LifecycleNode):
    out = publishes(ROUTE)

    def __init__(self, careful: bool) -> None:
        self.careful = careful
        self.map: list[int] | None = None

    async def on_configure(self, previous: LifecycleState) -> HookResult | None:
        self.loading: asyncio.Task[None] = self.create_task(self.load(), name="load")
        return None

    async def load(self) -> None:
        await turns(3)
        self.map = [1, 2, 3]

    async def on_activate(self, previous: LifecycleState) -> HookResult | None:
        if self.careful:
            await asyncio.wait([self.loading])
        if self.map is None:
            return HookResult.FAILURE
        self.out(Int32(data=self.map[0]))
        return None


class Manager(Node):
    @background
    async def bring_up(self) -> None:
        for label in ("configure", "activate"):
            try:
                answer = await self.call(CHANGE, ChangeState.Request(transition=Transition(label=label)))
            except ActorError as error:
                self.log.warning("not brought up", why=str(error))
                return
            if label == "configure" and not answer.success:  # it is up already
                return
            assert answer.success, "activated without a map"
            await turns(6)


def planning(*, careful: bool) -> Supervisor:
    return Supervisor("planning", children=[Child(Planner, args=(careful,)), Child(Manager)])


def tree() -> Supervisor:
    return planning(careful=False)


def healthy() -> Supervisor:
    """Activation waits for what configuration has begun."""
    return planning(careful=True)
