"""Topics of DDS of devices that are no nodes of ROS."""

from __future__ import annotations

import pytest

pytest.importorskip("cyclonedds")

from actors.interfaces.std_msgs.msg import String
from actors.transport.dds import DdsConfig, RawTopics
from actors.transport.dds.format.qos import EndpointQos
from tests.actors.transport.dds.meeting import free_domain
from tests.actors.transport.dds.peers import STRING, until


async def test_messages_cross_and_who_else_writes_is_known() -> None:
    here = DdsConfig(domain=free_domain(), discovery_range="LOCALHOST")
    heard, replies = list[String](), list[String]()
    async with RawTopics(here) as one:
        one.reader("rt/state", String, heard.append, depth=10)
        assert one.writers("rt/state") == 0
        async with RawTopics(here) as other:
            other.reader("rt/answer", String, replies.append, reliable=True)
            writer, answer = other.writer("rt/state", String, depth=10), one.writer("rt/answer", String)
            await until(lambda: writer.matched == 1 and answer.matched == 1 and one.writers("rt/state") == 1)
            assert one.writers("rt/answer") == 0  # its own do not count
            for number in range(5):
                writer.write(String(data=str(number)))
            answer.write(String(data="yes"))
            await until(lambda: len(heard) == 5 and replies)
            assert [message.data for message in heard] == ["0", "1", "2", "3", "4"]
        await until(lambda: one.writers("rt/state") == 0)


async def test_bytes_that_are_no_message_of_the_type_are_dropped_and_counted() -> None:
    here = DdsConfig(domain=free_domain(), discovery_range="LOCALHOST")
    heard: list[String] = []
    async with RawTopics(here) as one, RawTopics(here) as other:
        one.reader("rt/state", String, heard.append, depth=10, reliable=True)
        broken = other._participant.writer("rt/state", STRING, EndpointQos(depth=10))
        await until(lambda: broken.matched == 1)
        broken.put(b"\0\1\0\0\xff\xff\xff\x7fhello")
        broken.put(b"\0\1\0\0\3\0\0\0ok\0\0")
        await until(lambda: heard)
        assert (heard[0].data, one.unreadable) == ("ok", 1)
