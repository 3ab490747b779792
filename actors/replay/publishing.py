"""The journal of a node as a topic beside the others, so that whoever records a bag has it, too."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from actors.bag.reader import BagReader
from actors.bag.schemas import type_of
from actors.contracts.contracts import Topic
from actors.errors import ActorError, described
from actors.interfaces.cdr import decode
from actors.interfaces.std_msgs.msg import UInt8MultiArray
from actors.node.declarations import every
from actors.node.node import Node
from actors.parameters.declare import parameter
from actors.qos import LATCHED
from actors.replay.errors import ReplayError
from actors.replay.parts import whole
from actors.replay.tape import Tape

if TYPE_CHECKING:
    import os
    from collections.abc import Sequence

    from actors.replay.journal import Journal
    from actors.replay.recording import Recording
    from actors.supervision.reasons import ExitReason
    from actors.topics.publisher import Publisher

__all__ = ["JOURNAL", "PUBLISHER", "JournalPublisher", "has_journal", "journals_in", "tape_in", "tapes_in"]

JOURNAL: Final = "/_journal"
"""The end of the name of the topic with the journal of a node, which begins with the node's name."""
PUBLISHER: Final = "/_replay_journal"
"""The full name of the node that publishes the journals of a program."""
DEPTH: Final = 2400
"""How many parts of a journal are kept for those who begin to record late: those of 20 minutes, or of less if much happens."""


class JournalPublisher(Node):
    """Publishes what is new of each journal, twice a second and at its end, on ``<node>/_journal``, in parts.

    The parameter `nodes` are those of which a journal is kept. One that is added is restarted, and its journal begins there.
    """

    node_name = PUBLISHER[1:]
    nodes = parameter([], of=str)

    def __init__(self, journal: Journal, recordings: dict[str, Recording]) -> None:
        self._journal = journal
        self._recordings = recordings
        self._publishers: dict[str, Publisher[UInt8MultiArray]] = {}

    async def on_start(self) -> None:
        self.set_parameter("nodes", self._journal.nodes)

    @nodes.validate
    def can_be_journaled(self, nodes: Sequence[str]) -> str | None:
        """Refuse a node that is not there or cannot be journaled, and to end a journal."""
        if left := {*self.nodes} - {*nodes}:
            return f"a journal is kept to the end of the run: that of {', '.join(sorted(left))} cannot be ended"
        for node in {*nodes} - {*self._journal.nodes}:
            try:
                self._journal.check(node)
            except (LookupError, ReplayError) as error:
                return str(error)
        return None

    @nodes.changed
    def keep(self, nodes: Sequence[str]) -> None:
        """Begin the journals that are not kept yet."""
        for node in {*nodes} - {*self._journal.nodes}:
            self.spawn(self._begin(node))

    async def _begin(self, node: str) -> None:
        try:
            await self._journal.begin(node)
        except ActorError as error:
            self.log.error("no journal was begun", node_name=node, because=described(error))

    @every(hz=2)
    def tell(self) -> None:
        """Publish what is new."""
        for node, recording in list(self._recordings.items()):
            for part in recording.take():
                self._publisher(node)(UInt8MultiArray(data=np.frombuffer(part, np.uint8)))

    def _publisher(self, node: str) -> Publisher[UInt8MultiArray]:
        if node not in self._publishers:
            self._publishers[node] = self.publisher(
                Topic(UInt8MultiArray, node + JOURNAL, LATCHED.replace(depth=DEPTH))
            )
        return self._publishers[node]

    async def on_stop(self, reason: ExitReason) -> None:
        self.tell()


def tapes_in(path: str | os.PathLike[str], *, trust: bool = False) -> dict[str, Tape]:
    """The journals in a bag, by the names of their nodes. `trust` is as with `load`.

    Raises `BagError`, and `ReplayError` for a journal that is not whole or of another format.
    """
    return {node: _read(path, node, trust) for node in sorted(journals_in(path))}


def _read(path: str | os.PathLike[str], node: str, trust: bool) -> Tape:
    with BagReader(path) as bag:
        messages: Any = (decode(type_of(one.topic), one.data) for one in bag.messages({node + JOURNAL}))
        return whole(node, (one.data.tobytes() for one in messages), trust=trust)


def journals_in(path: str | os.PathLike[str]) -> set[str]:
    """The full names of the nodes whose journals are in a bag. Raises `BagError`."""
    with BagReader(path) as bag:
        return {topic.name.removesuffix(JOURNAL) for topic in bag.topics if topic.name.endswith(JOURNAL)}


def has_journal(path: str | os.PathLike[str], node: str) -> bool:
    """Whether the journal of a node, by its name or full name, is in a bag. Raises `BagError`."""
    return _found(journals_in(path), node) is not None


def tape_in(path: str | os.PathLike[str], node: str, *, trust: bool = False) -> Tape:
    """The journal of a node, by its name or full name, in a bag. `trust` is as with `load`.

    Raises `BagError`, and `ReplayError` if there is none, or if it is not whole or of another format.
    """
    names = journals_in(path)
    found = _found(names, node)
    if found is None:
        raise ReplayError(f"{path} has no journal of {node}; it has those of: {', '.join(sorted(names)) or 'no node'}")
    return _read(path, found, trust)


def _found(names: set[str], node: str) -> str | None:
    return next((fqn for fqn in sorted(names) if node in (fqn, fqn.rpartition("/")[2])), None)
