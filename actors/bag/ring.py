"""What a recorder holds in memory: the newest messages, bounded by time and by size."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from functools import cache
from typing import NamedTuple

from actors.interfaces.fields import STRINGS
from actors.interfaces.message import Message
from actors.qos.policies import QoS


class Channel:
    """One topic of one type, with the QoS offered by its publishers. `latched` maps a publisher's node to its latched messages that have
    left the ring."""

    __slots__ = ("latched", "offered", "topic", "type")

    def __init__(self, topic: str, type: type[Message]) -> None:
        self.topic = topic
        self.type = type
        self.offered: list[QoS] = []
        self.latched: dict[str, deque[Entry]] = {}

    def offer(self, qos: QoS) -> None:
        if qos not in self.offered:
            self.offered.append(qos)

    def held(self) -> Iterator[Entry]:
        """The latched messages that have left the ring."""
        for kept in self.latched.values():
            yield from kept


class Source(NamedTuple):
    """The origin of a message. `keeps` is the number of messages that its publisher keeps for late joiners; 0 if it is volatile."""

    channel: Channel
    node: str = ""
    keeps: int = 0


class Entry(NamedTuple):
    """One recorded message: its position in the order of all, the time of publication in seconds on the system's clock, and its size."""

    order: int
    at: float
    source: Source
    message: Message
    weight: int
    sent_ns: int | None = None
    """When it was sent, in nanoseconds since 1970, if it has come from another process."""


class Ring:
    """The newest entries, limited by their size in bytes.

    Invariants:

    * Entries are in order of arrival. `bytes` is the size of all of them, plus `kept`.
    * `bytes` is at most `max_bytes` after each `append`, and `kept` at most half of it.
    """

    __slots__ = ("bytes", "entries", "kept", "lost", "max_bytes")

    def __init__(self, max_bytes: int) -> None:
        self.entries: deque[Entry] = deque()
        self.bytes = 0
        self.max_bytes = max_bytes
        self.kept = 0
        """The bytes, part of `bytes`, of latched messages that have left the ring; at most half, because they do not expire."""
        self.lost = 0
        """The number of entries dropped early because there was no room."""

    def append(self, entry: Entry, horizon: float) -> None:
        self.entries.append(entry)
        self.bytes += entry.weight
        self.trim(horizon)

    def trim(self, horizon: float) -> None:
        """Drop the entries older than `horizon`, and more if there is not enough room for the rest."""
        entries = self.entries
        while entries and (self.bytes > self.max_bytes or entries[0].at < horizon):
            self.lost += entries[0].at >= horizon
            self._drop()

    def release(self) -> list[Entry]:
        """Take out all entries, oldest first."""
        entries = list(self.entries)
        self.entries.clear()
        self.bytes = self.kept
        return entries

    def _drop(self) -> None:
        """Drop the oldest entry, but keep the message if a latched publisher still holds it."""
        entry = self.entries.popleft()
        self.bytes -= entry.weight
        source = entry.source
        if source.keeps:
            latched = source.channel.latched.setdefault(source.node, deque())
            latched.append(entry)
            self._hold(entry.weight)
            while latched and (len(latched) > source.keeps or 2 * self.kept > self.max_bytes):
                self._hold(-latched.popleft().weight)

    def _hold(self, weight: int) -> None:
        self.bytes += weight
        self.kept += weight


def placed(latched: Sequence[Entry], entries: Sequence[Entry]) -> Iterator[tuple[Entry, float]]:
    """Each entry with the time at which a recording shows it: older messages that were still valid stand at its beginning."""
    begin = entries[0].at if entries else 0.0
    for entry in (*latched, *entries):
        yield entry, max(entry.at, begin)


OBJECT, SCALAR, TEXT, ARRAY, ELEMENT = 64, 32, 56, 112, 8
"""The bytes of a message object with its place in a recording, a boxed number, an empty text, an empty array, and a place in a tuple."""


@cache
def weight_of(cls: type[Message]) -> Callable[[Message], int]:
    """Return a function that estimates the size of a message of this type, in bytes. It is never less than the size of its arrays.

    The function is compiled from the fields, because it runs for every recorded message: for an Imu it is a sum of five numbers.
    """
    names: dict[str, object] = {}
    fixed, terms = _terms(cls, "message", names)
    weigh: Callable[[Message], int] = eval(f"lambda message: {' + '.join([str(fixed), *terms])}", names)
    return weigh


def _terms(cls: type[Message], path: str, names: dict[str, object]) -> tuple[int, list[str]]:
    """The bytes common to all messages of a type, and a term for each part whose size varies."""
    fixed, terms = OBJECT, list[str]()
    for field in cls.__ros_fields__:
        kind, value = field.type, f"{path}.{field.name}"
        if kind.is_numeric_array:
            fixed += ARRAY
            terms.append(f"{value}.nbytes")
        elif field.message is not None and not kind.is_array:
            inside, more = _terms(field.message, value, names)
            fixed += inside
            terms += more
        elif field.message is not None:
            weigh = f"weigh{len(names)}"
            names[weigh] = weight_of(field.message)
            terms.append(f"{ELEMENT} * len({value}) + sum(map({weigh}, {value}))")
        elif kind.base in STRINGS and kind.is_array:
            terms.append(f"{ELEMENT + TEXT} * len({value}) + sum(map(len, {value}))")
        elif kind.base in STRINGS:
            fixed += TEXT
            terms.append(f"len({value})")
        else:
            fixed += SCALAR
    return fixed, terms
