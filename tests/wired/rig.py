"""A rig whose own node runs in another process than its tree."""

from __future__ import annotations

from functools import partial
from typing import Any, TypeVar, cast

from actors import Child, Node, Topic
from actors.checks import create
from actors.interfaces.message import Message
from actors.logs import DEBUG
from actors.qos import of
from actors.runtime.incarnation import incarnation_of
from actors.runtime.joined import JoinedNode
from actors.system import System
from actors.testing import Probe, Rig
from actors.transport.bridge import connect
from tests.actors.transport.memory import Network

M = TypeVar("M", bound=Message)


class NearSystem(System):
    """Remembers the nodes that join, so that the rig's own one can leave again."""

    def __init__(self, **options: Any) -> None:
        super().__init__(**options)
        self.joined: list[JoinedNode] = []

    async def join(self, child: Child) -> JoinedNode:
        self.joined.append(await super().join(child))
        return self.joined[-1]


class WiredRig(Rig):
    """As `Rig`; `me`, probes, calls and goals belong to `far`, a second system, which knows the first one by the network only."""

    def __init__(self) -> None:
        super().__init__(make_system=partial(create, NearSystem))
        self.network = Network()
        self.far: System | None = None
        self._far_me: JoinedNode | None = None

    async def start(self, *tree: Any, **options: Any) -> System:
        system = await super().start(*tree, transport=self.network.end(), **options)
        assert isinstance(system, NearSystem)
        await system.leave(system.joined[-1])
        self.far = create(System, sinks=(self.logs.append,), level=DEBUG)
        connect(self.far.runtime, self.network.end())
        self.far.open()
        self._far_me = await self.far.join(Child(Node, name="rig"))
        await self.far.runtime.opened()
        await self.quiet()
        return system

    @property
    def me(self) -> Node:
        return super().me if self._far_me is None else self._far_me.node

    def probe(self, topic: Topic[M], *, name: str | None = None, qos: Any = None) -> Probe[M]:
        assert self.far is not None
        me = incarnation_of(self.me)
        entry = self.far.graph.topic(name or me.identity.topic(topic.name))
        probe = create(Probe, me, entry, topic.type, topic.qos if qos is None else of(qos), self.far.clock.now)
        me.endpoints.join(cast("Any", probe))
        return probe

    async def close(self) -> None:
        if self.far is not None:
            await self.far.stop("the test is over")
        await super().close()
        assert not self.network.tokens
