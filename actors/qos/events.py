"""QoS events and statuses as values.

A status holds the running totals of one endpoint. An event is a change of one kind between two statuses: the new total and the increase, so
that several changes between two reads give one event. Names and fields are those of rmw and of the DDS statuses behind it.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TypeAlias

import msgspec

# -- events -----------------------------------------------------------------------------------------------------------------


class Matched(msgspec.Struct, frozen=True):
    """Peers were matched or have left: the number ever matched, and the number matched now."""

    total_count: int
    total_count_change: int
    current_count: int
    current_count_change: int


class DeadlineMissed(msgspec.Struct, frozen=True):
    """A whole deadline has passed without a message. A publisher offers a deadline, a subscription requests one."""

    total_count: int
    total_count_change: int


class LivelinessLost(msgspec.Struct, frozen=True):
    """A publisher with manual_by_topic liveliness has neither published nor asserted its liveliness within its lease."""

    total_count: int
    total_count_change: int


class LivelinessChanged(msgspec.Struct, frozen=True):
    """The numbers of a subscription's publishers that are alive and not alive have changed."""

    alive_count: int
    alive_count_change: int
    not_alive_count: int
    not_alive_count_change: int


class MessageLost(msgspec.Struct, frozen=True):
    """Messages were lost because the reader was slower than the depth of its subscription allows."""

    total_count: int
    total_count_change: int


class IncompatibleQoS(msgspec.Struct, frozen=True):
    """Peers with incompatible quality of service were found. `last_policy_kind` is the incompatible policy of the last one."""

    total_count: int
    total_count_change: int
    last_policy_kind: str
    """RELIABILITY, DURABILITY, DEADLINE or LIVELINESS (which includes its lease)."""


class IncompatibleType(msgspec.Struct, frozen=True):
    """Peers were found that use another message type for the same topic."""

    total_count: int
    total_count_change: int


PublisherEvent: TypeAlias = Matched | DeadlineMissed | LivelinessLost | IncompatibleQoS | IncompatibleType
"""The events of `Publisher.events()`."""

SubscriptionEvent: TypeAlias = (
    Matched | DeadlineMissed | LivelinessChanged | MessageLost | IncompatibleQoS | IncompatibleType
)
"""The events of `Stream.events()` and of `Node.subscription(...).events()`."""

# -- statuses ---------------------------------------------------------------------------------------------------------------


class _Status(msgspec.Struct, frozen=True, kw_only=True):
    """The totals common to publishers and subscriptions."""

    matched: int
    """The number of peers matched now."""
    matched_total: int
    """The number of peers ever matched."""
    deadline_missed: int = 0
    incompatible_qos: int = 0
    """The number of peers found with incompatible quality of service."""
    last_policy_kind: str = "INVALID"
    """The incompatible policy of the last of them."""
    incompatible_type: int = 0
    """The number of peers found with another message type."""

    def _common(self, old: _Status) -> Iterator[Matched | DeadlineMissed | IncompatibleQoS | IncompatibleType]:
        if (self.matched, self.matched_total) != (old.matched, old.matched_total):
            total, current = self.matched_total, self.matched
            yield Matched(total, total - old.matched_total, current, current - old.matched)
        if (missed := self.deadline_missed) != old.deadline_missed:
            yield DeadlineMissed(missed, missed - old.deadline_missed)
        if (met := self.incompatible_qos) != old.incompatible_qos:
            yield IncompatibleQoS(met, met - old.incompatible_qos, self.last_policy_kind)
        if (met := self.incompatible_type) != old.incompatible_type:
            yield IncompatibleType(met, met - old.incompatible_type)


class PublisherStatus(_Status, frozen=True, kw_only=True):
    """The totals of one publisher."""

    liveliness_lost: int = 0

    def since(self, old: PublisherStatus) -> Iterator[PublisherEvent]:
        """Yield the changes since the status `old` of the same publisher, one event for each kind."""
        yield from self._common(old)
        if (lost := self.liveliness_lost) != old.liveliness_lost:
            yield LivelinessLost(lost, lost - old.liveliness_lost)


class SubscriptionStatus(_Status, frozen=True, kw_only=True):
    """The totals of one subscription."""

    alive: int = 0
    """The number of matched publishers that are alive."""
    not_alive: int = 0
    """The number of matched publishers whose lease has run out."""
    message_lost: int = 0

    def since(self, old: SubscriptionStatus) -> Iterator[SubscriptionEvent]:
        """Yield the changes since the status `old` of the same subscription, one event for each kind."""
        yield from self._common(old)
        if (self.alive, self.not_alive) != (old.alive, old.not_alive):
            yield LivelinessChanged(self.alive, self.alive - old.alive, self.not_alive, self.not_alive - old.not_alive)
        if (lost := self.message_lost) != old.message_lost:
            yield MessageLost(lost, lost - old.message_lost)
