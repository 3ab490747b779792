"""Faults of messages: what stands between a publisher and a subscription in a simulated run."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from actors.inbox.expiring import ExpiringMessage
from actors.interfaces.message import Message
from actors.testing.faults import Fault, Profile

if TYPE_CHECKING:
    from actors.runtime.incarnation import Incarnation
    from actors.topics.channel import Subscription

M = TypeVar("M", bound=Message)

__all__ = ["Link", "entrance", "has_numbers", "not_a_number"]


MOST_AT_ONCE = 100
"""So many messages of one instant are frozen, and no more: whoever answers each of them at once would never let time pass."""


class Link:
    """The way of one topic's messages into one subscription: counts them, and does to the n-th what the faults say."""

    def __init__(self, queue: Subscription[Any], name: str, faults: Sequence[Fault], profile: Profile) -> None:
        self._queue = queue
        self._name = name
        self._profile = profile
        self._links = profile.watching if is_guest(queue) else profile.links
        self._loop = asyncio.get_running_loop()
        self._faults: dict[int, list[Fault]] = {}
        for fault in faults:
            self._faults.setdefault(fault.nth, []).append(fault)
        self._held: list[Message | ExpiringMessage[Any]] = []
        self._last: Message | ExpiringMessage[Any] | None = None
        self._frozen_until = -1.0
        self._frozen: Message | ExpiringMessage[Any] | None = None
        self._repeats = 0
        self._repeated_at = -1.0

    def deliver(self, message: Message | ExpiringMessage[Any]) -> None:
        """Count the message, and pass it on as the faults say."""
        links = self._links
        nth = links[self._name] = links.get(self._name, 0) + 1
        if nth == 1 and has_numbers(message.message if isinstance(message, ExpiringMessage) else message):
            self._profile.numeric.add(self._name)
        now = self._loop.time()
        copies = [message]
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
            self._last = message
        if swapped:
            self._held += copies
            return
        self._pass_on([*copies, *self._held], delay)
        self._held = []

    def _pass_on(self, messages: list[Message | ExpiringMessage[Any]], delay: float) -> None:
        for message in messages:
            if delay:
                self._loop.call_later(delay, self._arrive, message)
            else:
                self._queue.inlet(message)

    def _arrive(self, message: Message | ExpiringMessage[Any]) -> None:
        if self._queue in self._queue.entry.subscriptions:  # else it has left meanwhile
            self._queue.inlet(message)


def is_guest(queue: Subscription[Any]) -> bool:
    """Whether a subscription belongs to a node beside the tree: a test's own eyes, which no drawn fault may cloud."""
    return not cast("Incarnation", queue.node).record.supervised


def entrance(
    links: dict[Subscription[Any], Link], faults: Sequence[Fault], profile: Profile
) -> Callable[[Subscription[Any]], Callable[[Any], None]]:
    """The graph's way into a subscription, with the faults of this run in between."""

    def enter(queue: Subscription[Any]) -> Callable[[Any], None]:
        link = links.get(queue)
        if link is None:
            name = f"{queue.entry.name}>{queue.node.fqn}"
            mine = [fault for fault in faults if fault.target == name]
            link = links[queue] = Link(queue, name, mine, profile)
        return link.deliver

    return enter


def _spoiled(message: Message | ExpiringMessage[Any]) -> Message | ExpiringMessage[Any]:
    """With NaN for its numbers; a message that ages goes on ageing."""
    return (
        message.holding(not_a_number(message.message))
        if isinstance(message, ExpiringMessage)
        else not_a_number(message)
    )


def has_numbers(message: Message) -> bool:
    """Whether a floating-point number is somewhere in it."""
    return any(_is_numeric(getattr(message, name)) for name in message.__struct_fields__)


def _is_numeric(value: object) -> bool:
    if isinstance(value, float):
        return True
    if isinstance(value, np.ndarray):
        return _is_floating(cast("NDArray[Any]", value))
    if isinstance(value, tuple):
        return any(_is_numeric(item) for item in cast("tuple[object, ...]", value))
    return isinstance(value, Message) and has_numbers(value)


def not_a_number(message: M) -> M:
    """A copy in which every floating-point number is NaN."""
    return message.replace(**{name: _to_nan(getattr(message, name)) for name in message.__struct_fields__})


def _to_nan(value: object) -> object:
    if isinstance(value, float):
        return math.nan
    if isinstance(value, np.ndarray):
        array = cast("NDArray[Any]", value)
        return np.full_like(array, math.nan) if _is_floating(array) else array
    if isinstance(value, tuple):
        return tuple(_to_nan(item) for item in cast("tuple[object, ...]", value))
    return not_a_number(value) if isinstance(value, Message) else value


def _is_floating(array: NDArray[Any]) -> bool:
    return array.dtype.kind == "f"
