"""Filters of one message at a time: the base of them, what feeds them from a topic, and several in a row."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from operator import attrgetter
from typing import Any, Generic, TypeVar

from actors.contracts.contracts import Topic
from actors.interfaces.message import Message
from actors.message_filters.signal import Connection, Signal
from actors.qos.policies import QoS
from actors.runtime.node import Node

M = TypeVar("M")
T = TypeVar("T", bound="Message")


class SimpleFilter(Signal[M], Generic[M]):
    """Lets messages through, one at a time, to callbacks and to ``async for message in filter``. A base for filters of one's own."""

    def signal_message(self, message: M) -> None:
        """Let a message through."""
        self._emit((message,), message)

    signalMessage = signal_message
    """The name that rclpy's has."""


class PassThrough(SimpleFilter[M]):
    """Lets through what it is given: by hand, or by another filter. The base of filters that have one input."""

    def __init__(self, source: SimpleFilter[M] | None = None) -> None:
        super().__init__()
        self._input: Connection | None = None
        if source is not None:
            self.connect_input(source)

    def connect_input(self, source: SimpleFilter[M]) -> None:
        """Let `source` feed this filter from now on, and no other."""
        if self._input is not None:
            self._input.disconnect()
        self._input = source.register_callback(self.add)
        source.on_close(self.close)

    connectInput = connect_input
    """The name that rclpy's has."""

    def add(self, message: M) -> None:
        """Take in a message."""
        self.signal_message(message)


class Subscriber(SimpleFilter[T]):
    """Lets the messages of a topic through, from now until `close`, or the end of the node's incarnation.

    They are taken out by a task of the node, and so are the callbacks of all filters that it feeds called: an exception of one is the
    node's failure.
    """

    def __init__(self, node: Node, topic: Topic[T], *, qos: QoS | int | None = None) -> None:
        super().__init__()
        self.topic = topic
        self._messages = node.subscribe(topic, qos=qos)
        node.create_task(self._pass_on(), name=f"filter of {topic.name}")

    def __repr__(self) -> str:
        return f"<Subscriber of {self.topic.name}>"

    def close(self) -> None:
        """End the subscription, and all that this filter feeds. A second call is harmless."""
        self._messages.close()
        super().close()

    async def _pass_on(self) -> None:
        try:
            async for message in self._messages:
                self.signal_message(message)
        finally:
            self.close()


class Chain(SimpleFilter[M]):
    """Several filters in a row, as one: the first is fed by `add` or `connect_input`, and what the last lets through comes out."""

    def __init__(self, *filters: PassThrough[M]) -> None:
        super().__init__()
        self._entry: PassThrough[M] = PassThrough()
        self._filters: list[PassThrough[M]] = []
        self._exit = self._entry.register_callback(self.signal_message)
        self._entry.on_close(self.close)
        for each in filters:
            self.add_filter(each)

    def __repr__(self) -> str:
        return f"<Chain of {', '.join(type(each).__name__ for each in self._filters) or 'nothing'}>"

    def add_filter(self, added: PassThrough[M]) -> int:
        """Put a filter at the end, and return its number."""
        last = self._filters[-1] if self._filters else self._entry
        self._exit.disconnect()
        added.connect_input(last)
        self._exit = added.register_callback(self.signal_message)
        self._filters.append(added)
        return len(self._filters) - 1

    addFilter = add_filter
    """The name that rclpy's has."""

    def get_filter(self, index: int) -> PassThrough[M]:
        """The filter of this number."""
        return self._filters[index]

    getFilter = get_filter
    """The name that rclpy's has."""

    def connect_input(self, source: SimpleFilter[M]) -> None:
        """Let `source` feed the first filter from now on, and no other."""
        self._entry.connect_input(source)

    connectInput = connect_input
    """The name that rclpy's has."""

    def add(self, message: M) -> None:
        """Take in a message."""
        self._entry.add(message)


def _differ(before: Any, after: Any) -> bool:
    """Whether two values are unequal; arrays, if they are of unequal shape or one of their elements is."""
    if hasattr(before, "shape") and hasattr(after, "shape"):
        return before.shape != after.shape or bool((before != after).any())
    return bool(before != after)


class DeltaFilter(PassThrough[M]):
    """Lets a message through if one of its `fields` differs from that of the last one that was let through; the first one always.

    A field is a path, such as ``"pose.position.x"``, or a function of the message. ``differs(before, after)`` says whether two values of it
    differ; by default any change counts. Raises ``AttributeError`` for a message that has no such field.
    """

    def __init__(
        self,
        fields: Iterable[str | Callable[[M], object]],
        source: SimpleFilter[M] | None = None,
        *,
        differs: Callable[[Any, Any], bool] = _differ,
    ) -> None:
        self._getters = [attrgetter(field) if isinstance(field, str) else field for field in fields]
        if not self._getters:
            raise ValueError("DeltaFilter: without a field no message differs; give at least one")
        self._differs = differs
        self._last: list[object] | None = None
        super().__init__(source)

    def __repr__(self) -> str:
        return f"<DeltaFilter of {len(self._getters)} fields>"

    def add(self, message: M) -> None:
        """Take in a message."""
        values = [getter(message) for getter in self._getters]
        if self._last is None or any(map(self._differs, self._last, values)):
            self._last = values
            self.signal_message(message)
