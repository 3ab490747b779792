"""Faults of messages, applied between a publisher and a subscription of a simulated run."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Sequence
from functools import partial
from typing import NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from actors.graph.interceptor import TopicInterceptor
from actors.inbox.expiring import ExpiringMessage
from actors.interfaces.message import M, Message
from actors.runtime.incarnation import Incarnation
from actors.testing.faults import Fault, Profile
from actors.topics.peers import PublisherPeer, SubscriptionPeer, Target

MOST_AT_ONCE = 100
"""The maximum number of repeated messages at one instant. A node that answers each message at once would otherwise never let time pass."""


class Delivery(NamedTuple):
    """A message to be delivered, and the target that receives it."""

    message: Message | ExpiringMessage[Message]
    target: Target


class Link:
    """The messages from one topic to one subscription: counts them, and applies the faults that name the n-th.

    Invariants:

    * Every message of every publisher passes `deliver` once, in the order of publishing.
    * `_held` holds the messages that the next one overtakes.
    * A repeated or delayed message goes to the target that it had without the fault.
    """

    def __init__(self, subscription: SubscriptionPeer, name: str, faults: Sequence[Fault], profile: Profile) -> None:
        self._subscription = subscription
        self._name = name
        self._profile = profile
        self._links = profile.watching if is_guest(subscription) else profile.links
        self._loop = asyncio.get_running_loop()
        self._faults: dict[int, list[Fault]] = {}
        for fault in faults:
            self._faults.setdefault(fault.nth, []).append(fault)
        self._held: list[Delivery] = []
        self._last: Delivery | None = None
        self._frozen_until = -1.0
        self._frozen: Delivery | None = None
        self._repeats = 0
        self._repeated_at = -1.0

    def deliver(self, target: Target, message: Message | ExpiringMessage[Message]) -> None:
        """Count a message, and pass it to `target` as the faults require."""
        links = self._links
        nth = links[self._name] = links.get(self._name, 0) + 1
        if nth == 1 and has_numbers(message.message if isinstance(message, ExpiringMessage) else message):
            self._profile.numeric.add(self._name)
        now = self._loop.time()
        delivery = Delivery(message, target)
        copies = [delivery]
        delay = 0.0
        swapped = False
        for fault in self._faults.get(nth, ()):
            if fault.kind == "lose":
                copies = []
            elif fault.kind == "duplicate":
                copies = copies * 2
            elif fault.kind == "nan":
                copies = [_spoiled(copy) for copy in copies]
            elif fault.kind == "delay":
                delay += fault.by
            elif fault.kind == "swap":
                swapped = True
            elif fault.kind == "freeze" and self._last is not None:
                self._frozen, self._frozen_until = self._last, now + fault.by
        if now < self._frozen_until and self._frozen is not None:
            copies = [self._frozen] * len(copies)
            self._repeats = self._repeats + 1 if now == self._repeated_at else 1
            self._repeated_at = now
            if self._repeats == MOST_AT_ONCE:
                self._frozen_until = now
        else:
            self._last = delivery
        if swapped:
            self._held += copies
            return
        self._pass_on([*copies, *self._held], delay)
        self._held = []

    def _pass_on(self, deliveries: list[Delivery], delay: float) -> None:
        for delivery in deliveries:
            if delay:
                self._loop.call_later(delay, self._arrive, delivery)
            else:
                delivery.target(delivery.message)

    def _arrive(self, delivery: Delivery) -> None:
        if self._subscription in self._subscription.entry.subscriptions:  # otherwise it has left the topic
            delivery.target(delivery.message)


def is_guest(subscription: SubscriptionPeer) -> bool:
    """Whether a subscription belongs to a node outside the tree. It serves the test itself, so no faults are drawn for it."""
    life = cast("Incarnation", subscription.node)
    return not life.runtime.tree.holds(life.record.path)


class Links(TopicInterceptor):
    """The links of all subscriptions of a run, with the faults of that run."""

    def __init__(self, faults: Sequence[Fault], profile: Profile) -> None:
        self._faults = faults
        self._profile = profile
        self._links: dict[SubscriptionPeer, Link] = {}

    def delivering(self, publisher: PublisherPeer, subscription: SubscriptionPeer, target: Target) -> Target:
        link = self._links.get(subscription)
        if link is None:
            name = f"{subscription.entry.name}>{subscription.node.fqn}"
            mine = [fault for fault in self._faults if fault.target == name]
            link = self._links[subscription] = Link(subscription, name, mine, self._profile)
        return partial(link.deliver, target)


def _spoiled(delivery: Delivery) -> Delivery:
    """The delivery with NaN for all its numbers and with the same expiry."""
    message = delivery.message
    if isinstance(message, ExpiringMessage):
        return delivery._replace(message=message.holding(not_a_number(message.message)))
    return delivery._replace(message=not_a_number(message))


def has_numbers(message: Message) -> bool:
    """Whether a message contains a floating-point number."""
    return any(_is_numeric(getattr(message, name)) for name in message.__struct_fields__)


def _is_numeric(value: object) -> bool:
    if isinstance(value, float):
        return True
    if isinstance(value, np.ndarray):
        return _is_floating(cast("NDArray[np.generic]", value))
    if isinstance(value, tuple):
        return any(_is_numeric(item) for item in cast("tuple[object, ...]", value))
    return isinstance(value, Message) and has_numbers(value)


def not_a_number(message: M) -> M:
    """Copy a message with every floating-point number replaced by NaN."""
    return message.replace(**{name: _to_nan(getattr(message, name)) for name in message.__struct_fields__})


def _to_nan(value: object) -> object:
    if isinstance(value, float):
        return math.nan
    if isinstance(value, np.ndarray):
        array = cast("NDArray[np.generic]", value)
        return np.full_like(array, math.nan) if _is_floating(array) else array
    if isinstance(value, tuple):
        return tuple(_to_nan(item) for item in cast("tuple[object, ...]", value))
    return not_a_number(value) if isinstance(value, Message) else value


def _is_floating(array: NDArray[np.generic]) -> bool:
    return array.dtype.kind == "f"
