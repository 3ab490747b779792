"""The contract of transports, over Zenoh."""

from __future__ import annotations

from collections.abc import AsyncIterator

import pytest

from tests.actors.transport.contract import LossContract, PartitionContract, TransportContract
from tests.actors.transport.zenoh.wires import CutWire, PeerWire


class TestZenoh(TransportContract):
    @pytest.fixture
    def wire(self) -> PeerWire:
        return PeerWire()


class TestBrokenZenoh(LossContract, PartitionContract):
    @pytest.fixture
    async def wire(self) -> AsyncIterator[CutWire]:
        wire = CutWire()
        yield wire
        await wire.close()
