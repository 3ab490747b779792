"""`Published`: what a replayed node publishes, beside what a bag has of it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any, Final

from actors.bag.conversion import here
from actors.bag.qos_text import parse_qos_profiles
from actors.interfaces.builtin_interfaces.msg import Time
from actors.qos import InvalidQoS
from actors.replay.comparison import ABSENT, Difference, first_difference

if TYPE_CHECKING:
    from actors.bag.contents import BagMessage, BagTopic
    from actors.bag.reader import BagReader
    from actors.replay.debugger import Break
    from actors.system import System
    from actors.topics.peers import PublisherPeer

__all__ = ["SHARED", "Published"]

SHARED: Final = frozenset({"/rosout", "/parameter_events"})
"""The topics on which every node publishes."""


class Published:
    """Compares what one node publishes with the topics of a bag: the n-th message of a topic with the n-th in the bag.

    Stamps (`builtin_interfaces/msg/Time`) are left out, because a bag does not tell when the node's code has run. What is published from
    the end of the bag on is compared only as far as the bag has messages. A topic of several publishers is not compared.

    Invariants: `topics` are those on which the node can publish or could, `unclear` those of them that are not compared for that reason.
    `differences` holds at most one of each.
    """

    def __init__(self, bag: BagReader, node: str, pause: Break | None) -> None:
        self.topics: set[str] = set()
        self.unclear: set[str] = set()
        self.compared: Counter[str] = Counter()
        """Topic -> how many messages of the bag were compared."""
        self.differences: dict[str, Difference] = {}
        self._bag, self._node, self._pause = bag, node, pause
        self._now_ns: Callable[[], int] = lambda: bag.metadata.start_ns
        self._in_bag = {topic.name: topic for topic in bag.topics}
        self._recorded: dict[str, Iterator[BagMessage]] = {}
        self._sent: Counter[str] = Counter()

    def watch(self, system: System) -> None:
        """Compare what the node publishes in this system, whose clock shows the time of the bag."""
        self._now_ns = system.clock.wall_ns
        system.graph.tap(self._tap)

    def _tap(self, publisher: PublisherPeer) -> Callable[[Any], None]:
        name = publisher.entry.name
        if publisher.node.fqn != self._node or name in SHARED:
            return _nothing
        self.topics.add(name)
        if name in self._in_bag and name not in self._recorded:
            if _publishers_of(self._in_bag[name]) > 1:
                self.unclear.add(name)
            else:
                self._recorded[name] = self._bag.messages({name})
        return lambda message: self._publish(name, getattr(message, "message", message))

    def end(self) -> None:
        """Compare what the bag has beyond what the node has published."""
        for name, recorded in self._recorded.items():
            if (missing := next(recorded, None)) is not None:
                self._differs(name, missing.received_ns, "", _decoded(missing), ABSENT)

    def _publish(self, name: str, message: Any) -> None:
        if self._pause is not None and self._pause.at(name, self._sent[name]):
            self._pause.stop()
        if name in self._recorded:
            self._compare(name, message)
        self._sent[name] += 1

    def _compare(self, name: str, message: Any) -> None:
        now, recorded = self._now_ns(), next(self._recorded[name], None)
        if recorded is not None:
            self.compared[name] += 1
            found = first_difference(_decoded(recorded), message, ignored=Time)
            if found is not None:
                self._differs(name, now, *found)
        elif now < self._bag.metadata.end_ns:  # what follows on the last message of all was not recorded any more
            self._differs(name, now, "", ABSENT, message)

    def _differs(self, name: str, at_ns: int, field: str, recorded: Any, replayed: Any) -> None:
        if name not in self.differences:
            seconds = (at_ns - self._bag.metadata.start_ns) / 1e9
            self.differences[name] = Difference("publish", name, self._sent[name], seconds, field, recorded, replayed)


def _decoded(message: BagMessage) -> Any:
    return here(message.topic).decode(message.data)


def _publishers_of(topic: BagTopic) -> int:
    """How many publishers a topic had while it was recorded, as far as the bag tells by what they offered."""
    try:
        return len(parse_qos_profiles(topic.offered_qos_profiles))
    except InvalidQoS:
        return 0


def _nothing(message: Any) -> None:
    """Do nothing: it is a message of another node."""
