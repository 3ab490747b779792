"""What `doctor` finds in the graph that a server shows, looked at again and again while a client wants to know."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator
from contextlib import asynccontextmanager
from dataclasses import asdict
from typing import TYPE_CHECKING, Any, Final

from actors.bag.capture import Capture
from actors.bag.ring import Channel
from actors.runtime.incarnation import incarnation_of
from actors.transport.figures import FIGURES, PERIOD, ProcessFigures
from cli.verbs.doctor import checks
from cli.verbs.doctor.inside import Inside

if TYPE_CHECKING:
    from actors import Node, System
    from actors.topics.lazy_message import LazyMessage
    from actors.topics.peers import PublisherPeer
    from cli.verbs.doctor.observation import Told

LOOK_EVERY: Final = 2 * PERIOD
"""Seconds between two looks: both reports of a process include what is lost between them."""


class Examination:
    """The looks at one graph, each compared with the one before."""

    def __init__(self, system: System) -> None:
        self._system = system
        self._inside = Inside(system)

    def take(self, channel: Channel, publisher: PublisherPeer, arrival: LazyMessage) -> None:
        """The `ProcessFigures` of another process; none have come from this one, whatever is published under that name."""
        if arrival.sent_ns is not None:
            self._inside.take(arrival.message, (self._system.clock.wall_ns() - arrival.sent_ns) / 1e9)

    @property
    def others(self) -> tuple[Told, ...]:
        """What other processes tell of themselves, as `Inside.others`."""
        return self._inside.others

    async def findings(self) -> list[dict[str, Any]]:
        """What is wrong, or may be, as plain data. Between two checks the loop has its turn."""
        seen, found = self._inside.look(), list[dict[str, Any]]()
        for check in checks(None, inside=True):
            await asyncio.sleep(0)
            found += [{"check": check.title, **asdict(one)} for one in check.find(seen) if one.level != "info"]
        return found


@asynccontextmanager
async def examining(node: Node, system: System) -> AsyncGenerator[Examination]:
    """Looks at the graph of a system for as long as the block lasts. Meanwhile other processes tell their figures."""
    examination = Examination(system)
    channel = Channel(FIGURES.name, ProcessFigures)
    topic = system.graph.topic(FIGURES.name)
    capture = Capture(incarnation_of(node), topic, channel, FIGURES.qos, examination.take, decoded=True)
    try:
        yield examination
    finally:
        capture.close()
