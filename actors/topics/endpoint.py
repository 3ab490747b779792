"""What publishers and subscriptions have in common: their place in the graph, and their QoS events."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from actors.qos import BEST_AVAILABLE_DURATION
from actors.topics.events import EndpointEvents

if TYPE_CHECKING:
    from actors.qos.policies import QoS
    from actors.topics.peers import Participant, TopicRegistry

__all__ = ["Endpoint", "nanoseconds"]


def nanoseconds(duration: float | None) -> int | None:
    """A duration of a QoS in whole nanoseconds, rounded up; None for one that never ends."""
    if duration is None or duration in (math.inf, BEST_AVAILABLE_DURATION):
        return None
    return math.ceil(duration * 1e9 - 1e-3)


class Endpoint:
    """One end of a topic in one node of this process.

    Invariants:

    * `kept_events` is None until there is something to keep: a deadline, a lease, an incompatible peer or an event stream.
    * `matched_total` never shrinks.
    """

    __slots__ = ("entry", "kept_events", "matched_total", "node", "qos")

    def __init__(self, node: Participant, entry: TopicRegistry, qos: QoS) -> None:
        self.node = node
        self.entry = entry
        self.qos = qos
        self.matched_total: int = 0
        """How many peers were ever matched."""
        self.kept_events: EndpointEvents | None = None

    @property
    def status(self) -> Any:
        """What this endpoint has met so far, in totals."""
        raise NotImplementedError

    def due(self, now: int) -> int | None:
        """When, in nanoseconds and after `now`, silence alone causes the next event; None for never."""
        raise NotImplementedError

    def keep_events(self) -> EndpointEvents:
        """The record of this endpoint's events, kept from now on."""
        if self.kept_events is None:
            self.kept_events = EndpointEvents(self.due)
        return self.kept_events

    def notify(self) -> None:
        """The status may have changed: wake those who wait for events."""
        if self.kept_events is not None:
            self.kept_events.notify()

    def count_incompatible_qos(self, policy: str) -> None:
        """A peer does not match because of its quality of service, `policy` being the last policy that keeps them apart."""
        events = self.keep_events()
        events.incompatible_qos += 1
        events.last_policy = policy
        events.notify()

    def count_incompatible_type(self) -> None:
        """A peer does not match because it has another type."""
        events = self.keep_events()
        events.incompatible_type += 1
        events.notify()

    def end_events(self) -> None:
        """The endpoint has ended, and its event streams with it."""
        if self.kept_events is not None:
            self.kept_events.close()
