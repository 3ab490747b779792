"""What `doctor` looks at, and what it says about it: plain values, so that each check is a function of them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Final, Literal

from actors.names.names import is_hidden
from actors.transport.figures import NodeFigures, ProcessFigures
from actors.transport.format.tokens import EndpointKind
from actors.transport.protocol import RemoteNode
from cli.graph.view import PUBLISHER, SERVER, SUBSCRIPTION, Endpoint

STARVED: Final = 0.2
"""The share of its time for which a process may wait for a processor."""

Word = Literal["topic", "service", "node"]


@dataclass(frozen=True)
class Finding:
    """Something that keeps a graph from working, or may: what it is, why, what was measured, and what helps."""

    subject: str
    """The topic, service, node or process that it is about."""
    cause: str
    measured: str
    remedy: str = ""
    level: Literal["problem", "note", "info"] = "problem"
    """A note may be meant so; an info only says what is so."""


@dataclass(frozen=True)
class Told:
    """Two reports of one process, one after the other."""

    before: ProcessFigures
    last: ProcessFigures

    @property
    def seconds(self) -> float:
        """From the first to the second."""
        return self.last.at - self.before.at

    @property
    def is_starved(self) -> bool:
        """Whether its event loop had to wait for a processor for much of that time."""
        return self.last.starved - self.before.starved > STARVED * self.seconds

    def nodes(self) -> Iterator[tuple[NodeFigures, NodeFigures]]:
        """Each node that is in both, before and now."""
        known = {node.name: node for node in self.before.nodes}
        for node in self.last.nodes:
            if node.name in known:
                yield known[node.name], node


@dataclass(frozen=True)
class Listened:
    """What came on a topic while it was listened to."""

    messages: int
    seconds: float
    lag: float | None = None
    """The least time from sending to arrival, by the clocks of both, seconds; negative if that of the sender is ahead."""


@dataclass(frozen=True)
class Observation:
    """A graph, and the process that looks at it, at one time."""

    domain: int = 0
    nodes: tuple[RemoteNode, ...] = ()
    """Of all domains."""
    ends: tuple[Endpoint, ...] = ()
    """The endpoints of this domain."""
    told: tuple[Told, ...] = ()
    processes: tuple[ProcessFigures, ...] = ()
    """The last report of each process that has told at least once."""
    lags: Mapping[str, float] = field(default_factory=dict[str, float])
    """By the session of a process: the same of its reports."""
    listened: Mapping[str, Listened] = field(default_factory=dict[str, Listened])
    """By topic."""
    implementation: str = ""
    """RMW_IMPLEMENTATION, as it is set."""
    security: tuple[str, ...] = ()
    """What `security show` says; empty without security."""
    robots: tuple[str, ...] = ()
    """Where on the path of modules a package or module named ``robot`` is, the one that is used first."""
    asked: tuple[Word, str] | None = None
    """The topic, service or node that was asked for; None for all."""
    wanted: str = ""
    """The type that the asked topic or service should have; empty if none was given."""

    def here(self) -> list[RemoteNode]:
        """The nodes of this domain that tools show."""
        return [node for node in self.nodes if node.domain_id == self.domain and not is_hidden(node.fqn)]

    def asks_for(self, word: Word, name: str) -> bool:
        """Whether exactly this was asked for."""
        return self.asked == (word, name)

    def names(self, *kinds: EndpointKind) -> list[str]:
        """The topics or services with ends of these kinds that are to be looked at, sorted; without hidden ones, unless asked for."""
        found = {end.about.name for end in self.ends if end.about.kind in kinds}
        return sorted(name for name in found if self._concerns(name, kinds))

    def all_names(self, *kinds: EndpointKind) -> list[str]:
        """The names of all ends of these kinds that tools show, sorted."""
        return sorted(
            {end.about.name for end in self.ends if end.about.kind in kinds and not is_hidden(end.about.name)}
        )

    def of(self, kind: EndpointKind, name: str) -> list[Endpoint]:
        """The ends of one kind and name."""
        return [end for end in self.ends if end.about.kind is kind and end.about.name == name]

    def figures(self) -> Iterator[tuple[Told, NodeFigures, NodeFigures]]:
        """Each node to be looked at that tells of itself, before and now."""
        nodes = self._nodes_asked_for()
        for told in self.told:
            for before, last in told.nodes():
                if (nodes is None and not is_hidden(last.name)) or last.name in (nodes or ()):
                    yield told, before, last

    def _nodes_asked_for(self) -> frozenset[str] | None:
        """The nodes that have to do with what was asked for; None for all."""
        if self.asked is None:
            return None
        word, name = self.asked
        if word == "node":
            return frozenset({name})
        kinds = (PUBLISHER, SUBSCRIPTION) if word == "topic" else (SERVER,)
        return frozenset(end.node for end in self.ends if end.about.name == name and end.about.kind in kinds)

    def _concerns(self, name: str, kinds: tuple[EndpointKind, ...]) -> bool:
        if self.asked is None:
            return not is_hidden(name)
        word, asked = self.asked
        if word == "node":
            return any(end.node == asked and end.about.name == name for end in self.ends if end.about.kind in kinds)
        of_topics = PUBLISHER in kinds or SUBSCRIPTION in kinds
        return name == asked and of_topics == (word == "topic")
