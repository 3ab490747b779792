"""The journal of a node or subtree as a topic beside the others, so that a bag that is recorded contains it, too."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from actors.bag.reader import BagReader
from actors.bag.schemas import type_of
from actors.contracts.contracts import Topic
from actors.errors import ActorError, described
from actors.interfaces.cdr import decode
from actors.interfaces.std_msgs.msg import UInt8MultiArray
from actors.parameters.declare import parameter
from actors.qos import LATCHED
from actors.replay.errors import NoJournal, ReplayError
from actors.replay.parts import whole
from actors.replay.recording import Recording, is_subtree, named
from actors.runtime.declarations import every
from actors.runtime.node import Node

if TYPE_CHECKING:
    import os
    from collections.abc import Sequence

    from actors.replay.journal import Journal
    from actors.replay.recording_boundary import RecordingBoundary
    from actors.supervision.reasons import ExitReason
    from actors.topics.publisher import Publisher

JOURNAL: Final = "/_journal"
"""The end of the name of the topic with the journal of a node, which begins with the node's name."""
SUBTREE: Final = "/_subtree_journal"
"""The end of the name of the topic with the journal of a subtree, which begins with the path."""
PUBLISHER: Final = "/_replay_journal"
"""The full name of the node that publishes the journals of a program."""
DEPTH: Final = 2400
"""How many parts of a journal are kept for those who begin to record late: those of 20 minutes, or of less if much happens."""


class JournalPublisher(Node):
    """Publishes what is new of each journal, twice a second and at its end, on ``<node>/_journal``, in parts.

    The parameter `nodes` are the nodes, and paths of subtrees, of which a journal is kept. One that is added is restarted, and its journal begins there.
    """

    node_name = PUBLISHER[1:]
    nodes = parameter([], of=str)

    def __init__(self, journal: Journal, boundaries: dict[str, RecordingBoundary]) -> None:
        self._journal = journal
        self._boundaries = boundaries
        self._publishers: dict[str, Publisher[UInt8MultiArray]] = {}
        self._asked: list[str] = []
        """The journals that the last values of `nodes` that were checked ask for."""

    async def on_start(self) -> None:
        self.set_parameter("nodes", self._journal.nodes)

    @nodes.validate
    def can_be_journaled(self, nodes: Sequence[str]) -> str | None:
        """Refuse a node that is not there or cannot be journaled, and to end a journal."""
        if left := {*self.nodes} - {*nodes}:
            return f"a journal is kept to the end of the run: that of {', '.join(sorted(left))} cannot be ended"
        try:
            self._asked = [self._journal.check(node) for node in {*nodes} - {*self._journal.nodes}]
        except (LookupError, ReplayError) as error:
            return str(error)
        return None

    @nodes.changed
    def keep(self, nodes: Sequence[str]) -> None:
        """Begin the journals that are not kept yet."""
        for name in self._asked:
            self.create_task(self._begin(name))

    async def _begin(self, name: str) -> None:
        try:
            await self._journal.restart(name)
        except (ActorError, LookupError) as error:
            self.log.error("no journal was begun", node_name=name, because=described(error))

    @every(hz=2)
    def tell(self) -> None:
        """Publish what is new."""
        for node, boundary in list(self._boundaries.items()):
            for part in boundary.take():
                self._publisher(node)(UInt8MultiArray(data=np.frombuffer(part, np.uint8)))

    def _publisher(self, node: str) -> Publisher[UInt8MultiArray]:
        if node not in self._publishers:
            topic = Topic(UInt8MultiArray, topic_of(node), LATCHED.replace(depth=DEPTH))
            self._publishers[node] = self.publisher(topic)
        return self._publishers[node]

    async def on_stop(self, reason: ExitReason) -> None:
        self.tell()


def topic_of(journal: str) -> str:
    """The topic of a journal: that of a node below its name, that of a subtree below its path."""
    return f"/{journal}{SUBTREE}" if is_subtree(journal) else f"{journal}{JOURNAL}"


def recordings_in(path: str | os.PathLike[str], *, trust: bool = False) -> dict[str, Recording]:
    """The journals in a bag, by the names of their nodes and the paths of their subtrees. `trust` is as with `load`.

    Raises `BagError`, and `ReplayError` for a journal that is not whole or of another format.
    """
    with BagReader(path) as bag:
        return {name: _read(bag, name, trust) for name in sorted(_journals(bag))}


def _read(bag: BagReader, name: str, trust: bool) -> Recording:
    messages: Any = (decode(type_of(one.topic), one.data) for one in bag.messages({topic_of(name)}))
    return whole(name, (one.data.tobytes() for one in messages), trust=trust)


def journals_in(path: str | os.PathLike[str]) -> set[str]:
    """The full names of the nodes, and the paths of the subtrees, whose journals are in a bag. Raises `BagError`."""
    with BagReader(path) as bag:
        return _journals(bag)


def _journals(bag: BagReader) -> set[str]:
    topics = [topic.name for topic in bag.topics]
    nodes = {topic.removesuffix(JOURNAL) for topic in topics if topic.endswith(JOURNAL)}
    return nodes | {topic[1:].removesuffix(SUBTREE) for topic in topics if topic.endswith(SUBTREE)}


def has_journal(path: str | os.PathLike[str], node: str) -> bool:
    """Whether the journal of a node, by its name or full name, or of a subtree, by its path, is in a bag. Raises `BagError`."""
    return named(journals_in(path), node) is not None


def recording_in(path: str | os.PathLike[str], node: str, *, trust: bool = False) -> Recording:
    """The journal of a node, by its name or full name, or of a subtree, by its path, in a bag. `trust` is as with `load`.

    Raises `BagError`, `NoJournal` if there is none, and `ReplayError` if it is not whole or of another format.
    """
    with BagReader(path) as bag:
        names = sorted(_journals(bag))
        found = named(names, node)
        if found is None:
            raise NoJournal(f"{path} has no journal of {node}; it has those of: {', '.join(names) or 'no node'}")
        return _read(bag, found, trust)
