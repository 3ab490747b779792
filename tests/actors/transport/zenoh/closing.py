"""Publishers that keep samples are closed while subscriptions come and go: ``python -m tests.actors.transport.zenoh.closing PORT``."""

from __future__ import annotations

import asyncio
import sys

from actors.transport.keyed.protocol import Delivery
from actors.transport.zenoh import ZenohConfig
from actors.transport.zenoh.transport import ZenohKeys
from tests.actors.transport.contract.parties import Changes, Party


async def main(port: int) -> None:
    a, b = (Party(ZenohKeys(ZenohConfig(gossip_port=port)), Changes()) for _ in range(2))
    await a.open()
    await b.open()
    await a.until(lambda: a.is_linked(b.session), "they are linked")
    kept = Delivery(history=1)
    for round in range(60):
        keys = [f"7/{round}_{number}/T/H" for number in range(5)]
        subscriptions = [b.transport.subscribe(key, kept, lambda _: None) for key in keys]
        outlets = [a.transport.outlet(key, kept) for key in keys]
        for outlet in outlets:
            outlet.put(b"x", b"")
        await asyncio.sleep(0.001 * (round % 5))  # another moment of Zenoh's each time
        for handle in (*outlets, *subscriptions):
            handle.close()
    await a.transport.close()
    await b.transport.close()


if __name__ == "__main__":
    asyncio.run(main(int(sys.argv[1])))
