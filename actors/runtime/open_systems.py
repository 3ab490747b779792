"""The open systems of each event loop, in which `open_node` finds the system that it joins."""

from __future__ import annotations

import asyncio
from typing import Generic, TypeVar

S = TypeVar("S")


class OpenSystems(Generic[S]):
    """The open systems of this process, by event loop.

    Invariants: a system is in the list of its loop exactly from `add` to `remove`; an event loop without open systems is not referenced.
    """

    def __init__(self) -> None:
        self._systems: dict[asyncio.AbstractEventLoop, list[S]] = {}

    def add(self, loop: asyncio.AbstractEventLoop, system: S) -> bool:
        """Add an open system. Returns False if it was open already."""
        here = self._systems.setdefault(loop, [])
        if system in here:
            return False
        here.append(system)
        return True

    def remove(self, loop: asyncio.AbstractEventLoop, system: S) -> None:
        """Remove a system that has ended."""
        here = self._systems[loop]
        here.remove(system)
        if not here:
            del self._systems[loop]

    def of(self, loop: asyncio.AbstractEventLoop) -> tuple[S, ...]:
        """The open systems of this loop, the newest last."""
        return tuple(self._systems.get(loop, ()))
