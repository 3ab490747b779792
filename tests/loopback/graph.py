"""The graph of a system in which every endpoint is remote to every other."""

from __future__ import annotations

from typing import Any

from actors.graph.graph import Graph
from tests.loopback.topics import LoopbackTopic


class LoopbackGraph(Graph):
    """As `Graph`; its names stand for both sides of a transport."""

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self.far = Graph(self.now)
        """What the processes see in which the subscriptions are; this graph is what those see in which the publishers are."""

    def topic(self, name: str) -> LoopbackTopic:
        entry = self.topics.get(name)
        if entry is None:
            entry = self.topics[name] = LoopbackTopic(self, name, self.far)
        assert isinstance(entry, LoopbackTopic)
        return entry
