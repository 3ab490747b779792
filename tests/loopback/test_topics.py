"""Topics by way of bytes: that they are, and every scenario of topics once more."""

from __future__ import annotations

from typing import Any

from actors import Child, Node, QoS, Topic, publishes, qos, subscribes
from actors.interfaces.std_msgs.msg import Int32
from actors.testing import Rig
from tests.actors.graph import test_graph_views
from tests.actors.lifecycle import test_lifecycle_nodes
from tests.actors.node import test_nodes, test_standard_services
from tests.actors.runtime import test_load_of_systems
from tests.actors.supervision import test_restarts
from tests.actors.time import test_sim_time
from tests.actors.topics import test_latched_restarts, test_qos_events, test_topics
from tests.loopback import borrowed
from tests.loopback.topics import LoopbackTopic, RemotePublisher, RemoteSubscription
from tests.robot.tutorials import test_topics as test_tutorial_topics
from tests.stage import NUMBERS, WORDS, events, number, word

LATCHED = Topic(Int32, "latched", qos.LATCHED.replace(depth=3))


class Talker(Node):
    out = publishes(NUMBERS)


class Listener(Node):
    numbers = subscribes(NUMBERS)


def stand_in_of(rig: Rig, topic: str, publisher: Any) -> RemotePublisher:
    entry = rig.system.graph.topics[topic]
    assert isinstance(entry, LoopbackTopic)
    stand_in = entry.there[publisher]
    assert isinstance(stand_in, RemotePublisher)
    return stand_in


async def test_a_message_crosses_once_as_bytes_however_many_subscriptions_there_are(rig: Rig) -> None:
    await rig.start(Talker, *(Child(Listener, name=f"listener_{index}") for index in range(3)))
    out, sent = rig.node(Talker).out, number(7)
    out(sent)
    assert out.subscription_count == 3
    assert [type(peer) for peer in out.peers] == [RemoteSubscription] * 3
    assert len(out.targets) == 1
    received = [await rig.node(f"listener_{index}").numbers.next() for index in range(3)]  # type: ignore[attr-defined]
    assert received == [sent] * 3
    assert all(message is not sent for message in received)
    assert stand_in_of(rig, "/numbers", out).packets == 1


async def test_without_subscriptions_nothing_crosses(rig: Rig) -> None:
    await rig.start(Talker)
    out = rig.node(Talker).out
    out(number(1))
    assert stand_in_of(rig, "/numbers", out).packets == 0


async def test_a_text_that_no_wire_can_carry_is_lost_and_its_publisher_warns(rig: Rig) -> None:
    await rig.start(Node)
    out, stream = rig.me.publisher(WORDS), rig.me.subscribe(WORDS)
    out(word("\udc00"))
    out(word("after it"))
    assert await stream.next() == word("after it")
    (line,) = events(rig.logs, "a message cannot be encoded")
    assert (line.node, line.fields["topic"]) == ("/rig", "/words")
    assert "String.data" in str(line.fields["error"])


async def test_a_late_joiner_gets_what_is_latched_by_asking_for_it(rig: Rig) -> None:
    await rig.start(Node)
    out = rig.me.publisher(LATCHED)
    for value in range(5):
        out(number(value))
    late = rig.me.subscribe(LATCHED)
    assert [(await late.next()).data for _ in range(3)] == [2, 3, 4]
    assert stand_in_of(rig, "/latched", out).packets == 0


async def test_what_has_expired_on_its_way_is_not_delivered(rig: Rig) -> None:
    brief = Topic(Int32, "brief", QoS(depth=10, lifespan=1.0))
    await rig.start(Node)
    out, stream = rig.me.publisher(brief), rig.me.subscribe(brief, qos=10)
    out(number(1))
    await rig.advance(0.9)
    out(number(2))
    await rig.advance(0.5)
    assert (await stream.next()).data == 2


async def test_a_tap_at_the_far_side_takes_what_arrives(rig: Rig) -> None:
    await rig.start(Talker, Listener)
    seen: list[Any] = []
    rig.system.graph.topic("/numbers").far.graph.tap(lambda publisher: seen.append)  # type: ignore[attr-defined]
    rig.node(Talker).out(number(3))
    assert seen == [number(3)]


LOCAL = {
    "test_ten_seconds_of_images_all_of_them_seen": "it counts copies: within a process there is none, and over a wire one for each image",
}
"""Scenario tests that say something about one process only, and why."""

for module in (
    test_topics,
    test_qos_events,
    test_latched_restarts,
    test_tutorial_topics,
    test_restarts,
    test_standard_services,
    test_lifecycle_nodes,
    test_load_of_systems,
    test_sim_time,
    test_nodes,
    test_graph_views,
):
    tests = borrowed(module, but={name: why for name, why in LOCAL.items() if hasattr(module, name)})
    assert not tests.keys() & globals().keys()
    globals().update(tests)
