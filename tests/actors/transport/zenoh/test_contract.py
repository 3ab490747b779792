"""The contract of transports, over Zenoh."""

from __future__ import annotations

import pytest

from tests.actors.transport.contract import TransportContract
from tests.actors.transport.zenoh.wires import PeerWire


class TestZenoh(TransportContract):
    @pytest.fixture
    def wire(self) -> PeerWire:
        return PeerWire()
