"""`Probe`: a recording of one topic in a test."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, Generic

from actors.checks import NoPublicConstructor
from actors.interfaces.message import M
from actors.qos.policies import QoS
from actors.topics.subscription import Subscription


class Probe(Subscription[M], Generic[M], metaclass=NoPublicConstructor):
    """The messages published on a topic since the probe was created, with their times.

    `times[i]` is when message i was received, in seconds on the system's clock. A probe has no bound: it keeps all messages, unlike other
    subscriptions.

    It has no public constructor: `Rig.probe` gives one.
    """

    __slots__ = ("_now", "times")

    def __init__(self, rig_node: Any, entry: Any, type: type[M], qos: QoS, now: Callable[[], float]) -> None:
        super().__init__(rig_node, entry, type, qos)
        self.keep_all = False  # it has no bound, so no publisher has to wait for it
        self.times: list[float] = []
        self._now = now

    def deliver(self, message: M) -> None:
        self.received += 1
        self.messages.append(message)
        self.times.append(self._now())

    def __len__(self) -> int:
        return len(self.messages)

    def __iter__(self) -> Iterator[M]:
        return iter(self.messages)

    def __getitem__(self, index: int) -> M:
        return self.messages[index]

    @property
    def last(self) -> M | None:
        """The newest message, or None. Use it in comparisons, as in ``probe.last == Twist()``."""
        return self.messages[-1] if self.messages else None

    @property
    def newest(self) -> M:
        """The newest message. Use it to read fields, as in ``probe.newest.linear.x``. Raises `AssertionError` if there is none."""
        if not self.messages:
            raise AssertionError(f"nothing has come on {self.entry.name} since the probe was made")
        return self.messages[-1]

    def clear(self) -> None:
        """Discard the messages received so far."""
        self.messages.clear()
        self.times.clear()
