"""Promises about time: lifespans, deadlines and leases, on a bare graph."""

from __future__ import annotations

import asyncio
import threading
from typing import Any

import pytest

from actors import QoS, qos
from actors.checks import create
from actors.errors import CallTimeout, Ended, WrongThread, WrongType
from actors.inbox.expiring import ExpiringMessage
from actors.inbox.inbox import Inbox
from actors.interfaces.std_msgs.msg import Int32
from actors.qos.events import LivelinessChanged, LivelinessLost
from actors.qos.policies import Durability, History, Liveliness
from actors.topics.handler import ConcurrentSubscription, HandlerSubscription
from actors.topics.publisher import Publisher
from actors.topics.stream import Stream
from actors.topics.timed_publisher import TimedPublisher, publisher_for
from tests.actors.topics.test_delivery import ME, subscription, topic
from tests.actors.topics.test_endpoint import timed
from tests.stage import number, values, word

pytestmark = pytest.mark.virtual

SHORT = QoS(depth=10, lifespan=1.0)
KEEP_2 = QoS(history=History.KEEP_ALL, limit=2)
MANUAL = QoS(depth=10, liveliness=Liveliness.MANUAL_BY_TOPIC, liveliness_lease=1.0)


@pytest.mark.parametrize(
    ("policy", "kind"),
    [
        (qos.DEFAULT, Publisher),
        (qos.DEFAULT.replace(liveliness_lease=1.0), Publisher),
        (qos.DEFAULT.replace(liveliness=Liveliness.MANUAL_BY_TOPIC), Publisher),
        (SHORT, TimedPublisher),
        (qos.DEFAULT.replace(deadline=1.0), TimedPublisher),
        (MANUAL, TimedPublisher),
    ],
)
async def test_only_a_publisher_with_a_promise_about_time_looks_at_the_clock(policy: QoS, kind: type[Any]) -> None:
    assert type(publisher_for(ME, topic(), Int32, policy)) is kind


async def test_a_timed_publisher_refuses_what_every_publisher_refuses() -> None:
    out = timed(topic(), SHORT)
    with pytest.raises(WrongType):
        out(word("x"))  # type: ignore[arg-type]
    out.suspend()
    out(number(1))
    out.assert_liveliness()
    assert out.count == 0
    out.resume()
    out(number(1))
    assert out.count == 1
    out.close()
    with pytest.raises(Ended):
        out(number(2))
    with pytest.raises(Ended):
        out.assert_liveliness()
    refused: list[BaseException] = []

    def foreign() -> None:
        try:
            out.assert_liveliness()
        except WrongThread as error:
            refused.append(error)

    thread = threading.Thread(target=foreign)
    thread.start()
    thread.join()
    assert len(refused) == 1


# -- lifespan ---------------------------------------------------------------------------------------------------------------


async def test_a_message_that_has_waited_longer_than_its_lifespan_is_not_delivered() -> None:
    entry = topic()
    out, stream = timed(entry, SHORT), create(Stream, subscription(entry))
    out(number(1))
    await asyncio.sleep(0.5)
    out(number(2))
    await asyncio.sleep(0.5)
    assert (await stream.next()).data == 1  # exactly as old as it may be
    await asyncio.sleep(0.51)
    assert stream.latest is None
    with pytest.raises(CallTimeout):
        await stream.next(timeout=1.0)
    out(number(3))
    assert stream.latest == number(3)
    assert (await stream.next()).data == 3
    assert (stream.received, stream.dropped) == (3, 0)


async def test_messages_with_and_without_a_lifespan_share_a_queue() -> None:
    entry = topic()
    short, long, stream = timed(entry, SHORT), timed(entry, qos.DEFAULT), create(Stream, subscription(entry))
    short(number(1))
    long(number(2))
    await asyncio.sleep(2.0)
    short(number(3))
    assert [(await stream.next()).data for _ in range(2)] == [2, 3]


async def test_the_same_message_published_twice_has_two_ages() -> None:
    entry = topic()
    out, stream = timed(entry, SHORT), create(Stream, subscription(entry))
    message = number(1)
    out(message)
    await asyncio.sleep(0.9)
    out(message)
    await asyncio.sleep(0.9)
    assert await stream.next() is message
    with pytest.raises(CallTimeout):
        await stream.next(timeout=0.0)


@pytest.mark.parametrize("concurrent", [0, 1])
async def test_a_handler_does_not_see_what_has_become_too_old_in_its_queue(concurrent: int) -> None:
    entry = topic()
    out, inbox = timed(entry, SHORT), Inbox(asyncio.get_running_loop())
    seen: list[int] = []

    async def slow(message: Int32) -> None:
        seen.append(message.data)
        await asyncio.sleep(0.6)

    feed: HandlerSubscription[Int32]
    if concurrent:
        feed = ConcurrentSubscription(ME, entry, Int32, qos.DEFAULT, inbox, "Node.take", slow, concurrent)
        feed.start(asyncio.create_task)
    else:
        feed = HandlerSubscription(ME, entry, Int32, qos.DEFAULT, inbox, "Node.take", slow)
    entry.add_subscription(feed)
    task = asyncio.create_task(inbox.serve())
    for value in range(5):
        out(number(value))
    await asyncio.sleep(5.0)
    out(number(5))
    await asyncio.sleep(1.0)
    assert seen == [0, 1, 5]
    task.cancel()
    await asyncio.wait([task])


async def test_a_late_joiner_gets_no_latched_message_that_is_too_old_nor_longer_than_it_lives() -> None:
    entry = topic()
    latched = SHORT.replace(durability=Durability.TRANSIENT_LOCAL)
    out = timed(entry, latched)
    for value in range(5):
        out(number(value))
        await asyncio.sleep(0.3)
    assert values(out.latched) == [2, 3, 4]
    late, shallow = create(Stream, subscription(entry, latched)), subscription(entry, latched.replace(depth=2))
    await asyncio.sleep(0.2)
    assert (await late.next()).data == 3
    assert [message.message.data for message in shallow.messages] == [3, 4]  # type: ignore[attr-defined]
    await asyncio.sleep(9.0)
    assert subscription(entry, latched).received == 0
    assert repr(shallow.messages[0]) == "<std_msgs.msg.Int32(data=3) until 1.900000>"


async def test_a_latched_publisher_with_a_deadline_replays_as_every_other() -> None:
    entry = topic()
    latched = QoS(depth=2, durability=Durability.TRANSIENT_LOCAL, deadline=1.0)
    out = timed(entry, latched)
    for value in range(3):
        out(number(value))
    assert values(out.latched) == values(subscription(entry, latched).messages) == [1, 2]


@pytest.mark.parametrize("policy", [SHORT, qos.DEFAULT])
async def test_what_a_tap_sees_is_the_message_itself(policy: QoS) -> None:
    entry = topic()
    out = timed(entry, policy)
    seen: list[Any] = []
    entry.graph.tap(lambda publisher: seen.append)
    later = timed(entry, policy)
    queue = subscription(entry)
    out(number(1))
    queue.close()
    out(number(2))
    later(number(3))
    assert seen == [number(1), number(2), number(3)]
    assert (queue.received, out.subscription_count) == (1, 0)


async def test_an_expired_message_makes_place_and_is_not_counted_as_lost() -> None:
    entry = topic()
    out = timed(entry, SHORT)
    last, everything = subscription(entry, QoS(depth=2)), subscription(entry, KEEP_2)
    for value in range(3):
        out(number(value))
    assert (last.dropped, everything.dropped) == (1, 1)
    await asyncio.sleep(1.5)
    for value in range(3, 5):
        out(number(value))
    assert (last.dropped, everything.dropped) == (1, 1)
    for queue in (last, everything):
        assert [(await create(Stream, queue).next()).data for _ in range(1)] == [3]


async def test_a_sender_goes_on_when_the_oldest_message_expires() -> None:
    loop = asyncio.get_running_loop()
    entry = topic()
    out, queue = timed(entry, SHORT), subscription(entry, KEEP_2)
    for value in range(2):
        await out.send(number(value))
    await out.send(number(2))
    assert loop.time() == pytest.approx(1.0, abs=2e-9)
    await out.send(number(3))
    blocked = asyncio.create_task(out.send(number(4)))
    await asyncio.sleep(0.5)
    stream = create(Stream, queue)
    assert (await stream.next()).data == 2  # room before anything expires
    await blocked
    assert loop.time() == pytest.approx(1.5, abs=2e-9)
    assert (queue.dropped, (await stream.next()).data) == (0, 3)


async def test_best_effort_holds_no_sender_back() -> None:
    entry = topic()
    with pytest.warns(UserWarning, match="KEEP_ALL with best_effort still drops"):
        loose = KEEP_2.replace(reliability=qos.Reliability.BEST_EFFORT)
    out, queue = timed(entry, qos.DEFAULT), subscription(entry, loose)
    weak = timed(entry, qos.SENSOR_DATA)
    for value in range(3):
        await out.send(number(value))
        await weak.send(number(value))
    assert (values(queue.messages), queue.dropped) == ([0, 0], 4)


async def test_a_latched_keep_all_publisher_keeps_no_more_than_its_limit() -> None:
    entry = topic()
    latched = KEEP_2.replace(durability=Durability.TRANSIENT_LOCAL)
    out = timed(entry, latched)
    for value in range(5):
        out(number(value))
    assert values(out.latched) == values(subscription(entry, latched).messages) == [3, 4]


async def test_a_message_in_another_shape_ends_when_the_first_one_did() -> None:
    aged = ExpiringMessage(number(1), 5, asyncio.get_running_loop().time)
    other = aged.holding(number(2))
    assert (other.message, other.expires, other.fresh) == (number(2), 5, True)


# -- liveliness -------------------------------------------------------------------------------------------------------------


async def test_a_silent_publisher_is_lost_after_its_lease_and_back_with_its_next_sign_of_life() -> None:
    loop = asyncio.get_running_loop()
    entry = topic()
    out, queue = timed(entry, MANUAL), subscription(entry)
    lost, changed = out.events(), queue.events()
    await asyncio.sleep(0.9)
    out.assert_liveliness()
    assert await lost.next() == LivelinessLost(1, 1)
    assert loop.time() == pytest.approx(1.9, abs=2e-9)
    assert await changed.next() == LivelinessChanged(0, -1, 1, 1)
    assert loop.time() == pytest.approx(1.9, abs=2e-9)
    await asyncio.sleep(5.0)
    assert (lost.take(), changed.take()) == ([], [])
    back = asyncio.create_task(changed.next())
    await asyncio.sleep(0)
    out(number(1))
    assert await back == LivelinessChanged(1, 1, 0, -1)
    assert (out.status.liveliness_lost, queue.status.alive, queue.status.not_alive) == (1, 1, 0)


async def test_a_subscription_with_a_longer_lease_waits_longer() -> None:
    entry = topic()
    out, patient = timed(entry, MANUAL), subscription(entry, MANUAL.replace(liveliness_lease=3.0))
    changed = patient.events()
    await asyncio.sleep(2.0)
    assert (out.status.liveliness_lost, patient.status.alive) == (1, 1)
    await asyncio.sleep(1.1)
    assert changed.take() == [LivelinessChanged(0, -1, 1, 1)]


async def test_a_deadline_and_a_lease_of_one_publisher_run_side_by_side() -> None:
    entry = topic()
    out = timed(entry, MANUAL.replace(deadline=0.4))
    events = out.events()
    told = [await events.next() for _ in range(4)]
    assert [type(event).__name__ for event in told] == [
        "DeadlineMissed",
        "DeadlineMissed",
        "LivelinessLost",
        "DeadlineMissed",
    ]
    out.close()
    assert entry.publishers == []


async def test_a_publisher_that_leaves_is_neither_alive_nor_lost() -> None:
    entry = topic()
    out, queue = timed(entry, MANUAL), subscription(entry)
    changed = queue.events()
    out.close()
    await asyncio.sleep(5.0)
    assert changed.take()[1:] == [LivelinessChanged(0, -1, 0, 0)]


async def test_a_message_with_a_lifespan_counts_for_the_deadline_of_its_subscription() -> None:
    entry = topic()
    out, queue = timed(entry, SHORT.replace(deadline=0.5)), subscription(entry, QoS(depth=10, deadline=1.0))
    for value in range(3):
        await asyncio.sleep(0.8)
        out(number(value))
    assert queue.status.deadline_missed == 0
    await asyncio.sleep(1.5)
    assert queue.status.deadline_missed == 1
    stream = create(Stream, queue)
    with pytest.raises(CallTimeout):  # all of them have expired
        await stream.next(timeout=0.0)
