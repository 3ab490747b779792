"""Endpoints that come and go while others match them, as those of a node that is restarted again and again.

Zenoh's binding for Python can wait for one of Zenoh's threads without giving the interpreter free. Whether that ever happens to us is
tried out in a process of its own, because nothing in that process could end it any more.
"""

from __future__ import annotations

import asyncio
import sys

from tests.actors.transport.zenoh.wires import free_port

PROGRAM = """
import asyncio, sys
from actors.transport.keyed.protocol import Delivery
from actors.transport.zenoh import ZenohConfig
from actors.transport.zenoh.transport import ZenohKeys

KEPT = Delivery(reliable=True, depth=5, history=5)

class Nobody:
    def appeared(self, token): ...
    def vanished(self, token): ...
    def wanted(self, outlet): ...
    def link(self, session, up): ...

async def main():
    config = ZenohConfig(gossip_port=int(sys.argv[1]))
    one, other = ZenohKeys(config), ZenohKeys(config)
    await one.open("t/**", Nobody())
    await other.open("t/**", Nobody())
    loop = asyncio.get_running_loop()
    for round in range(15):
        heard = {}
        everybody = loop.create_future()
        def take(sample):
            heard[sample.key] = heard.get(sample.key, 0) + 1
            if len(heard) == 20 and not everybody.done():
                everybody.set_result(None)
        outlets = [one.outlet(f"k/{number}", KEPT) for number in range(20)]
        for outlet in outlets:
            outlet.put(b"payload", b"")
        listening = [other.subscribe(f"k/{number}", KEPT, take) for number in range(20)]
        await asyncio.wait_for(everybody, 30)
        for number in range(20):  # both sides of each key at once
            listening[number].close()
            outlets[number].close()
    await other.close()
    await one.close()
    print("done", flush=True)

asyncio.run(main())
"""


async def test_publishers_that_keep_samples_can_be_closed_while_others_come_and_go() -> None:
    process = await asyncio.create_subprocess_exec(
        sys.executable, "-c", PROGRAM, str(free_port()), stdout=-1, stderr=-1
    )
    try:
        async with asyncio.timeout(60):
            out, error = await process.communicate()
    finally:
        if process.returncode is None:
            process.kill()
            await process.wait()
    assert (out.decode(), error.decode(), process.returncode) == ("done\n", "", 0)
