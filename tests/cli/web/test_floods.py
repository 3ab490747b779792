"""What one client sends holds up nobody else: neither the loop of the server, nor the other clients."""

from __future__ import annotations

import asyncio
import json
import re
import struct
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import pytest

from cli.web.server import server
from tests.cli.web.stage import Stage, serving, until

FRAMES = 20_000
CLOSE = 8
TURN = 0.05
"""The processor seconds that one turn of the loop may take."""


def frame(opcode: int, final: bool, payload: bytes = b"") -> bytes:
    """A frame as clients write it; its mask changes nothing."""
    assert len(payload) < 126
    return struct.pack(">BBI", (0x80 if final else 0) | opcode, 0x80 | len(payload), 0) + payload


FLOODS = {
    "pings": (b"", frame(9, True)),
    "long pings": (b"", frame(9, True, b"p" * 125)),
    "pongs": (b"", frame(10, True)),
    "empty fragments": (frame(1, False, b"{"), frame(0, False)),
    "fragments": (frame(1, False, b"{"), frame(0, False, b" ")),
}


async def opened(stage: Stage, *headers: str) -> tuple[asyncio.StreamReader, asyncio.StreamWriter, bytes]:
    """A WebSocket of which this test writes the frames, and the first line of the answer."""
    reader, writer = await asyncio.open_connection("127.0.0.1", stage.server.port)
    lines = (
        "GET / HTTP/1.1", f"Host: localhost:{stage.server.port}", "Upgrade: websocket", "Connection: Upgrade",
        "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==", "Sec-WebSocket-Version: 13", *headers, "", "",
    )  # fmt: skip
    writer.write("\r\n".join(lines).encode())
    head = await reader.readuntil(b"\r\n\r\n")
    return reader, writer, head


class Turns:
    """The longest turn of the loop, in processor time of its thread: what others use of the machine does not count."""

    longest = 0.0


@asynccontextmanager
async def turns_measured() -> AsyncIterator[Turns]:
    found = Turns()

    async def measure() -> None:
        before = time.thread_time()
        while True:
            await asyncio.sleep(0)
            now = time.thread_time()
            found.longest, before = max(found.longest, now - before), now

    measuring = asyncio.ensure_future(measure())
    try:
        yield found
    finally:
        measuring.cancel()


@pytest.mark.parametrize("kind", FLOODS)
async def test_a_flood_of_control_frames_or_fragments_ends_with_its_connection_and_holds_nobody_up(kind: str) -> None:
    first, again = FLOODS[kind]
    async with serving() as stage, stage.rosbridge() as honest:
        reader, writer, _ = await opened(stage)
        async with turns_measured() as turns:
            writer.write(first + again * FRAMES)
            answered = await honest.call("/add", {"a": 1, "b": 2})
            said = b""
            async with asyncio.timeout(10.0):
                while more := await reader.read(65536):
                    said += more
        writer.close()

        assert answered["values"] == {"sum": 3}
        assert bytes([0x80 | CLOSE]) in said
        assert turns.longest < TURN


async def test_many_small_requests_are_read_no_faster_than_they_are_handled() -> None:
    async with serving() as stage, stage.rosbridge() as honest:
        _, writer, _ = await opened(stage)
        request = frame(1, True, b'{"op":"set_level","level":"none"}')
        async with turns_measured() as turns:
            writer.write(request * FRAMES)
            for _ in range(20):
                assert (await honest.call("/add", {"a": 1, "b": 2}))["values"] == {"sum": 3}
        (flooder,) = (one for one in stage.server.clients if one.received > 100)
        assert flooder.received < FRAMES
        assert turns.longest < TURN
        writer.transport.abort()


async def test_a_message_that_comes_in_many_pieces_is_the_same() -> None:
    async with serving() as stage, stage.rosbridge() as client:
        text = "x" * 3_000_000
        await client.say("subscribe", topic="/chatter", type="std_msgs/String")
        await client.call("/rosapi/get_time")
        await client.say("publish", topic="/chatter", msg={"data": "before"})
        await client.say("publish", topic="/chatter", msg={"data": text})
        await client.say("publish", topic="/chatter", msg={"data": "after"})
        assert [(await client.find("publish"))["msg"]["data"] for _ in range(3)] == ["before", text, "after"]


async def test_while_a_large_message_is_read_others_are_answered() -> None:
    async with serving() as stage, stage.rosbridge() as client, stage.rosbridge() as honest:
        await client.say("advertise", topic="/path", type="nav_msgs/Path")
        text = json.dumps({"op": "publish", "topic": "/path", "msg": {"poses": [{}] * 90_000}})
        await client.call("/rosapi/get_time")
        async with turns_measured() as turns:
            await client.socket.send(text)
            answers = 0
            while not any(one.name == "/path" and one.messages for one in stage.system.snapshot().topics):
                await honest.call("/add", {"a": 1, "b": 2})
                answers += 1
        assert answers > 3
        assert turns.longest < 0.3, "in one turn, as before, it takes a second"


async def test_a_message_of_too_many_objects_is_refused_before_it_is_read() -> None:
    async with serving() as stage, stage.rosbridge() as client:
        async with turns_measured() as turns:
            await client.socket.send(json.dumps({"op": "publish", "topic": "/p", "msg": {"poses": [{}] * 1_000_000}}))
            said = await client.find("status")
        assert "objects in one text: at most 100000" in said["msg"]
        assert turns.longest < TURN


async def test_a_picture_of_a_text_is_made_beside_the_loop() -> None:
    async with serving() as stage, stage.rosbridge() as client, stage.rosbridge() as honest:
        await client.say("subscribe", topic="/chatter", type="std_msgs/String", compression="png")
        await client.call("/rosapi/get_time")
        text = "".join(map(str, range(300_000)))
        async with turns_measured() as turns:
            await honest.say("publish", topic="/chatter", msg={"data": text})
            await client.find("png")
        assert turns.longest < TURN


async def test_connections_that_ask_for_nothing_lose_their_place_to_a_client_that_comes(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(server, "MOST_CLIENTS", 3)
    monkeypatch.setattr(server, "SILENCE", 0.0)
    monkeypatch.setattr(server, "CLOSING", 0.2)
    async with serving() as stage:
        silent = [await opened(stage) for _ in range(3)]
        await until(lambda: len(stage.server.clients) == 3)
        async with stage.rosbridge() as first, stage.rosbridge() as second:
            for client in (first, second):
                assert (await client.call("/add", {"a": 1, "b": 2}))["values"] == {"sum": 3}
            _, _, head = silent[0]
            assert b"101" in head
            assert await silent[0][0].read()  # a farewell, and the end
        for _, writer, _ in silent:
            writer.close()


async def test_the_servers_own_page_gets_a_place_when_all_others_are_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(server, "MOST_CLIENTS", 1)
    async with serving() as stage, stage.rosbridge() as talking:
        await talking.call("/add", {"a": 1, "b": 2})
        _, refused, head = await opened(stage)
        _, other_page, other = await opened(stage, "Origin: http://localhost:1")
        _, page, own = await opened(stage, f"Origin: http://localhost:{stage.server.port}")
        assert b"503" in head and b"503" in other
        assert b"101" in own
        for writer in (refused, other_page, page):
            writer.close()


NUMBERS = {
    "rosbridge": [
        {"op": "subscribe", "topic": "/chatter", "throttle_rate": 0},
        {"op": "subscribe", "topic": "/chatter", "queue_length": 0},
        {"op": "subscribe", "topic": "/chatter", "fragment_size": 0},
        {"op": "advertise", "topic": "/new", "type": "std_msgs/String", "queue_size": 0},
        {"op": "fragment", "id": "f", "data": "x", "num": 0, "total": 2},
    ],
    "foxglove": [
        {"op": "robactor.readBag", "id": 1, "name": "x", "file": "y", "offset": 0},
        {"op": "fetchAsset", "requestId": 1, "uri": "x"},
        {"op": "subscribe", "subscriptions": [{"id": 1, "channelId": 1}]},
        {"op": "advertise", "channels": [{"id": 1, "topic": "/a", "encoding": "json", "schemaName": "std_msgs/msg/String"}]},
    ],
}  # fmt: skip
"""Requests with a number, of each protocol."""


def spoiled(request: dict[str, Any], number: str) -> str:
    """The request with this text in place of its last number."""
    text = json.dumps(request)
    at = [match.span() for match in re.finditer(r"(?<=: )\d+", text)][-1 if request["op"] != "advertise" else 0]
    return text[: at[0]] + number + text[at[1] :]


@pytest.mark.parametrize("number", ["Infinity", "-Infinity", "NaN", "1e400", "-1", "9" * 400, "1e308"])
@pytest.mark.parametrize("protocol", NUMBERS)
async def test_a_number_that_is_none_of_the_protocol_is_answered_with_the_field_that_it_stands_in(
    protocol: str, number: str
) -> None:
    unheard: list[Any] = []
    asyncio.get_running_loop().set_exception_handler(lambda loop, context: unheard.append(context))
    async with serving() as stage, getattr(stage, protocol)() as client:
        for request in NUMBERS[protocol]:
            await client.socket.send(spoiled(request, number))
            said = await client.find("status")
            why = said["message" if protocol == "foxglove" else "msg"]
            assert "must be a" in why or "no JSON" in why
        assert len(stage.server.clients) == 1
    assert not unheard
