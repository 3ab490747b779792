"""A restarted node is a late joiner: what is latched on its topics comes again, for its new incarnation knows nothing of it."""

from __future__ import annotations

import asyncio

from actors import Node, QoS, Topic, open_node, publishes, qos
from actors.interfaces.std_msgs.msg import Int32
from actors.qos import Durability
from actors.testing import Rig
from tests.stage import number, values

CONFIG = Topic(Int32, "config", qos.STATE)
NEWEST = Topic(Int32, "newest", QoS(depth=3, durability=Durability.TRANSIENT_LOCAL))
STREAM = Topic(Int32, "stream", 10)


class Source(Node):
    """Says its one word before anybody listens."""

    out = publishes(CONFIG)

    async def on_start(self) -> None:
        self.out(number(7))


class Reader(Node):
    """Remembers what this incarnation has heard; a negative number is too much for it."""

    def __init__(self) -> None:
        self.heard: list[Int32] = []

    @CONFIG.on()
    async def config(self, message: Int32) -> None:
        self.heard.append(message)

    @NEWEST.on()
    async def newest(self, message: Int32) -> None:
        self.heard.append(message)

    @STREAM.on()
    async def stream(self, message: Int32) -> None:
        if message.data < 0:
            raise ValueError("negative")
        self.heard.append(message)


class Crowd(Node):
    """The same with two tasks at once."""

    def __init__(self) -> None:
        self.heard: list[Int32] = []

    @NEWEST.on(concurrent=2)
    async def newest(self, message: Int32) -> None:
        await asyncio.sleep(0.1)
        self.heard.append(message)

    @STREAM.on()
    async def stream(self, message: Int32) -> None:
        raise ValueError("negative")


async def test_a_restarted_node_gets_the_latched_state_again_and_no_volatile_message_twice(rig: Rig) -> None:
    rig.expect_failure(ValueError)
    await rig.start(Reader)
    rig.publish(CONFIG, number(7))
    for value in (1, 2, -1):
        rig.publish(STREAM, number(value))
    await rig.settled()
    assert rig.state(Reader).incarnation == 2
    assert values(rig.node(Reader).heard) == [7]


async def test_what_waited_for_the_new_incarnation_comes_once_after_what_is_older(rig: Rig) -> None:
    rig.expect_failure(ValueError)
    await rig.start(Reader)
    for value in (1, 2, 3):
        rig.publish(NEWEST, number(value))
    await rig.settled()
    rig.publish(STREAM, number(-1))
    rig.publish(NEWEST, number(4))  # waits behind the crash
    await rig.settled()
    assert values(rig.node(Reader).heard) == [2, 3, 4]


async def test_a_queue_that_is_full_has_no_room_for_older_ones(rig: Rig) -> None:
    rig.expect_failure(ValueError)
    await rig.start(Reader)
    rig.publish(NEWEST, number(1))
    await rig.settled()
    rig.publish(STREAM, number(-1))
    for value in (2, 3, 4):
        rig.publish(NEWEST, number(value))
    await rig.settled()
    assert values(rig.node(Reader).heard) == [2, 3, 4]


async def test_in_its_first_life_a_node_gets_it_once(rig: Rig) -> None:
    await rig.start(Source, Reader)
    await rig.settled()
    assert values(rig.node(Reader).heard) == [7]


async def test_concurrent_handlers_begin_with_what_is_latched_too(rig: Rig) -> None:
    rig.expect_failure(ValueError)
    await rig.start(Crowd)
    for value in (1, 2, 3):
        rig.publish(NEWEST, number(value))
    await rig.advance(1.0)
    rig.publish(STREAM, number(-1))
    await rig.advance(1.0)
    assert rig.state(Crowd).incarnation == 2
    assert sorted(values(rig.node(Crowd).heard)) == [1, 2, 3]


async def test_of_a_publisher_that_has_left_nothing_is_latched(rig: Rig) -> None:
    rig.expect_failure(ValueError)
    await rig.start(Reader)
    async with open_node("other", system=rig.system) as other:
        other.publisher(CONFIG).publish(number(7))
        await rig.settled()
    rig.publish(STREAM, number(-1))
    await rig.settled()
    assert values(rig.node(Reader).heard) == []
