"""Wires for the contract: Zenoh sessions on loopback ports of their own."""

from __future__ import annotations

import socket

from actors.transport.zenoh import ZenohConfig, ZenohTransport

__all__ = ["PeerWire", "free_port"]


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

    def transport(self) -> ZenohTransport:
        return ZenohTransport(ZenohConfig(gossip_port=self.port))
