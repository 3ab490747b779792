"""Messages in and out as CDR bytes."""

from __future__ import annotations

import pytest

from actors import Node, Topic
from actors.interfaces import CdrError, encode
from actors.interfaces.std_msgs.msg import Int32
from actors.testing import Rig
from tests.stage import NUMBERS, WORDS, number, word

HELLO = bytes.fromhex("00010000 06000000 68656c6c6f00")
"""``data: hello`` as rclpy's serialize_message gives it."""


async def test_bytes_are_published_as_the_message_that_they_hold(rig: Rig) -> None:
    await rig.start(Node)
    words = rig.probe(WORDS)
    publisher = rig.me.publisher(WORDS)
    publisher.publish_serialized(HELLO)
    publisher.publish_serialized(memoryview(HELLO))
    assert list(words) == [word("hello"), word("hello")]
    assert publisher.count == 2


@pytest.mark.parametrize("data", [b"", HELLO[:7], encode(Int32(data=7))[:2]])
async def test_bytes_that_hold_no_such_message_are_refused(rig: Rig, data: bytes) -> None:
    await rig.start(Node)
    publisher = rig.me.publisher(WORDS)
    with pytest.raises(CdrError, match="std_msgs/msg/String"):
        publisher.publish_serialized(data)
    assert publisher.count == 0


async def test_a_stream_gives_the_bytes_of_its_messages(rig: Rig) -> None:
    await rig.start(Node)
    stream = rig.me.subscribe(WORDS)
    rig.publish(WORDS, word("hello"))
    rig.publish(WORDS, word(""))
    data = stream.serialized()
    assert await anext(data) == HELLO
    assert await anext(data) == bytes.fromhex("00010000 01000000 00")
    stream.close()
    assert [one async for one in data] == []


async def test_what_is_forwarded_as_bytes_is_the_same_message(rig: Rig) -> None:
    await rig.start(Node)
    seen = rig.probe(NUMBERS, name="/copy")
    stream, copy = rig.me.subscribe(NUMBERS).serialized(), rig.me.publisher(Topic(Int32, "/copy"))

    async def forward() -> None:
        async for data in stream:
            copy.publish_serialized(data)

    rig.me.create_task(forward())
    await rig.settled()
    rig.publish(NUMBERS, number(-7))
    await rig.settled()
    assert seen.last == number(-7)
