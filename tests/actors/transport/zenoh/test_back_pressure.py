"""A slow reader in another process holds back who sends to it, and loses nothing."""

from __future__ import annotations

import asyncio

from actors import Child, Node, Topic, qos, run
from actors.interfaces.std_msgs.msg import String
from actors.transport.zenoh import ZenohConfig, ZenohTransport
from tests.actors.transport.zenoh.wires import free_port

ALL = Topic(String, "all", qos.DEFAULT.replace(history=qos.History.KEEP_ALL, limit=10))
SIZE = 2000


class Reader(Node):
    """Reads nothing at first, and then everything."""

    async def on_start(self) -> None:
        self.begin = asyncio.Event()
        self.taken: list[int] = []

    @ALL.on()
    async def take(self, message: String) -> None:
        await self.begin.wait()
        self.taken.append(int(message.data[:8]))


async def test_nothing_is_lost_on_the_way_to_a_reader_that_is_full_and_the_sender_waits() -> None:
    port = free_port()

    def transport() -> ZenohTransport:
        return ZenohTransport(ZenohConfig(gossip_port=port))

    async with (
        run(Child(Reader, name="reader"), transport=transport(), signals=False, sinks=()) as there,
        run(Child(Node, name="sender"), transport=transport(), signals=False, sinks=()) as here,
    ):
        publisher, reader = here.node("sender").publisher(ALL), there.node(Reader)
        while not publisher.subscription_count:
            await asyncio.sleep(0.01)
        sent, enough = 0, False

        async def send() -> None:
            nonlocal sent
            while not enough:
                await publisher.send(String(data=f"{sent:08}" + "x" * SIZE))
                sent += 1

        sending = asyncio.ensure_future(send())
        while not publisher.peers[0].full:  # the link holds some megabytes, how many is the system's matter
            await asyncio.sleep(0.01)
        assert reader.taken == []
        reader.begin.set()
        enough = True
        await sending
        while len(reader.taken) < sent:
            await asyncio.sleep(0.01)

        assert reader.taken == list(range(sent))
        assert reader.subscription(ALL).dropped == 0
