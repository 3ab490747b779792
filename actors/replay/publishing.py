"""The journal of a node as a topic beside the others, so that whoever records a bag has it, too."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from actors.bag.reader import BagReader
from actors.bag.schemas import type_of
from actors.contracts.contracts import Topic
from actors.interfaces.cdr import decode
from actors.interfaces.std_msgs.msg import UInt8MultiArray
from actors.node.declarations import every
from actors.node.node import Node
from actors.qos import LATCHED
from actors.replay.tape import ReplayError, Tape, pack, unpack

if TYPE_CHECKING:
    import os

    from actors.supervision.reasons import ExitReason
    from actors.topics.publisher import Publisher

__all__ = ["JOURNAL", "JournalPublisher", "has_journal", "journals_in", "tape_in", "tapes_in"]

JOURNAL: Final = "/_journal"
"""The end of the name of the topic with the journal of a node, which begins with the node's name."""
DEPTH: Final = 100_000
"""How many parts of a journal are kept for those who begin to record late."""


class JournalPublisher(Node):
    """Publishes what is new on each tape, twice a second and at its end, on ``<node>/_journal``."""

    node_name = "replay_journal"

    def __init__(self, tapes: dict[str, Tape]) -> None:
        self._tapes = tapes
        self._told: dict[str, int] = {}
        self._publishers: dict[str, Publisher[UInt8MultiArray]] = {}

    @every(hz=2)
    def tell(self) -> None:
        """Publish what is new."""
        for node, tape in list(self._tapes.items()):
            told = self._told.get(node, 0)
            new = tape.entries[told:]
            if new:
                self._told[node] = told + len(new)
                self._publisher(node)(UInt8MultiArray(data=np.frombuffer(pack(new), np.uint8)))

    def _publisher(self, node: str) -> Publisher[UInt8MultiArray]:
        if node not in self._publishers:
            self._publishers[node] = self.publisher(
                Topic(UInt8MultiArray, node + JOURNAL, LATCHED.replace(depth=DEPTH))
            )
        return self._publishers[node]

    async def on_stop(self, reason: ExitReason) -> None:
        self.tell()


def tapes_in(path: str | os.PathLike[str]) -> dict[str, Tape]:
    """The journals in a bag, by the names of their nodes. Raises `BagError`, and `ReplayError` for a journal of another format."""
    tapes: dict[str, Tape] = {}
    with BagReader(path) as bag:
        topics = {topic.name for topic in bag.topics if topic.name.endswith(JOURNAL)}
        for one in bag.messages(topics):
            node = one.topic.name.removesuffix(JOURNAL)
            part: Any = decode(type_of(one.topic), one.data)
            tapes.setdefault(node, Tape(node)).entries += unpack(part.data.tobytes())
    return tapes


def journals_in(path: str | os.PathLike[str]) -> set[str]:
    """The full names of the nodes whose journals are in a bag. Raises `BagError`."""
    with BagReader(path) as bag:
        return {topic.name.removesuffix(JOURNAL) for topic in bag.topics if topic.name.endswith(JOURNAL)}


def has_journal(path: str | os.PathLike[str], node: str) -> bool:
    """Whether the journal of a node, by its name or full name, is in a bag. Raises `BagError`."""
    return any(node in (fqn, fqn.rpartition("/")[2]) for fqn in journals_in(path))


def tape_in(path: str | os.PathLike[str], node: str) -> Tape:
    """The journal of a node, by its name or full name, in a bag. Raises `ReplayError` if there is none."""
    tapes = tapes_in(path)
    for fqn, tape in tapes.items():
        if node in (fqn, fqn.rpartition("/")[2]):
            return tape
    raise ReplayError(f"{path} has no journal of {node}; it has those of: {', '.join(sorted(tapes)) or 'no node'}")
