"""Work that is done only while somebody wants its result."""

from __future__ import annotations

from collections.abc import AsyncIterator, Callable
from typing import Any, Final, TypeVar

from actors import CallTimeout, Node, QoS, Topic
from actors.interfaces import Message
from actors.typing import Publisher

M = TypeVar("M", bound=Message)

PATIENCE: Final = 1.0
"""Seconds after which a silent topic is subscribed to again, if anybody still wants what is made of it."""


async def while_heard(
    node: Node, out: Publisher[Any], source: Topic[M], qos: QoS | int, rate: Callable[[], float]
) -> AsyncIterator[M]:
    """Messages of `source`, at most `rate()` a second, for ever; subscribed to only while somebody listens to `out`. For a task of `node`."""
    changes = out.events()
    due = node.clock.now()
    while True:
        while not out.subscription_count:
            await anext(changes)
        async with node.subscribe(source, qos=qos) as messages:
            while out.subscription_count:
                try:
                    message = await messages.next(PATIENCE)
                except CallTimeout:
                    continue
                now = node.clock.now()
                if now >= due:
                    due = max(due + 1.0 / rate(), now)  # none is made up for
                    yield message
