"""Endpoints and their event streams, on a bare graph."""

from __future__ import annotations

import asyncio
import gc
import math
from typing import Any

import pytest

from actors import QoS, qos
from actors.checks import create
from actors.errors import CallTimeout, Ended
from actors.interfaces.std_msgs.msg import Int32
from actors.qos.events import DeadlineMissed, LivelinessChanged, Matched, MessageLost
from actors.topics.endpoint import Endpoint, EndpointEvents, nanoseconds
from actors.topics.publisher import Publisher
from actors.topics.stream import Stream, StreamSubscription
from actors.topics.subscription import Subscription
from actors.topics.timed_publisher import TimedPublisher, publisher_for
from tests.actors.topics.test_delivery import ME, publisher, subscription, topic
from tests.stage import number

pytestmark = pytest.mark.virtual


def timed(entry: Any, policy: QoS) -> Publisher[Int32]:
    made = publisher_for(ME, entry, Int32, policy)
    entry.add_publisher(made)
    return made


@pytest.mark.parametrize(
    ("seconds", "wanted"),
    [
        (None, None),
        (math.inf, None),
        (qos.BEST_AVAILABLE_DURATION, None),
        (0.1, 100_000_000),
        (1 / 3, 333_333_334),
        (1e-9, 1),
    ],
)
def test_a_duration_is_whole_nanoseconds_rounded_up_or_endless(seconds: float | None, wanted: int | None) -> None:
    assert nanoseconds(seconds) == wanted


async def test_an_endpoint_that_nobody_asks_keeps_nothing() -> None:
    entry = topic()
    out, queue = publisher(entry), subscription(entry)
    out(number(1))
    assert out.kept_events is queue.kept_events is None
    assert (out.status.matched, queue.status.matched, queue.status.alive) == (1, 1, 1)
    assert out.kept_events is queue.kept_events is None


async def test_a_bare_endpoint_has_neither_status_nor_times() -> None:
    bare = Endpoint(ME, topic(), qos.DEFAULT)
    with pytest.raises(NotImplementedError):
        bare.status  # noqa: B018
    with pytest.raises(NotImplementedError):
        bare.due(0)


async def test_events_tell_what_happens_from_now_on_and_events_of_a_kind_together() -> None:
    entry = topic()
    out, first = publisher(entry), subscription(entry)
    events = out.events()
    assert events.take() == []
    second = subscription(entry)
    first.close()
    assert await events.next() == Matched(total_count=2, total_count_change=1, current_count=1, current_count_change=0)
    second.close()
    async for event in events:
        assert event == Matched(2, 0, 0, -1)
        break
    assert not events.waiting()
    assert repr(events) == "<events of <publisher of /numbers [Int32] in /someone: 0 sent>>"


async def test_listeners_are_independent() -> None:
    entry = topic()
    out = publisher(entry)
    early = out.events()
    subscription(entry)
    late = out.events()
    subscription(entry)
    assert early.take() == [Matched(2, 2, 2, 2)]
    assert late.take() == [Matched(2, 1, 2, 1)]


async def test_a_listener_is_woken_and_waits_alone() -> None:
    entry = topic()
    queue = subscription(entry, QoS(depth=1))
    events = queue.events()
    waiting = asyncio.create_task(events.next())
    await asyncio.sleep(0)
    with pytest.raises(RuntimeError, match=r"two tasks wait for the <events of <subscription of /numbers"):
        await events.next()
    queue.notify()  # for nothing: it waits on
    await asyncio.sleep(0)
    out = publisher(entry)
    queue.notify()  # once more before it has looked
    assert await waiting == Matched(1, 1, 1, 1)
    assert events.take() == [LivelinessChanged(1, 1, 0, 0)]
    out(number(1))
    out(number(2))
    assert events.waiting()
    assert await events.next() == MessageLost(1, 1)


async def test_no_event_in_time_is_a_timeout_and_the_end_is_told() -> None:
    entry = topic()
    out = publisher(entry)
    events = out.events()
    with pytest.raises(CallTimeout, match=r"no event within 2\.0 s from <publisher of /numbers"):
        await events.next(timeout=2.0)
    waiting = asyncio.create_task(events.next())
    await asyncio.sleep(0)
    out.close()
    with pytest.raises(Ended, match="have ended with it"):
        await waiting
    assert [event async for event in events] == []
    assert [event async for event in out.events()] == []


async def test_a_closed_listener_hears_no_more_and_closing_wakes_who_waits() -> None:
    entry = topic()
    out = publisher(entry)
    events = out.events()
    waiting = asyncio.create_task(anext(events, None))
    await asyncio.sleep(0)
    events.close()
    events.close()
    subscription(entry)
    assert await waiting is None
    assert events.take() == []


async def test_a_listener_that_is_forgotten_leaves_its_endpoint() -> None:
    out = publisher(topic())
    events = out.events()
    assert out.kept_events is not None
    assert len(out.kept_events.listeners) == 1
    del events
    gc.collect()
    assert out.kept_events.listeners == []
    half = object.__new__(type(out.events()))
    del half


async def test_a_stream_lives_as_long_as_somebody_listens_to_its_events() -> None:
    entry = topic()
    events = create(Stream, subscription(entry)).events()
    gc.collect()
    publisher(entry)
    assert await events.next() == Matched(1, 1, 1, 1)
    del events
    gc.collect()
    assert entry.subscriptions == []


async def test_a_deadline_needs_no_timer_but_while_somebody_listens(monkeypatch: pytest.MonkeyPatch) -> None:
    loop = asyncio.get_running_loop()
    looks: list[int] = []
    look = EndpointEvents._look

    def noted(self: EndpointEvents, due: int) -> None:
        looks.append(due)
        look(self, due)

    monkeypatch.setattr(EndpointEvents, "_look", noted)
    entry = topic()
    out = timed(entry, QoS(depth=1, deadline=0.1))
    assert isinstance(out, TimedPublisher)
    await asyncio.sleep(1.05)
    assert out.status.deadline_missed == 10
    assert looks == []
    events = out.events()
    assert await events.next() == DeadlineMissed(11, 1)
    assert loop.time() == pytest.approx(1.1, abs=2e-9)
    events.close()
    await asyncio.sleep(1.0)
    assert looks == [1_100_000_001]
    assert out.status.deadline_missed == 21


async def test_messages_in_time_put_the_deadline_off() -> None:
    loop = asyncio.get_running_loop()
    entry = topic()
    out = timed(entry, QoS(depth=1, deadline=0.1))
    queue = StreamSubscription(ME, entry, Int32, QoS(depth=100, deadline=0.2))
    assert queue.due(0) is None
    entry.add_subscription(queue)
    missed, heard = out.events(), queue.events()
    for _ in range(50):
        out(number(1))
        await asyncio.sleep(0.1)
    assert (missed.take(), heard.take()) == ([], [])
    assert await missed.next() == DeadlineMissed(1, 1)
    assert loop.time() == pytest.approx(5.0, abs=2e-9)
    assert await heard.next() == DeadlineMissed(1, 1)
    assert loop.time() == pytest.approx(5.1, abs=2e-9)


async def test_a_queue_that_knows_nothing_of_lifespans_gets_the_message_itself() -> None:
    entry = topic()
    seen: list[Int32] = []

    class Noting(Subscription[Int32]):
        def deliver(self, message: Int32) -> None:
            seen.append(message)

    out = timed(entry, QoS(depth=1, lifespan=1.0))
    entry.add_subscription(Noting(ME, entry, Int32, qos.DEFAULT))
    out(number(1))
    assert seen == [number(1)]
