"""The nodes of this process, as ``ros_discovery_info`` tells of them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable

from actors.transport.dds.format.participants import NodeEntities
from actors.transport.dds.known import number_of
from actors.transport.format.names import check_chunk, check_namespace


class NodeHere:
    """A node of this process. Raises WireFormatError for a name that the wire cannot represent."""

    def __init__(self, fqn: str, changed: Callable[[], None], forget: Callable[[NodeHere], None]) -> None:
        """`changed` is called when its endpoints have changed, `forget` when it is closed."""
        namespace, _, name = fqn.rpartition("/")
        self.number = number_of(fqn)
        self._namespace = check_namespace(namespace or "/")
        self._name = check_chunk(name, "the name of a node")
        self._changed = changed
        self._forget = forget
        self._readers: Counter[bytes] = Counter()
        self._writers: Counter[bytes] = Counter()

    @property
    def entities(self) -> NodeEntities:
        return NodeEntities(self._namespace, self._name, tuple(self._readers), tuple(self._writers))

    def add(self, *, reader: bytes | None = None, writer: bytes | None = None) -> None:
        """It has one endpoint more."""
        self._readers.update(() if reader is None else (reader,))
        self._writers.update(() if writer is None else (writer,))
        self._changed()

    def remove(self, *, reader: bytes | None = None, writer: bytes | None = None) -> None:
        """It has one endpoint less."""
        for gids, gid in ((self._readers, reader), (self._writers, writer)):
            if gid is not None:
                gids[gid] -= 1
                if not gids[gid]:
                    del gids[gid]
        self._changed()

    def close(self) -> None:
        self._forget(self)
