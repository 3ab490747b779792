"""Which systems are open in which event loop: how `open_node` finds the one that it joins."""

from __future__ import annotations

import asyncio
from typing import Generic, TypeVar

__all__ = ["OpenSystems"]

S = TypeVar("S")


class OpenSystems(Generic[S]):
    """The open systems of this process, by event loop.

    Invariant: a system is in the list of its loop exactly from `add` to `remove`; a loop without open systems is not kept alive.
    """

    def __init__(self) -> None:
        self._systems: dict[asyncio.AbstractEventLoop, list[S]] = {}

    def add(self, loop: asyncio.AbstractEventLoop, system: S) -> bool:
        """The system is open now. False when it was already."""
        here = self._systems.setdefault(loop, [])
        if system in here:
            return False
        here.append(system)
        return True

    def remove(self, loop: asyncio.AbstractEventLoop, system: S) -> None:
        """The system has ended."""
        here = self._systems[loop]
        here.remove(system)
        if not here:
            del self._systems[loop]

    def of(self, loop: asyncio.AbstractEventLoop) -> tuple[S, ...]:
        """The open systems of this loop, the newest last."""
        return tuple(self._systems.get(loop, ()))
