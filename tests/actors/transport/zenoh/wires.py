"""Wires for the contract: Zenoh sessions on loopback ports of their own."""

from __future__ import annotations

import asyncio
import socket
from contextlib import suppress

from actors.transport.keyed.protocol import KeyTransport
from actors.transport.zenoh import ZenohConfig
from actors.transport.zenoh.transport import ZenohKeys


def free_port() -> int:
    """A port of the loopback interface at which nobody listens."""
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        port: int = one.getsockname()[1]
        return port


class PeerWire:
    """Peers that find each other by a gossip point of their own."""

    def __init__(self) -> None:
        self.port = free_port()

    def transport(self) -> ZenohKeys:
        return ZenohKeys(ZenohConfig(gossip_port=self.port))


class Relay:
    """A port that leads to another one, unless it is cut."""

    def __init__(self, port: int) -> None:
        self._socket = socket.socket()
        self._socket.bind(
            ("127.0.0.1", 0)
        )  # held from here on: another program could take a port that is only known to be free
        self.port: int = self._socket.getsockname()[1]
        self.is_cut = False
        self.passed = 0
        """Bytes that have passed, in both directions."""
        self._to = port
        self._writers: list[asyncio.StreamWriter] = []

    async def start(self) -> asyncio.Server:
        return await asyncio.start_server(self._accept, sock=self._socket)

    def cut(self) -> None:
        self.is_cut = True
        for writer in self._writers:
            writer.transport.abort()
        self._writers.clear()

    async def _accept(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._writers.append(writer)
        if self.is_cut:
            writer.transport.abort()
            return
        try:
            far_reader, far_writer = await asyncio.open_connection("127.0.0.1", self._to)
        except OSError:
            writer.transport.abort()
            return
        self._writers.append(far_writer)
        await asyncio.gather(self._pump(reader, far_writer), self._pump(far_reader, writer))

    async def _pump(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        with suppress(OSError):
            while data := await reader.read(65536):
                self.passed += len(data)
                writer.write(data)
                await writer.drain()
        writer.transport.abort()


class CutWire:
    """Peers that are linked through relays, each with each, so that links can be cut."""

    def __init__(self) -> None:
        self._ports: dict[str, int] = {}
        self._relays: dict[frozenset[str], Relay] = {}
        self._servers: list[asyncio.Server] = []

    async def close(self) -> None:
        for relay in self._relays.values():
            relay.cut()
        for server in self._servers:
            server.close()
            await server.wait_closed()

    def transport(self) -> ZenohKeys:
        relays = {session: Relay(port) for session, port in self._ports.items()}
        port = free_port()
        config = ZenohConfig(
            gossip_port=0,
            listen=(f"tcp/127.0.0.1:{port}",),
            connect=tuple(f"tcp/127.0.0.1:{relay.port}" for relay in relays.values()),
            overrides="scouting/gossip/enabled=false",
        )
        transport = ZenohKeys(config)
        self._ports[transport.session] = port
        for session, relay in relays.items():
            self._relays[frozenset((session, transport.session))] = relay
            task = asyncio.ensure_future(relay.start())
            task.add_done_callback(lambda done: self._servers.append(done.result()))
        return transport

    def kill(self, transport: KeyTransport) -> None:
        for pair, relay in self._relays.items():
            if transport.session in pair:
                relay.cut()

    def cut(self, one: KeyTransport, other: KeyTransport) -> None:
        self._relays[frozenset((one.session, other.session))].cut()

    def heal(self, one: KeyTransport, other: KeyTransport) -> None:
        self._relays[frozenset((one.session, other.session))].is_cut = False
