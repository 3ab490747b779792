"""What the processes that an agent launches take from it: the environment, in which it says how their nodes take part in the graph."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Final

from actors.hosts.agent import Running
from actors.hosts.messages import Launch
from actors.processes.channel import framed
from actors.processes.messages import Event, Line, Opaque
from actors.processes.os_process import Started, discard, employ, prepared, still_waiting
from actors.processes.pickling import pack
from actors.processes.preparation import preparation
from actors.transport.environment import transport_from_environment
from actors.transport.protocol import Transport, WireUnavailable

LISTEN: Final = "ROBACTOR_AGENT_LISTEN"
CONNECT: Final = "ROBACTOR_AGENT_CONNECT"
"""The variables with the endpoints of the processes of an agent, separated by commas."""

_MODULES: Final = ("actors.hosts.launcher", "actors.transport.zenoh.transport", "zenoh", "structlog")
"""What every process of an agent needs."""
_REST: Final = 1.0
"""Seconds after which the next interpreter is started: first the one that has just got an order has the processor."""
_HEAD: Final = 11
"""Bytes of a pickle before its content: its protocol, and the length of its first part."""
_LINE: Final = pack(Line(0.0, 0, "", 0, "", {}))[_HEAD:].partition(b"Line")[0] + b"Line"
"""How the content of a line begins: with the name of its class."""


def transport_here() -> Transport:
    """The transport of a process that an agent has launched. Raises WireUnavailable."""
    listen, connect = (tuple(filter(None, os.environ.get(name, "").split(","))) for name in (LISTEN, CONNECT))
    transport = transport_from_environment(os.environ, listen=listen, connect=connect)
    if transport is None:
        raise WireUnavailable("the agent of this machine has RMW_IMPLEMENTATION=in_process: its processes reach nobody")
    return transport


class Launcher:
    """Launches processes of this machine, which are killed when this process ends. One interpreter is started before it is needed, so that a
    child need not wait until one is.

    Invariant: `_next` is an interpreter that has its preparation and no order, or None until it is started.
    """

    def __init__(self, modules: Sequence[str] = ()) -> None:
        self._loop = asyncio.get_running_loop()
        self._preparation = framed(preparation(main=False, modules=(*_MODULES, *modules)))
        self._next: Started | None = None
        self._timer = self._loop.call_soon(self._start)

    async def launch(self, message: Launch, take: Callable[[Event | Opaque], None]) -> Running:
        """Launch a process. Raises OSError."""
        started, self._next = still_waiting(self._next), None
        if started is None:
            started = self._started()
        self._timer.cancel()
        self._timer = self._loop.call_later(_REST, self._start)
        order = framed(Opaque(message.order))
        return await employ(started, message.path, message.hang, order, take, _unread)

    def close(self) -> None:
        """Start none any more, and end the one that waits."""
        self._timer.cancel()
        if self._next is not None:
            discard(self._next)

    def _start(self) -> None:
        with suppress(OSError):  # it is tried again when a child comes, who learns of it then
            self._next = self._started()

    def _started(self) -> Started:
        return prepared("robactor-agent", self._preparation, fenced=True)


def _unread(data: bytes) -> Opaque:
    """What a process tells: it is for the tree."""
    return Opaque(data, line=data.startswith(_LINE, _HEAD))
