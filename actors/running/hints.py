"""Hints about topics on which nobody is heard: a misspelt name, or a program that reaches no other process."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Callable
from typing import Final

from actors.names.names import is_hidden
from actors.system import System
from actors.transport.environment import IN_PROCESS, VARIABLE

AFTER: Final = 5.0
"""How long an endpoint is alone before there is a hint, at least; seconds."""
_STANDARD: Final = ("/rosout", "/parameter_events", "/clock")


def give_hints(system: System, *, alone: bool) -> Callable[[], None]:
    """Log a hint for each subscription without a publisher, once, if somebody publishes on a topic of nearly that name.

    `alone` is true for a system without a transport, of which nobody knows whether it is meant: for its first topic that only one side
    uses there is a hint of its own. The returned function ends the hints.
    """
    graph, loop = system.graph, system.loop
    alone = alone and os.environ.get(VARIABLE) != IN_PROCESS
    told: set[str] = set()
    pending: asyncio.TimerHandle | None = None

    def changed() -> None:
        nonlocal pending
        if pending is None:
            pending = loop.call_later(AFTER, look)

    def look() -> None:
        nonlocal pending, alone
        pending = None
        for name, entry in sorted(graph.topics.items()):
            if name in _STANDARD or is_hidden(name):
                continue
            here = [one.node.fqn for one in entry.subscriptions if one.here]
            if here and not entry.publishers and name not in told and (meant := entry.meant()):
                told.add(name)
                system.log.warning(f"nobody publishes {name}{meant}", subscribed_by=", ".join(sorted(here)))
            elif alone and bool(entry.publishers) is not bool(entry.subscriptions):
                alone = False
                side = "publishes" if here else "subscribes to"
                system.log.info(
                    f"nobody here {side} {name}, and other processes are not reached",
                    remedy="spin(tree) or run(tree, transport=transport_from_environment(os.environ)) reaches them",
                )

    leave = graph.on_change(changed)
    changed()

    def end() -> None:
        leave()
        if pending is not None:
            pending.cancel()

    return end
