"""`replay_topics`: plays a bag without a journal to one node, by the topics that the node hears."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from actors.bag.contents import BagError, BagTopic
from actors.bag.options import PlayOptions
from actors.bag.playing import Player
from actors.bag.reader import BagReader
from actors.bag.schemas import type_of
from actors.bag.selection import Selection, service_of
from actors.errors import described
from actors.interfaces.errors import InterfaceError
from actors.interfaces.registry import get_service
from actors.lifecycle.node import LifecycleNode
from actors.names.names import is_hidden
from actors.replay.alone import check_alone, check_parameters, stop_at
from actors.replay.comparison import Difference
from actors.replay.errors import ReplayError
from actors.replay.published import SHARED, Published
from actors.running.run import run
from actors.runtime.options import identity_of
from actors.supervision.declarations import Child, temporary
from actors.supervision.errors import StartFailed
from actors.supervision.reasons import cause_of
from actors.time.virtual_loop import VirtualLoop

if TYPE_CHECKING:
    from actors.graph.servers import ServerEntry
    from actors.logs import LogSink
    from actors.replay.debugger import Break
    from actors.runtime.node import Node
    from actors.system import System

__all__ = ["TopicsVerdict", "replay_topics"]

SETTLING: Final = 1.0
"""How long a node may still work on what it heard last, seconds of virtual time."""


@dataclass(frozen=True, slots=True)
class TopicsVerdict:
    """What a replay by topics has shown. It can say that a node does otherwise; it cannot say that it does the same, only that nothing else
    was seen.
    """

    node: str
    lacking: tuple[str, ...]
    """The inputs of the node that the bag does not have, each in a few words."""
    fed: Mapping[str, int]
    """Topic -> how many messages of the bag the node was offered."""
    compared: Mapping[str, int]
    """Topic of the node -> how many of the bag's messages were compared."""
    differences: tuple[Difference, ...]
    """The first difference of each topic, in the order in which they were found; stamps are not compared."""
    failure: str
    """The error with which the node ended; empty if it did not fail."""

    @property
    def equal(self) -> bool:
        """Whether there was something to compare, and no difference in it."""
        return bool(self.compared) and not self.differences and not self.failure


def replay_topics(
    path: str | os.PathLike[str],
    node: type[Node] | Child,
    *,
    parameters: Mapping[str, Any] | None = None,
    pause: tuple[str, int] | None = None,
    debugger: Callable[[], object] | None = None,
    sinks: tuple[LogSink, ...] = (),
) -> TopicsVerdict:
    """Play the topics of a bag to one node alone, on virtual time, at the times of their arrival, and compare what it publishes with the
    bag. Runs an event loop.

    The node starts where the bag begins, with its declaration's parameters and these. Requests of its services are fed if they were
    recorded by service introspection. A node that fails is not restarted. `pause` is a topic and a number: a debugger, that of `breakpoint()` or
    `debugger`, is started before the message with that number (from 0) is published there.

    Raises `BagError` for a bag that cannot be read, and `ReplayError` if the node cannot be run alone.
    """
    child = node if isinstance(node, Child) else Child(node)
    loop: Any = VirtualLoop()
    with asyncio.Runner(loop_factory=lambda: loop) as runner, BagReader(path) as bag:
        loop.epoch = bag.metadata.start_ns / 1e9  # the time of day at the start of its systems
        stop = None if pause is None else stop_at(*pause, debugger)
        verdict = runner.run(_Play(bag, child, parameters or {}, stop, sinks).play())
    if stop is not None:
        stop.check_over()
    return verdict


class _Play:
    """One replay by topics. It is attached to the system in which the node runs, as an observer.

    Invariants: `_heard` are the topics to which the node has subscribed so far, `_asked` the services and actions that it has asked for.
    """

    def __init__(
        self,
        bag: BagReader,
        child: Child,
        parameters: Mapping[str, Any],
        pause: Break | None,
        sinks: tuple[LogSink, ...],
    ) -> None:
        check_alone(child)
        check_parameters(child, parameters)
        self._bag, self._sinks = bag, sinks
        self._child = child.replace(restart=temporary, backoff=None, significant=False, process=False, hosts=())
        self._identity = identity_of(self._child, ("system", child.name))
        self._parameters = dict(parameters)
        self._published = Published(bag, self._identity.fqn, pause)
        self._heard: set[str] = set()
        self._asked: set[tuple[str, str]] = set()

    def attach(self, system: System) -> None:
        """Watch the node from its start on."""
        self._published.watch(system)
        system.graph.on_change(lambda: self._look(system))

    async def play(self) -> TopicsVerdict:
        given = {self._identity.fqn: self._parameters} if self._parameters else None
        try:
            async with run(
                self._child, sinks=self._sinks, parameters=given, signals=False, observers=(self,)
            ) as system:
                return await self._played(system)
        except StartFailed as error:
            raise ReplayError(str(error)) from error

    async def _played(self, system: System) -> TopicsVerdict:
        published, fqn = self._published, self._identity.fqn
        kind = type(system.node(fqn))
        fed = {topic.name for topic in self._bag.topics if self._is_fed(topic, kind)}
        options = PlayOptions(selection=Selection(topics=fed), service_requests="service")
        await system.join(Child(Player, args=(self._bag.path, options)))
        await system.node(Player).wait()
        await system.clock.sleep(SETTLING)
        self._look(system)
        published.end()
        counts = {topic.name: count for topic, count in self._bag.metadata.topics.items()}
        return TopicsVerdict(
            fqn, tuple(self._lacking(kind, fed)), {name: counts[name] for name in sorted(fed & self._heard)},
            dict(published.compared), tuple(published.differences.values()), _failure(system),
        )  # fmt: skip

    def _look(self, system: System) -> None:
        """See what the node uses of the graph now."""
        fqn, graph = self._identity.fqn, system.graph
        for topic in graph.topics.values():
            if any(one.node.fqn == fqn for one in topic.readers):
                self._heard.add(topic.name)
        names: list[ServerEntry[Any]] = [*graph.services.values(), *graph.actions.values()]
        for entry in names:
            if fqn in entry.clients and entry.local is None:
                self._asked.add((entry.kind, entry.name))

    def _is_fed(self, topic: BagTopic, kind: type[Node]) -> bool:
        """Whether the node is to be offered the messages of this topic, or sent the requests that are recorded there."""
        service = service_of(topic.name)
        try:
            type_of(topic)
            if service is not None:
                get_service(topic.type.removesuffix("_Event"))
                return service in self._served(kind)
        except (BagError, InterfaceError):
            return False  # the node cannot know a type of which nothing is known
        return not (is_hidden(topic.name) or topic.name in SHARED or topic.name in self._published.topics)

    def _served(self, kind: type[Node]) -> list[str]:
        return [self._identity.service(one.service.name) for one in kind.declarations.services]

    def _lacking(self, kind: type[Node], fed: set[str]) -> Iterator[str]:
        own, declared = self._published, kind.declarations
        for topic in sorted(self._heard - fed - own.topics):
            yield f"topic {topic}: the bag does not have it"
        for topic in sorted(self._heard & own.topics):
            yield f"topic {topic}: what others have sent there, where the node publishes itself"
        for service in self._served(kind):
            if f"{service}/_service_event" not in fed:
                yield f"requests of service {service}"
        for action in declared.actions:
            yield f"goals of action {self._identity.service(action.action.name)}"
        for what, name in sorted(self._asked):
            yield f"answers of {what} {name}"
        if declared.timers:
            yield f"phase of its timers ({', '.join(one.attribute for one in declared.timers)}): they begin with the replay"
        unset = [
            one.name for one in declared.parameters if one.name not in {*self._identity.overrides, *self._parameters}
        ]
        if unset:
            yield f"parameters ({', '.join(unset)}): their defaults are taken"
        if issubclass(kind, LifecycleNode):
            yield "requests to change its lifecycle state"
        yield "its state where the bag begins: it has just started"
        for topic in sorted(own.unclear):
            yield f"which of several publishers has sent what on {topic}: it is not compared"


def _failure(system: System) -> str:
    """With which error the node has ended, which is not restarted; empty if it has not failed."""
    reasons = [one.reason for one in system.reports if one.context == "child_terminated" and one.reason is not None]
    cause = cause_of(reasons[-1]) if reasons else None
    return "" if cause is None else described(cause)
