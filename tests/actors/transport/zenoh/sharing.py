"""A process with shared memory if ROBACTOR_SHARED_MEMORY says so, for tests that end it: ``python -m tests.actors.transport.zenoh.sharing put|take``.

It meets others at ROBACTOR_GOSSIP_PORT, and ends with its input.
"""

from __future__ import annotations

import asyncio
import os
import sys

from actors.transport.keyed.protocol import Delivery
from actors.transport.zenoh import ZenohConfig
from actors.transport.zenoh.transport import ZenohKeys
from tests.actors.transport.contract.parties import Changes, Party

KEY = "7/image/T/H"
IMAGE = bytes(range(256)) * 3600
"""921,600 bytes, a picture of 640 x 480 pixels."""


async def main(what: str) -> None:
    party = Party(ZenohKeys(ZenohConfig.from_environment(os.environ)), Changes())
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
    asyncio.run(main(sys.argv[1]))
