"""A process with shared memory, for tests that end it: ``python -m tests.actors.transport.zenoh.sharing PORT put|take``. It ends with its input."""

from __future__ import annotations

import asyncio
import sys

from actors.transport.protocol import Delivery
from actors.transport.zenoh import ZenohConfig, ZenohTransport
from tests.actors.transport.contract.parties import Changes, Party

KEY = "7/image/T/H"
IMAGE = bytes(range(256)) * 4096


async def main(port: int, what: str) -> None:
    party = Party(ZenohTransport(ZenohConfig(gossip_port=port, shared_memory=16)), Changes())
    await party.open()
    if what == "put":
        outlet = await party.outlet(KEY, Delivery())
        outlet.put(IMAGE, b"")
        print("put", flush=True)
    else:
        heard, _ = party.listen(KEY, Delivery())
        print("listens", flush=True)
        await party.until(lambda: heard.payloads, "an image has come")
        print("complete" if heard.payloads == [IMAGE] else "different", flush=True)
    await asyncio.to_thread(sys.stdin.read)
    await party.transport.close()


if __name__ == "__main__":
    asyncio.run(main(int(sys.argv[1]), sys.argv[2]))
