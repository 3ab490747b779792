"""Who is where: names, matches, mismatches and changes."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

from actors import QoS, qos
from actors.checks import create
from actors.graph.graph import Graph
from actors.interfaces.std_msgs.msg import Int32
from actors.topics.publisher import Publisher
from actors.topics.stream import StreamSubscription
from tests.actors.topics.test_delivery import Someone
from tests.stage import number, values

pytestmark = pytest.mark.virtual

LATCHED = qos.LATCHED


def graph() -> Graph:
    return Graph(asyncio.get_running_loop().time)


async def test_names_are_made_at_their_first_use_and_stay() -> None:
    ours = graph()
    assert ours.topic("/a") is ours.topic("/a")
    assert ours.service("/b") is ours.service("/b")
    assert ours.action("/c") is ours.action("/c")
    assert repr(ours) == "<graph of 1 topics, 1 services, 1 actions>"
    assert repr(ours.topic("/a")) == "<topic /a: 0 publishers, 0 subscriptions>"


async def test_every_change_is_counted_and_told_until_the_listener_leaves() -> None:
    ours = graph()
    heard: list[int] = []
    leave = ours.on_change(lambda: heard.append(ours.version))
    entry = ours.topic("/a")
    out = create(Publisher, Someone(), entry, Int32, qos.DEFAULT)
    queue = StreamSubscription(Someone(), entry, Int32, qos.DEFAULT)
    entry.add_publisher(out)
    entry.add_subscription(queue)
    entry.remove_subscription(queue)
    entry.remove_subscription(queue)
    entry.remove_publisher(out)
    assert heard == [1, 2, 3, 4]
    leave()
    leave()
    entry.add_publisher(out)
    assert len(heard) == 4


async def test_a_listener_may_leave_while_it_is_told() -> None:
    ours = graph()
    heard: list[str] = []

    def first() -> None:
        heard.append("first")
        leave_first()

    leave_first = ours.on_change(first)
    ours.on_change(lambda: heard.append("second"))
    ours.changed()
    ours.changed()
    assert heard == ["first", "second", "second"]


async def test_a_topic_knows_since_when_and_how_much() -> None:
    ours = graph()
    entry = ours.topic("/a")
    assert entry.opened is None
    await asyncio.sleep(2.0)
    out, other = (create(Publisher, Someone(), entry, Int32, qos.DEFAULT) for _ in range(2))
    entry.add_publisher(out)
    await asyncio.sleep(1.0)
    entry.add_publisher(other)
    assert entry.opened == 2.0
    out(number(1))
    other(number(2))
    entry.remove_publisher(out)
    assert entry.message_count == 2


WEAK = {
    "RELIABILITY": (qos.SENSOR_DATA, qos.DEFAULT),
    "DURABILITY": (qos.DEFAULT, LATCHED),
    "DEADLINE": (qos.DEFAULT, QoS(depth=1, deadline=0.1)),
    "LIVELINESS": (QoS(depth=1, liveliness_lease=2.0), QoS(depth=1, liveliness_lease=1.0)),
}


REMEDIES = {
    "RELIABILITY": "let the publisher offer reliability=reliable, or the subscription request reliability=best_effort",
    "DURABILITY": "let the publisher offer durability=transient_local, or the subscription request durability=volatile",
    "DEADLINE": "let the publisher offer deadline=0.1, or the subscription request deadline=None",
    "LIVELINESS": "let the publisher offer liveliness_lease=1, or the subscription request liveliness_lease=2",
}


@pytest.mark.parametrize("policy", WEAK)
@pytest.mark.parametrize("publisher_first", [True, False])
async def test_each_policy_that_keeps_a_pair_apart_is_named_once_on_both_sides(
    policy: str, publisher_first: bool
) -> None:
    offered, requested = WEAK[policy]
    ours, talker, listener = graph(), Someone("/talker"), Someone("/listener")
    entry = ours.topic("/a")
    for _ in range(2):
        out, queue = (
            create(Publisher, talker, entry, Int32, offered),
            StreamSubscription(listener, entry, Int32, requested),
        )
        if publisher_first:
            entry.add_publisher(out)
            entry.add_subscription(queue)
        else:
            entry.add_subscription(queue)
            entry.add_publisher(out)
    assert out.subscription_count == 0
    assert out.peers == ()
    ((theirs, their_fields),), ((mine, my_fields),) = talker.warnings, listener.warnings
    assert theirs == (
        "New subscription discovered on topic '/a', requesting incompatible QoS. No messages will be sent to it. "
        f"Last incompatible policy: {policy}"
    )
    assert mine == (
        "New publisher discovered on topic '/a', offering incompatible QoS. No messages will be received from it. "
        f"Last incompatible policy: {policy}"
    )
    assert (their_fields["subscriber"], my_fields["publisher"]) == ("/listener", "/talker")
    assert their_fields["why"] == my_fields["why"]
    assert their_fields["remedy"] == my_fields["remedy"] == REMEDIES[policy]
    assert (their_fields["offered"], my_fields["requested"]) == (repr(offered), repr(requested))
    assert list(entry.mismatches) == [("/talker", "/listener", "qos")]


async def test_a_mismatch_is_known_until_the_last_endpoint_of_a_node_has_gone() -> None:
    offered, requested = WEAK["RELIABILITY"]
    ours, talker, listener = graph(), Someone("/talker"), Someone("/listener")
    entry = ours.topic("/a")
    entry.add_publisher(create(Publisher, talker, entry, Int32, offered))
    queues = [StreamSubscription(listener, entry, Int32, requested) for _ in range(2)]
    for queue in queues:
        entry.add_subscription(queue)
    for queue, left in zip(queues, (1, 0), strict=True):
        entry.remove_subscription(queue)
        entry.forget("/listener")
        assert len(entry.mismatches) == left
    assert len(listener.warnings) == 1


async def test_what_was_latched_comes_to_a_matching_subscription_only_and_as_much_as_it_holds() -> None:
    entry = graph().topic("/a")
    out = create(Publisher, Someone(), entry, Int32, LATCHED.replace(depth=5))
    entry.add_publisher(out)
    for value in range(10):
        out(number(value))
    deep, shallow, late = (
        StreamSubscription(Someone(), entry, Int32, LATCHED.replace(depth=depth)) for depth in (9, 2, 9)
    )
    strict = StreamSubscription(Someone(), entry, Int32, LATCHED.replace(depth=9, deadline=0.1))
    for queue in (deep, shallow, strict):
        entry.add_subscription(queue)
    out.close()
    entry.add_subscription(late)
    assert values(deep.messages) == [5, 6, 7, 8, 9]
    assert (values(shallow.messages), shallow.dropped) == ([8, 9], 0)
    assert values(strict.messages) == values(late.messages) == []


class Server:
    """Stands for a server; the entry does not look into it."""


async def test_a_server_comes_pauses_and_goes_and_who_waits_is_told() -> None:
    entry: Any = graph().service("/b")
    server = Server()
    waiting = [asyncio.create_task(entry.available()) for _ in range(3)]
    await asyncio.sleep(0)
    waiting[0].cancel()
    await asyncio.sleep(0)
    assert entry.waiters is not None and len(entry.waiters) == 2
    waiting[1].cancel()
    entry.open(server)  # in the very moment of the cancellation
    await asyncio.wait(waiting)
    assert [task.cancelled() for task in waiting] == [True, True, False]
    await entry.available()
    entry.pause("/b_server", 3)
    assert (entry.server, entry.restarting, entry.stopped) == (None, ("/b_server", 3), None)
    entry.open(server)
    assert (entry.server, entry.restarting, entry.stopped) == (server, None, None)
    entry.close("/b_server")
    assert (entry.server, entry.restarting, entry.stopped) == (None, None, "/b_server")


async def test_who_waits_waits_on_when_the_server_left_in_the_same_moment() -> None:
    entry: Any = graph().action("/c")
    waiting = asyncio.create_task(entry.available())
    await asyncio.sleep(0)
    entry.open(Server())
    entry.pause("/c_server", 1)
    await asyncio.sleep(1.0)
    assert not waiting.done()
    entry.open(Server())
    await waiting
