"""What has been exchanged with whom."""

from __future__ import annotations

from collections import Counter
from typing import Final

from actors.transport.protocol import Link
from actors.transport.zenoh import objects
from actors.transport.zenoh.presence import Process

_GID: Final = slice(17, 33)
"""Where the identity of the sender stands in the attachment of every message of ROS 2."""

_KNOWN: Final = 10_000


class Traffic:
    """Counts the samples of a connection, by the session of the other side. On the loop's thread, but for `lost`.

    Zenoh does not tell to whom it has sent a sample. Therefore one that somebody wanted is counted as sent to everybody who was linked: the
    numbers of what was sent, and of what was not, are those of all outlets together since the link came up.

    Invariant: the counts of a session begin with 0 when its link comes up.
    """

    def __init__(self) -> None:
        self.sent = 0
        self.unsent = 0
        """Samples that outlets have dropped."""
        self._received: Counter[str] = Counter()
        self._lost: Counter[str] = Counter()
        self._before: dict[str, tuple[int, int]] = {}
        self._senders: dict[bytes, str] = {}

    def begin(self, session: str) -> None:
        """A link has come up."""
        self._before[session] = self.sent, self.unsent
        self._received.pop(session, None)
        self._lost.pop(session, None)

    def received(self, sample: objects.Sample, attachment: bytes, size: int) -> None:
        """A sample of `size` bytes has arrived."""
        sender = self._senders.get(attachment[_GID])  # asking the sample takes ten times as long
        self._received[sender if sender is not None else self._learn(sample, attachment[_GID])] += size

    def lost(self, sample: objects.Sample) -> None:
        """A sample that had arrived was dropped. From any thread."""
        self._lost[_sender(sample)] += 1

    def report(self, sessions: dict[str, Process | None]) -> tuple[Link, ...]:
        """The links with `sessions`."""
        return tuple(self._link(session, process) for session, process in sessions.items())

    def _link(self, session: str, process: Process | None) -> Link:
        sent, unsent = self._before[session]
        return Link(
            session,
            process.host if process else "",
            process.process if process else 0,
            self.sent - sent,
            self._received[session],
            self._lost[session] + self.unsent - unsent,
        )

    def _learn(self, sample: objects.Sample, gid: bytes) -> str:
        sender = _sender(sample)
        if len(gid) == _GID.stop - _GID.start:
            if len(self._senders) >= _KNOWN:
                self._senders.clear()
            self._senders[gid] = sender
        return sender


def _sender(sample: objects.Sample) -> str:
    timestamp = sample.timestamp
    return "" if timestamp is None else str(timestamp.get_id())
