"""The open systems of each event loop, in which `open_node` finds the system that it joins."""

from __future__ import annotations

import asyncio
from typing import Generic, TypeVar

S = TypeVar("S")


class OpenSystems(Generic[S]):
    """The open systems of this process, by event loop.

    Invariants: a system is in the list of its loop exactly from `add` to `remove`; an event loop without open systems is not referenced, and one
    that was closed with open systems only until the next `add`.
    """

    def __init__(self) -> None:
        self._systems: dict[asyncio.AbstractEventLoop, list[S]] = {}

    def add(self, loop: asyncio.AbstractEventLoop, system: S) -> bool:
        """Add an open system. Returns False if it was open already."""
        for other in [*self._systems]:  # loops of other threads come and go meanwhile
            if other.is_closed():
                self._systems.pop(other, None)  # nothing ends its systems any more
        here = self._systems.setdefault(loop, [])
        if system in here:
            return False
        here.append(system)
        return True

    def remove(self, loop: asyncio.AbstractEventLoop, system: S) -> None:
        """Remove a system that has ended."""
        here = [one for one in self._systems.pop(loop, ()) if one is not system]
        if here:
            self._systems[loop] = here

    def of(self, loop: asyncio.AbstractEventLoop) -> tuple[S, ...]:
        """The open systems of this loop, the newest last."""
        return tuple(self._systems.get(loop, ()))
