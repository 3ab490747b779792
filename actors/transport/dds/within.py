"""What the endpoints of a participant share."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import Protocol

from actors.transport.dds.library import Library
from actors.transport.dds.reading import Reading, Report
from actors.transport.dds.sending import Sending
from actors.transport.wakeup import Wakeup
from actors.transport.worker import Worker


class Open(Protocol):
    """A reader or writer that is open."""

    received: Counter[bytes]
    """Bytes from each writer of others, by its GUID."""

    def sent(self) -> Counter[bytes]:
        """Bytes for each reader of others, by its GUID."""
        ...

    def losses(self) -> Counter[bytes]:
        """Samples that this side has dropped, by the GUID of the endpoint of others that they were for or from."""
        ...

    def close(self) -> None: ...


@dataclass
class Within:
    """What the endpoints of a participant share."""

    library: Library
    participant: int
    wakeup: Wakeup
    reading: Reading
    sending: Sending
    worker: Worker
    report: Report
    guids: dict[int, bytes] = field(default_factory=dict[int, bytes])
    """The GUID of each endpoint of others, by its instance handle."""
    swapped: set[bytes] = field(default_factory=set[bytes])
    """How the GUIDs begin of participants whose samples are big-endian, though Cyclone DDS says otherwise."""
    endpoints: set[Open] = field(default_factory=lambda: set["Open"]())

    def forget(self, endpoint: Open) -> None:
        """It is being closed."""
        self.endpoints.discard(endpoint)

    def delete(self, entity: int) -> None:
        """Delete an entity of the library, which may wait. From any thread."""
        self.worker.do(lambda: self.library.dds_delete(entity))
