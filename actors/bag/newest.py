"""The newest messages of each topic before some time, found from the end of a bag."""

from __future__ import annotations

from collections.abc import Mapping
from heapq import heappush, heapreplace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from actors.bag.contents import BagMessage

Place = tuple[int, int, int]
"""Where a message is in a bag: its file, and two numbers that rise within the file. Of messages of one time, the last one is the newest."""


class Newest:
    """Keeps the newest messages of each topic, as many as `counts` tells, whatever their order of arrival.

    Invariant: each list of `_kept` is a heap, of at most the topic's count, with its oldest message first.
    """

    def __init__(self, counts: Mapping[str, int]) -> None:
        self.counts = {topic: count for topic, count in counts.items() if count > 0}
        self._kept: dict[str, list[tuple[int, Place, BagMessage]]] = {topic: [] for topic in self.counts}

    def wants(self, topic: str, until_ns: int) -> bool:
        """Whether a message that was received at `until_ns` or before may be among the newest of its topic."""
        kept = self._kept.get(topic)
        if kept is None:
            return False
        return len(kept) < self.counts[topic] or kept[0][0] <= until_ns

    def add(self, message: BagMessage, place: Place) -> None:
        """Keep a message, if it is among the newest. Each place is given once."""
        name = message.topic.name
        kept = self._kept.get(name)
        if kept is None:
            return
        entry = (message.received_ns, place, message)
        if len(kept) < self.counts[name]:
            heappush(kept, entry)
        elif entry[:2] > kept[0][:2]:
            heapreplace(kept, entry)

    def messages(self) -> list[BagMessage]:
        """What is kept, in order of receipt."""
        return [message for *_, message in sorted(entry for kept in self._kept.values() for entry in kept)]
