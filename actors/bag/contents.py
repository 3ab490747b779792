"""What a bag holds: topics, and messages with two times each."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from heapq import heappush, heapreplace
from operator import attrgetter
from typing import Final, NamedTuple

from actors.bag.qos_text import qos_profiles_text
from actors.interfaces.hashes import type_hash
from actors.interfaces.message import Message
from actors.interfaces.text import schema_text
from actors.qos.policies import QoS


class BagError(Exception):
    """A bag cannot be read or written; the text is one line that says why and what to do."""


@dataclass(frozen=True, slots=True)
class BagTopic:
    """One topic of a bag, of one type."""

    name: str
    type: str
    """The name of the type, as `std_msgs/msg/String`."""

    schema: str = ""
    """The definition of the type, followed by those of all nested types; empty if the bag does not hold it, or the type has no fields."""

    offered_qos_profiles: str = ""
    """The quality of service that the publishers offered, as the YAML text of rosbag2."""

    type_hash: str = ""
    """`RIHS01_` and 64 hexadecimal digits; empty if it is not known."""

    schema_encoding: str = ""
    """How the definition is written: `ros2msg` if nothing else is said; empty if the bag does not hold it."""

    serialization_format: str = "cdr"

    def __post_init__(self) -> None:
        if self.schema_encoding in ("", "unknown"):  # rosbag2 calls it unknown, also where it has it
            object.__setattr__(self, "schema_encoding", "ros2msg" if self.schema else "")


class BagMessage(NamedTuple):
    """One message of a bag, encoded in CDR. Times are in nanoseconds since 1970."""

    topic: BagTopic
    data: bytes
    received_ns: int
    """When the recorder received it. Bags are ordered by this time."""

    published_ns: int
    """When it was sent; the same as `received_ns` if the bag does not tell."""


received: Final = attrgetter("received_ns")
"""When a message was received: the order of a bag."""


def topic_of(name: str, type: type[Message], offered: Iterable[QoS] = ()) -> BagTopic:
    """A topic of a type that this process knows, whose publishers offer this quality of service."""
    return BagTopic(name, type.__ros_type__, schema_text(type), qos_profiles_text(offered), type_hash(type), "ros2msg")


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
