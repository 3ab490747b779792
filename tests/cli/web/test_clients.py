"""What one client may cost the others and the robot."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Iterable
from typing import Any

import numpy as np
import pytest
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed

from actors import Topic
from actors.bag.capture import Capture
from actors.interfaces import encode
from actors.interfaces.sensor_msgs.msg import Image
from actors.interfaces.std_msgs.msg import String
from actors.topics.lazy_message import LazyMessage
from actors.transport.protocol import PATIENCE, next_look
from cli.web.clients.outbox import BEHIND, MOST_ANSWERS, MOST_BYTES, Outbox, OutboxFull, Spliced
from cli.web.clients.writing import written
from tests.cli.web.stage import serving, until

PICTURE = Topic(Image, "/picture")
MEGABYTE = 1024 * 1024


async def drained(outbox: Outbox) -> list[object]:
    found: list[object] = []
    while outbox.waiting:
        found += await outbox.batch()
    return found


async def test_answers_go_first_and_subscriptions_take_turns() -> None:
    outbox = Outbox()
    for lane, frame in (("a", "a1"), ("a", "a2"), ("a", "a3"), ("b", "b1"), ("b", "b2")):
        outbox.offer(lane, frame)
    outbox.answer("answer")
    assert await drained(outbox) == ["answer", "a1", "b1", "a2", "b2", "a3"]


async def test_a_subscription_keeps_the_newest_messages_and_counts_the_others() -> None:
    outbox = Outbox()
    for number in range(5):
        outbox.offer("a", str(number), 2)
    assert outbox.dropped == 3 and await drained(outbox) == ["3", "4"]


async def test_many_clients_that_do_not_read_share_the_memory() -> None:
    outbox = Outbox(lambda: 16)
    for number in range(20):
        outbox.offer("large", bytes([number]) * MEGABYTE)
    assert outbox.waiting_bytes == 4 * MEGABYTE and outbox.dropped == 16
    outbox.answer("an answer")
    outbox.clear()
    assert (outbox.waiting, outbox.waiting_bytes) == (0, 0)


async def test_where_memory_ends_the_largest_subscription_gives_way_and_the_small_one_does_not() -> None:
    outbox = Outbox()
    outbox.offer("small", "x")
    for number in range(20):
        outbox.offer("large", bytes([number]) * (MOST_BYTES // 8))
    assert outbox.waiting_bytes <= MOST_BYTES
    found = await drained(outbox)
    assert found[1] == "x" or found[0] == "x"
    assert [frame[:1] for frame in found if isinstance(frame, bytes)] == [bytes([number]) for number in range(13, 20)]
    assert outbox.waiting_bytes == 0


async def test_messages_wait_for_others_to_be_sent_together_and_answers_do_not_wait() -> None:
    outbox, loop = Outbox(), asyncio.get_running_loop()
    first = asyncio.ensure_future(outbox.batch(1))
    await asyncio.sleep(0)
    due = next_look(loop.time() - BEHIND) + BEHIND
    outbox.offer("a", "1")
    while loop.time() < due - 0.002:
        assert not first.done()
        await asyncio.sleep(0.001)
    outbox.offer("a", "2")
    assert await first == ["1"]
    assert loop.time() >= due - 0.001 and outbox.waiting == 1

    assert await outbox.batch() == ["2"]
    second = asyncio.ensure_future(outbox.batch(1))
    await asyncio.sleep(0)
    outbox.offer("a", "3")
    outbox.answer("answer")
    await asyncio.sleep(0)
    assert second.done() and second.result() == ["answer"]


async def test_a_client_that_wants_the_newest_only_gets_no_other_and_has_lost_nothing() -> None:
    outbox = Outbox()
    outbox.offer("a", "every one")
    for number in range(5):
        outbox.replace("b", str(number))
    assert await drained(outbox) == ["every one", "4"] and outbox.dropped == 0 and outbox.waiting_bytes == 0


async def test_a_newer_message_that_is_larger_takes_no_more_room_than_there_is() -> None:
    outbox = Outbox()
    outbox.offer("all the room", b"x" * (MOST_BYTES - 1))
    outbox.replace("newest", b"1")
    outbox.replace("newest", b"22")
    assert outbox.waiting_bytes <= MOST_BYTES and outbox.dropped == 1
    assert await drained(outbox) == [b"22"] and outbox.waiting_bytes == 0


async def test_one_message_that_is_larger_than_all_room_still_goes() -> None:
    outbox = Outbox()
    outbox.offer("a", b"x" * (MOST_BYTES + 1))
    assert len(await drained(outbox)) == 1


async def test_a_batch_ends_with_the_message_that_fills_it_and_the_rest_waits_for_the_next() -> None:
    outbox = Outbox()
    for number in range(5):
        outbox.offer("a", bytes([number]) * 40)
    outbox.offer("a", Spliced(b"head", b"x" * 100))
    assert [frame[0] for frame in await outbox.batch(100) if isinstance(frame, bytes)] == [0, 1, 2]
    assert (outbox.sent, outbox.sent_bytes, outbox.waiting, outbox.waiting_bytes) == (3, 120, 3, 184)
    assert len(await outbox.batch(100)) == 3
    assert (outbox.sent, outbox.sent_bytes, outbox.waiting_bytes) == (6, 304, 0)


async def test_frames_that_belong_together_are_dropped_together() -> None:
    outbox = Outbox()
    for number in range(3):
        outbox.offer("a", (f"{number}a", f"{number}b"), 1)
    assert await drained(outbox) == [("2a", "2b")]


def test_answers_that_nobody_reads_end_somewhere() -> None:
    outbox = Outbox()
    for _ in range(MOST_ANSWERS):
        outbox.answer("x")
    with pytest.raises(OutboxFull):
        outbox.answer("x")


async def test_what_waits_for_a_subscription_that_has_ended_is_dropped() -> None:
    outbox = Outbox()
    outbox.offer("a", "1")
    outbox.offer("b", "2")
    outbox.forget("a")
    assert await drained(outbox) == ["2"] and outbox.waiting_bytes == 0


async def test_a_client_that_never_reads_loses_its_messages_and_nobody_else_does() -> None:
    async with serving() as stage:
        out = stage.talker.publisher(PICTURE)
        async with stage.foxglove() as reader, stage.foxglove() as sleeper:
            for client in (reader, sleeper):
                channel = await client.channel("/picture")
                await client.say("subscribe", subscriptions=[{"id": 1, "channelId": channel["id"]}])
                await client.say("getParameters", parameterNames=["/talker.speed"], id="subscribed")
                await client.find("parameterValues", id="subscribed")
            sleeper.socket.transport.pause_reading()  # type: ignore[attr-defined]
            for number in range(60):
                out(Image(width=number, data=np.zeros(1024 * 1024, np.uint8)))
                assert len(await reader.binary()) > 1024 * 1024
            asleep = max(stage.server.clients, key=lambda one: one.outbox.dropped)
            awake = min(stage.server.clients, key=lambda one: one.outbox.dropped)
            assert asleep.outbox.dropped > 20 and asleep.outbox.waiting_bytes <= MOST_BYTES
            assert awake.outbox.dropped == 0
            sleeper.socket.transport.abort()


async def test_the_memory_of_a_client_that_has_left_is_given_back(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cli.web.server.server.AFTERWARDS", 0.01)
    given = asyncio.Event()
    loop = asyncio.get_running_loop()
    monkeypatch.setattr("cli.web.server.server.give_back", lambda: loop.call_soon_threadsafe(given.set))
    async with serving() as stage:
        async with stage.foxglove() as sleeper:
            await sleeper.say("getParameters", parameterNames=["/talker.speed"], id="subscribed")
            await sleeper.find("parameterValues", id="subscribed")
            (client,) = stage.server.clients
            client.outbox.offer("unsent", b"x" * MEGABYTE)
            sleeper.socket.transport.abort()
        await asyncio.wait_for(given.wait(), 20.0)
        assert client.outbox.waiting == 0


async def test_what_gathers_is_one_write_for_each_client_and_the_messages_are_shared(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    writes: list[list[Spliced]] = []

    def spy(frames: Iterable[Any]) -> bytes:
        listed = list(frames)
        if all(isinstance(frame, Spliced) for frame in listed):
            writes.append(listed)
        return written(listed)

    monkeypatch.setattr("cli.web.clients.client.written", spy)
    async with serving() as stage, stage.foxglove() as first, stage.foxglove() as second:
        for client in (first, second):
            channel = await client.channel("/chatter")
            await client.say("subscribe", subscriptions=[{"id": 1, "channelId": channel["id"]}])
            await client.say("getParameters", parameterNames=["/talker.speed"], id="subscribed")
            await client.find("parameterValues", id="subscribed")
        for number in range(5):
            stage.talker.chatter(String(data=str(number)))
        for client in (first, second):
            assert [(await client.binary())[-2:-1].decode() for _ in range(5)] == ["0", "1", "2", "3", "4"]
    one, other = writes
    assert [frame.payload for frame in one] == [frame.payload for frame in other] and len(one) == 5
    assert all(mine.payload is theirs.payload for mine, theirs in zip(one, other, strict=True))


@pytest.mark.parametrize("garbage", ["garbage", '{"op": "' + 90 * "\N{SNOWMAN}" + '"}'], ids=["text", "wide letters"])
async def test_a_client_that_sends_nothing_but_garbage_is_shown_the_door(garbage: str) -> None:
    async with serving() as stage:
        for opened in (stage.foxglove, stage.rosbridge):
            async with opened() as client:
                with pytest.raises(ConnectionClosed) as closed:
                    for _ in range(200):
                        await client.socket.send(garbage)
                    while True:
                        await client.next()
                assert closed.value.rcvd is not None and closed.value.rcvd.code == 1008
                assert "none of the protocol" in closed.value.rcvd.reason


@pytest.mark.parametrize(
    "frame",
    ["", "7", "[]", '{"op": 5}', '{"op": "dance"}', '{"no": "op"}', "[" * 100_000, '{"op": NaN}', "\0", b"", b"\x01", b"\x02\0\0\0", b"\xff" * 30],
    ids=repr,
)  # fmt: skip
async def test_a_malformed_frame_is_answered_and_the_connection_goes_on(frame: str | bytes) -> None:
    async with serving() as stage:
        async with stage.foxglove() as viewer, stage.rosbridge() as bridge:
            for client in (viewer, bridge):
                await client.socket.send(frame)
                status = await client.find("status")
                assert status["level"] in (2, "error") and (status.get("message") or status.get("msg"))
            assert (await bridge.call("/add", {"a": 1, "b": 1}))["values"] == {"sum": 2}


async def test_a_frame_that_is_too_large_ends_the_connection_with_its_code() -> None:
    async with serving() as stage:
        socket = await connect(stage.url)
        with pytest.raises(ConnectionClosed) as closed:
            await socket.send("x" * (5 * 1024 * 1024))
            await socket.recv()
        assert closed.value.rcvd is not None and closed.value.rcvd.code == 1009
        await socket.wait_closed()


async def test_too_many_requests_at_once_are_refused_and_the_others_answered() -> None:
    async with serving() as stage, stage.rosbridge() as client:
        for number in range(300):
            await client.say(
                "send_action_goal",
                id=str(number),
                action="/nowhere",
                action_type="example_interfaces/Fibonacci",
                timeout=5,
            )
        assert "256 requests" in (await client.find("status"))["msg"]
        client.socket.transport.abort()


async def test_more_clients_than_there_is_room_for_are_told_so() -> None:
    async with serving() as stage:
        sockets = [await asyncio.open_connection("127.0.0.1", stage.server.port) for _ in range(64)]
        lines = (
            f"GET / HTTP/1.1\r\nHost: localhost:{stage.server.port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Version: 13\r\n\r\n"
        )
        for _, writer in sockets:
            writer.write(lines.encode())
        await until(lambda: len(stage.server.clients) == 64)
        reader, writer = await asyncio.open_connection("127.0.0.1", stage.server.port)
        writer.write(lines.encode())
        assert b"503" in await reader.readline()
        for one in (writer, *(writer for _, writer in sockets)):
            one.close()


async def test_messages_reach_every_client_of_a_topic_and_are_encoded_once() -> None:
    async with serving() as stage:
        async with stage.rosbridge() as first, stage.rosbridge() as second:
            for client in (first, second):
                await client.say("subscribe", topic="/chatter")
                await client.call("/rosapi/get_time")
            entry = stage.system.graph.topics["/chatter"]
            assert len(entry.subscriptions) == 1  # the server's own, for both
            stage.talker.chatter(String(data="all"))
            for client in (first, second):
                assert json.dumps((await client.find("publish"))["msg"]) == '{"data": "all"}'


async def test_what_is_no_message_reaches_those_who_take_cdr_and_the_others_lose_it() -> None:
    garbage, good = b"\0\1\0\0", encode(String(data="good"))
    async with serving() as stage, stage.rosbridge() as reader, stage.foxglove() as viewer:
        await reader.say("subscribe", topic="/chatter")
        await reader.call("/rosapi/get_time")
        channel = await viewer.channel("/chatter")
        await viewer.say("subscribe", subscriptions=[{"id": 1, "channelId": channel["id"]}])
        await viewer.say("getParameters", parameterNames=[], id="done")
        await viewer.find("parameterValues", id="done")
        entry = stage.system.graph.topics["/chatter"]
        (capture,) = entry.subscriptions
        assert isinstance(capture, Capture)
        for payload in (garbage, garbage, good):  # as they come from another process
            capture.take(capture.channel, entry.publishers[0], LazyMessage.received(payload, String, 0))

        assert (await reader.find("publish"))["msg"] == {"data": "good"}
        assert [(await viewer.binary())[13:] for _ in range(3)] == [garbage, garbage, good]
        assert {one.protocol: one.outbox.dropped for one in stage.server.clients} == {"rosbridge": 2, "foxglove": 0}


async def test_a_message_that_has_waited_for_others_has_the_time_of_its_arrival() -> None:
    async with serving() as stage, stage.foxglove() as viewer:
        channel = await viewer.channel("/chatter")
        await viewer.say("subscribe", subscriptions=[{"id": 1, "channelId": channel["id"]}])
        await viewer.say("getParameters", parameterNames=[], id="done")
        await viewer.find("parameterValues", id="done")
        entry, clock = stage.system.graph.topics["/chatter"], stage.system.clock
        (capture,) = entry.subscriptions
        assert isinstance(capture, Capture) and capture.patience == PATIENCE
        since = asyncio.get_running_loop().time() - 0.25
        arrival = LazyMessage.received(encode(String(data="old")), String, 0, since)
        capture.take(capture.channel, entry.publishers[0], arrival)

        at_ns = int.from_bytes((await viewer.binary())[5:13], "little")
        assert at_ns == clock.wall_ns_at(since - clock.origin)


async def test_a_text_that_no_wire_can_carry_is_lost_by_those_who_take_cdr() -> None:
    async with serving() as stage, stage.foxglove() as viewer:
        channel = await viewer.channel("/chatter")
        await viewer.say("subscribe", subscriptions=[{"id": 1, "channelId": channel["id"]}])
        await viewer.say("getParameters", parameterNames=[], id="done")
        await viewer.find("parameterValues", id="done")
        for text in ("\ud800", "good"):
            stage.talker.chatter(String(data=text))

        assert (await viewer.binary())[13:] == encode(String(data="good"))
        assert [one.outbox.dropped for one in stage.server.clients] == [1]
