"""What the processes that an agent launches take from it: the environment, in which it says how their nodes take part in the graph."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import TYPE_CHECKING, Final

from actors.hosts.agent import Running
from actors.hosts.messages import Launch
from actors.processes.channel import framed
from actors.processes.messages import Beat, Event, Opaque
from actors.processes.pickling import pack
from actors.processes.preparation import preparation
from actors.processes.spawned import launch
from actors.transport.environment import transport_from_environment
from actors.transport.protocol import WireUnavailable

if TYPE_CHECKING:
    from actors.transport.protocol import Transport

__all__ = ["CONNECT", "LISTEN", "launch_here", "transport_here"]

LISTEN: Final = "ROBACTOR_AGENT_LISTEN"
CONNECT: Final = "ROBACTOR_AGENT_CONNECT"
"""The variables with the endpoints of the processes of an agent, separated by commas."""

_BEAT: Final = pack(Beat())


def transport_here() -> Transport:
    """The transport of a process that an agent has launched. Raises WireUnavailable."""
    listen, connect = (tuple(filter(None, os.environ.get(name, "").split(","))) for name in (LISTEN, CONNECT))
    transport = transport_from_environment(os.environ, listen=listen, connect=connect)
    if transport is None:
        raise WireUnavailable("the agent of this machine has RMW_IMPLEMENTATION=in_process: its processes reach nobody")
    return transport


async def launch_here(message: Launch, take: Callable[[Event | Opaque], None]) -> Running:
    """Launch a process of this machine, which is killed when this process ends. Raises OSError."""
    frames = framed(preparation(main=False)) + framed(Opaque(message.order))
    return await launch(message.path, message.hang, frames, take, _unread, fenced=True)


def _unread(data: bytes) -> Beat | Opaque:
    """What a process tells, unless it is for this one."""
    return Beat() if data == _BEAT else Opaque(data)
