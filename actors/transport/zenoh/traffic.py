"""What has been exchanged with whom."""

from __future__ import annotations

from collections import Counter
from typing import Final

from actors.transport.protocol import Link
from actors.transport.zenoh import objects
from actors.transport.zenoh.presence import Process

GID: Final = slice(17, 33)
"""Where the identity of the sender stands in the attachment of every message of ROS 2."""

_KNOWN: Final = 10_000


class Traffic:
    """Counts the samples of a connection, by the session of the other side. On the loop's thread, but for `lost`.

    Zenoh does not report the receivers of a sample. Therefore a sample with a subscription is counted as sent on every link: the numbers of
    bytes sent and of samples not sent are those of all outlets together since the link came up.

    Invariant: the counts of a session begin with 0 when its link comes up, and are forgotten when it goes down.
    """

    def __init__(self) -> None:
        self.sent = 0
        self.unsent = 0
        """Samples that outlets have dropped."""
        self._received: dict[str, list[int]] = {}
        """The bytes of each session with a link, in a list of one, which is shared with `_senders`."""
        self._nobody = [0]
        """Those of all others: anybody can name any session."""
        self._lost: Counter[str] = Counter()
        self._before: dict[str, tuple[int, int]] = {}
        self._senders: dict[bytes, list[int]] = {}
        """By the identity of a sender, what has been received from its session."""

    def begin(self, session: str) -> None:
        """A link has come up."""
        self._before[session] = self.sent, self.unsent
        self._received[session] = [0]
        self._senders.clear()

    def end(self, session: str) -> None:
        """The link has gone down."""
        del self._before[session], self._received[session]
        self._lost.pop(session, None)
        self._senders.clear()

    def received(self, sample: objects.Sample, attachment: bytes, size: int) -> None:
        """A sample of `size` bytes has arrived."""
        try:
            self._senders[attachment[GID]][0] += size  # asking the sample takes ten times as long
        except KeyError:
            self._learn(sample, attachment[GID])[0] += size

    def lost(self, sample: objects.Sample) -> None:
        """A sample that had arrived was dropped. From any thread."""
        session = _sender(sample)
        if session in self._before:
            self._lost[session] += 1

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
            self._received[session][0],
            self._lost[session] + self.unsent - unsent,
        )

    def _learn(self, sample: objects.Sample, gid: bytes) -> list[int]:
        received = self._received.get(_sender(sample), self._nobody)
        if len(gid) == GID.stop - GID.start:
            if len(self._senders) >= _KNOWN:
                self._senders.clear()
            self._senders[gid] = received
        return received


def _sender(sample: objects.Sample) -> str:
    timestamp = sample.timestamp
    return "" if timestamp is None else str(timestamp.get_id())
