"""The base class of publishers and subscriptions: their node, their topic, their quality of service and their QoS events."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from actors.qos import BEST_AVAILABLE_DURATION
from actors.topics.events import EndpointEvents

if TYPE_CHECKING:
    from actors.qos.policies import QoS
    from actors.topics.peers import Participant, TopicRegistry


def nanoseconds(duration: float | None) -> int | None:
    """Convert a duration of a QoS profile from seconds to whole nanoseconds, rounded up; None for an infinite or unspecified one."""
    if duration is None or duration in (math.inf, BEST_AVAILABLE_DURATION):
        return None
    return math.ceil(duration * 1e9 - 1e-3)


class Endpoint:
    """One end of a topic, owned by one node of this process.

    Invariants:

    * `kept_events` is None until the endpoint has a deadline, a lease, an incompatible peer or an event stream, and never None again after
      that.
    * `matched_total` never decreases.
    """

    __slots__ = ("entry", "kept_events", "matched_total", "node", "qos")

    def __init__(self, node: Participant, entry: TopicRegistry, qos: QoS) -> None:
        self.node = node
        self.entry = entry
        self.qos = qos
        self.matched_total: int = 0
        """The number of peers matched so far, including those that have left."""
        self.kept_events: EndpointEvents | None = None

    @property
    def here(self) -> bool:
        return True

    @property
    def checks_qos(self) -> bool:
        return True

    @property
    def status(self) -> Any:
        """The running totals of this endpoint's QoS events."""
        raise NotImplementedError  # each kind of endpoint has its own

    def due(self, now: int) -> int | None:
        """The time, in nanoseconds and later than `now`, of the next event that a lack of messages causes; None if there is none."""
        raise NotImplementedError  # each kind of endpoint has its own

    def keep_events(self) -> EndpointEvents:
        """Return the record of this endpoint's QoS events, creating it at the first call."""
        if self.kept_events is None:
            self.kept_events = EndpointEvents(self.due)
        return self.kept_events

    def notify(self) -> None:
        """Wake the tasks that wait for QoS events, because the status may have changed."""
        if self.kept_events is not None:
            self.kept_events.notify()

    def count_incompatible_qos(self, policy: str) -> None:
        """Record a peer that is not matched because of its quality of service. `policy` is the last policy that is incompatible."""
        events = self.keep_events()
        events.incompatible_qos += 1
        events.last_policy = policy
        events.notify()

    def count_incompatible_type(self) -> None:
        """Record a peer that is not matched because its type differs."""
        events = self.keep_events()
        events.incompatible_type += 1
        events.notify()

    def end_events(self) -> None:
        """End the endpoint's event streams, because the endpoint has ended."""
        if self.kept_events is not None:
            self.kept_events.close()
