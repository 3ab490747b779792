"""The simulated network as a transport: its contract, on the virtual loop and on the real one."""

from __future__ import annotations

import asyncio

import pytest

from actors.transport.simulated.link import Conditions
from actors.transport.simulated.network import Network
from actors.transport.simulated.session import SimulatedTransport
from actors.transport.simulated.topology import Mode
from tests.actors.transport.contract import LossContract, PartitionContract, TransportContract


class SimulatedWire:
    """Each transport on a host of its own."""

    def __init__(self, network: Network, mode: Mode) -> None:
        self.network = network
        self.mode = mode
        self.hosts = 0

    def transport(self) -> SimulatedTransport:
        self.hosts += 1
        self.network.add_host(f"host{self.hosts}", self.mode)
        return self.network.transport(f"host{self.hosts}")

    def kill(self, transport: SimulatedTransport) -> None:
        self.network.crash(transport.host)

    def cut(self, one: SimulatedTransport, other: SimulatedTransport) -> None:
        if self.mode == "client":
            self.network.cut(one.host, "router")
        else:
            self.network.cut(one.host, other.host)

    def heal(self, one: SimulatedTransport, other: SimulatedTransport) -> None:
        if self.mode == "client":
            self.network.heal(one.host, "router")
        else:
            self.network.heal(one.host, other.host)


@pytest.mark.virtual
class TestPeers(TransportContract, LossContract, PartitionContract):
    """Peers on good wires."""

    @pytest.fixture
    async def wire(self) -> SimulatedWire:
        return SimulatedWire(Network(), "peer")


@pytest.mark.virtual
class TestClients(TransportContract, LossContract, PartitionContract):
    """Clients of a router."""

    @pytest.fixture
    async def wire(self) -> SimulatedWire:
        network = Network(1)
        network.add_host("router", router=True)
        return SimulatedWire(network, "client")


@pytest.mark.virtual
class TestBadWires(TransportContract, LossContract, PartitionContract):
    """Slow wires that lose, double and reorder messages: no guarantee is weaker."""

    @pytest.fixture
    async def wire(self) -> SimulatedWire:
        bad = Conditions(delay=0.01, jitter=0.02, bandwidth=1e6, loss=0.2, duplication=0.2, reordering=0.2, resend=0.05)
        return SimulatedWire(Network(2, conditions=bad), "peer")


class TestRealLoop(TransportContract):
    """The same on the real clock."""

    @pytest.fixture
    async def wire(self) -> SimulatedWire:
        assert not getattr(asyncio.get_running_loop(), "virtual", False)
        return SimulatedWire(Network(3, discovery=0.001), "peer")
