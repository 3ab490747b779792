"""What is done for links that are slower than what is published."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator

import pytest
import pytest_asyncio
import zenoh

from actors.interfaces import decode, encode
from actors.interfaces.sensor_msgs.msg import Image
from actors.transport.keyed.protocol import BULK, Delivery
from actors.transport.zenoh import ZenohConfig
from actors.transport.zenoh.history import declare_publishers
from actors.transport.zenoh.transport import ZenohKeys
from tests.actors.transport.contract.parties import Changes, Party
from tests.actors.transport.zenoh.wires import Relay, free_port

KEY = "0/camera/image/sensor_msgs::msg::dds_::Image_/RIHS01_1"
IMAGE = encode(Image(height=100, width=1000, encoding="mono8", step=1000, data=bytes(100_000)))


class Wire:
    """A party of ours whose link, to whoever connects by `relay`, is watched."""

    def __init__(self, *, thin: bool) -> None:
        port = free_port()
        self.relay = Relay(port)
        config = ZenohConfig(listen=(f"tcp/127.0.0.1:{port}",), gossip_port=0, thin_links=thin)
        self.changes = Changes()
        self.party = Party(ZenohKeys(config), self.changes)

    async def open(self) -> None:
        await self.party.open()
        self.server = await self.relay.start()

    async def close(self) -> None:
        await self.party.transport.close()
        self.relay.cut()
        self.server.close()
        await self.server.wait_closed()

    async def receive_from_far(self, *, compression: bool) -> tuple[bytes, int]:
        """What a plain session of Zenoh, which was not written by us, receives of an image, and how many bytes that took."""
        config = zenoh.Config()
        for path, value in {
            "mode": "peer",
            "scouting/multicast/enabled": False,
            "listen/endpoints": [],
            "connect/endpoints": [f"tcp/127.0.0.1:{self.relay.port}"],
            "transport/unicast/compression/enabled": compression,
        }.items():
            config.insert_json5(path, json.dumps(value))
        loop = asyncio.get_running_loop()
        arrived: asyncio.Future[bytes] = loop.create_future()
        session = await loop.run_in_executor(None, zenoh.open, config)
        try:
            take = lambda sample: loop.call_soon_threadsafe(arrived.set_result, sample.payload.to_bytes())  # noqa: E731
            session.declare_subscriber(KEY, take)
            outlet = self.party.transport.outlet(KEY, Delivery(priority=BULK))
            await self.changes.until(lambda: outlet.wanted, "somebody listens")
            before = self.relay.passed
            outlet.put(IMAGE, b"attached")
            return await asyncio.wait_for(arrived, 10.0), self.relay.passed - before
        finally:
            await loop.run_in_executor(None, session.close)


@pytest_asyncio.fixture
async def wire(request: pytest.FixtureRequest) -> AsyncIterator[Wire]:
    made = Wire(thin=request.param)
    await made.open()
    yield made
    await made.close()


@pytest.mark.parametrize("wire", [True], indirect=True)
async def test_what_is_compressed_on_the_link_is_plain_cdr_for_who_receives_it(wire: Wire) -> None:
    received, passed = await wire.receive_from_far(compression=True)

    assert received == IMAGE
    assert decode(Image, received).data.tobytes() == bytes(100_000)
    assert passed < 10_000


@pytest.mark.parametrize("wire", [True], indirect=True)
async def test_a_process_that_does_not_compress_is_understood(wire: Wire) -> None:
    received, passed = await wire.receive_from_far(compression=False)

    assert received == IMAGE
    assert passed > 100_000


@pytest.mark.parametrize("wire", [False], indirect=True)
async def test_nothing_is_compressed_unless_it_was_said(wire: Wire) -> None:
    received, passed = await wire.receive_from_far(compression=True)

    assert received == IMAGE
    assert passed > 100_000


@pytest.mark.parametrize(
    ("thin", "delivery", "blocks"),
    [
        (True, Delivery(reliable=False, priority=BULK), True),
        (False, Delivery(reliable=False, priority=BULK), False),
        (True, Delivery(reliable=False), False),
        (False, Delivery(keep_all=True), True),
        (False, Delivery(history=1), True),
    ],
)
async def test_only_what_is_large_and_what_may_not_be_lost_waits_for_a_link(
    thin: bool, delivery: Delivery, blocks: bool
) -> None:
    config = zenoh.Config()
    config.insert_json5("listen/endpoints", "[]")
    config.insert_json5("scouting/multicast/enabled", "false")
    with zenoh.open(config) as session:
        publishers = declare_publishers(session, KEY, delivery, thin)

        assert publishers.blocks is blocks
        declared = publishers.plain
        assert declared.congestion_control == (  # type: ignore[attr-defined]
            zenoh.CongestionControl.BLOCK if blocks else zenoh.CongestionControl.DROP
        )
        # Zenoh does not wait with what is sent with best effort.
        assert (declared.reliability == zenoh.Reliability.RELIABLE) is (delivery.reliable or blocks)  # type: ignore[attr-defined]
        for publisher in {publishers.plain, publishers.sends}:
            publisher.undeclare()
