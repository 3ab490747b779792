"""Interceptors of topics: they stand between publishers and subscriptions."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, TypeAlias

if TYPE_CHECKING:
    from actors.interfaces.message import Message
    from actors.topics.peers import PublisherPeer, SubscriptionPeer, Target

Tap: TypeAlias = "Callable[[PublisherPeer], Callable[[Message], None]]"
"""Called with a publisher, it returns the function that receives each of its messages; see `Graph.tap`."""


class TopicInterceptor:
    """Stands between publishers and subscriptions. This one lets all messages pass; a derived class overrides what it watches or changes.

    The methods are called when an end joins or a match changes, not with each message. The functions that they return must not raise.
    """

    def tapping(self, publisher: PublisherPeer) -> Callable[[Message], None] | None:
        """Return a function to be called with each message of `publisher` besides its targets, or None. Called once for each publisher."""
        return None

    def publishing(self, publisher: PublisherPeer, targets: tuple[Target, ...]) -> tuple[Target, ...]:
        """Return the functions that `publisher`, of this process, calls with each message instead of `targets`, its subscriptions and taps."""
        return targets

    def delivering(self, publisher: PublisherPeer, subscription: SubscriptionPeer, target: Target) -> Target:
        """Return the function that `publisher` calls with each message instead of `target`, which belongs to a subscription of this process."""
        return target


class TopicTap(TopicInterceptor):
    """A wire tap on every publisher."""

    def __init__(self, tap: Tap) -> None:
        self._tap = tap

    def tapping(self, publisher: PublisherPeer) -> Callable[[Message], None]:
        return self._tap(publisher)
