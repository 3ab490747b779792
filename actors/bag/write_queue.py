"""What a recorder has received and not yet written, between the event loop and the thread that writes."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from actors.bag.contents import BagTopic, topic_of
from actors.interfaces.errors import CdrError

if TYPE_CHECKING:
    from actors.bag.ring import Channel
    from actors.bag.writer import BagWriter, Split
    from actors.topics.lazy_message import LazyMessage


class Taken(NamedTuple):
    """One message as it was received. Times are in nanoseconds since 1970."""

    channel: Channel
    message: LazyMessage
    received_ns: int
    sent_ns: int
    weight: int = 0
    """Its approximate size."""


class WriteQueue:
    """Messages on their way into a bag, at most `max_bytes` of them.

    `add` and `take` are called in the event loop, `write` by one thread at a time, and never while `take` is called.

    Invariants: `_items` belongs to the event loop and `_batch` to the writing thread. What waits is `_added` less `_done`, each of which
    has one writer. A message is written, counted in `dropped` or in `unencodable`, or waits.
    """

    def __init__(self, writer: BagWriter, max_bytes: int) -> None:
        self._writer = writer
        self._max_bytes = max_bytes
        self._items: list[Taken] = []
        self._batch: list[Taken] = []
        self._topics: dict[Channel, BagTopic] = {}
        self.channels: list[Channel] = []
        """What is recorded, whether there are messages or not."""
        self._added = 0
        self._done = 0
        self.dropped = 0
        """The messages for which there was no room."""
        self.unencodable = 0
        """The messages that cannot be encoded, because a text in them is none."""

    def add(self, taken: Taken) -> None:
        """Add a message, or count it as dropped."""
        if self._added - self._done + taken.weight > self._max_bytes:
            self.dropped += 1
        else:
            self._added += taken.weight
            self._items.append(taken)

    def take(self) -> bool:
        """Hand over what waits to the next `write`; whether there is anything."""
        self._batch += self._items
        self._items = []
        return bool(self._batch)

    def write(self) -> list[Split]:
        """Write what was handed over. Raises `OSError`; the rest of it is then counted as dropped."""
        batch, self._batch = self._batch, []
        splits: list[Split] = []
        left = len(batch)
        try:
            for taken in batch:
                left -= 1
                self._done += taken.weight
                split = self._write(taken)
                if split is not None:
                    splits.append(split)
        finally:
            self.dropped += left
        return splits

    def note(self) -> None:
        """Let the bag tell of the channels without messages, too."""
        for channel in self.channels:
            self._writer.add(self.topic(channel))

    def topic(self, channel: Channel) -> BagTopic:
        """How the bag names a channel: with what had been offered when it was first asked for."""
        topic = self._topics.get(channel)
        if topic is None:
            topic = self._topics[channel] = topic_of(channel.topic, channel.type, channel.offered)
        return topic

    def _write(self, taken: Taken) -> Split | None:
        try:
            data = taken.message.cdr
        except CdrError:
            self.unencodable += 1
            return None
        topic = self.topic(taken.channel)
        return self._writer.write(topic, data, received_ns=taken.received_ns, published_ns=taken.sent_ns)
