"""Zenoh's Python binding by itself: the same bytes, with the same attachments."""

from __future__ import annotations

import asyncio
import json
import struct
import time
from typing import Any

import zenoh

from tests.benchmarks._wire import IMAGE, SMALL, Arrivals, Far, Work, calls, stream, ticks

ATTACHMENT = b"\0" * 33
STAMP = struct.Struct("<q")


def opened(work: Work, **settings: list[str]) -> Any:
    config = zenoh.Config()
    for path, value in {
        "mode": "peer", "scouting/multicast/enabled": False, "scouting/delay": 0, "timestamping/enabled": True,
        "transport/shared_memory/enabled": work == "shared",
        "listen/endpoints": [], "connect/endpoints": [], **{f"{name}/endpoints": ends for name, ends in settings.items()},
    }.items():  # fmt: skip
        config.insert_json5(path, json.dumps(value))
    return zenoh.open(config)


async def far(work: Work, port: int) -> None:
    arrivals = Arrivals(work)
    session = await asyncio.to_thread(opened, work, listen=[f"tcp/127.0.0.1:{port}"])

    def take(sample: Any) -> None:
        sample.payload.to_bytes(), sample.attachment.to_bytes()
        arrivals.take()

    def stamp(sample: Any) -> None:
        arrivals.stamped(*STAMP.unpack(sample.payload.to_bytes()))

    def answer(query: Any) -> None:
        query.reply("ask", b"\0" * 12, attachment=query.attachment)
        query.drop()

    declared = [
        session.declare_subscriber("texts", take),
        session.declare_subscriber("stamps", stamp),
        session.declare_queryable("ask", answer, complete=True),
    ]
    arrivals.ready()
    await asyncio.Event().wait()
    del declared


async def near(work: Work, port: int, far: Far) -> list[float]:
    session = await asyncio.to_thread(opened, work, connect=[f"tcp/127.0.0.1:{port}"])
    try:
        blocks = zenoh.CongestionControl.BLOCK if work in ("images", "shared") else zenoh.CongestionControl.DROP
        publisher = session.declare_publisher("stamps" if work == "latency" else "texts", congestion_control=blocks)
        while not session.info.peers_zid() or (work != "calls" and not publisher.matching_status.matching):
            await asyncio.sleep(0.01)
        if work == "latency":
            return await ticks(far, lambda now: publisher.put(STAMP.pack(now), attachment=ATTACHMENT))
        if work == "calls":
            time.sleep(0.1)  # noqa: ASYNC251
            return await calls(far, lambda: ask(session))
        payload = b"\0" * (SMALL if work == "messages" else IMAGE)
        return await stream(work, far, lambda: publisher.put(payload, attachment=ATTACHMENT))
    finally:
        await asyncio.to_thread(session.close)


async def ask(session: Any) -> None:
    loop = asyncio.get_running_loop()
    answered: asyncio.Future[bytes] = loop.create_future()

    def got(reply: Any) -> None:
        loop.call_soon_threadsafe(answered.set_result, reply.ok.payload.to_bytes())

    session.get("ask", zenoh.handlers.Callback(got, indirect=False), payload=b"\0" * 8, attachment=ATTACHMENT)
    assert len(await answered) == 12
