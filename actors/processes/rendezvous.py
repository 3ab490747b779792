"""`Rendezvous`: the transport by which the processes of one tree exchange messages."""

from __future__ import annotations

import asyncio
import os
import socket
from collections.abc import Callable

from actors.checks import create
from actors.runtime.runtime import Runtime
from actors.transport.bridge import Bridge
from actors.transport.domain_id import domain_from_environment
from actors.transport.protocol import Transport


class Rendezvous:
    """Where the processes of one tree meet. If the system has a transport, they use its network. Otherwise a network that is private to the
    tree is opened with the first process, and closed with the system.

    Invariant: a private network is opened at most once; who asks while it is being opened waits for the same opening.
    """

    def __init__(self, runtime: Runtime, transport: Transport | None) -> None:
        self._runtime = runtime
        self._private = transport is None
        self._transport = _private_transport(runtime) if transport is None else transport
        self._opening: asyncio.Task[None] | None = None
        self.domain_id = domain_from_environment(os.environ)

    def sibling(self) -> Callable[[], Transport]:
        """What makes the transport of another process of the tree; `pickle` can copy it to a real one."""
        return self._transport.sibling()

    async def open(self) -> None:
        """Open the private network, if there is one and it is not open yet."""
        if not self._private:
            return
        if self._opening is None:
            bridge = create(Bridge, self._runtime, self._transport, self.domain_id)
            self._runtime.observers.closing.append(bridge.close)
            self._opening = self._runtime.loop.create_task(bridge.open(), name="private transport")
        await self._opening


def _private_transport(runtime: Runtime) -> Transport:
    if runtime.clock.virtual:
        from actors.transport.simulated.network import Network

        network = Network(runtime.seed)
        network.add_host("here")
        return network.transport("here")
    from actors.transport.zenoh import ZenohConfig, ZenohTransport

    return ZenohTransport(ZenohConfig(gossip_port=_free_port()))


def _free_port() -> int:
    """A port of the loopback interface that nobody listens at."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port
