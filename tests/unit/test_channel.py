"""The delivery core by itself: publishers, queues and streams on a bare graph."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

from actors import NotStarted, WrongType, qos
from actors.channel import Publisher, Queue
from actors.feeds import ConcurrentFeed, Feed
from actors.graph import Graph, TopicEntry
from actors.inbox import Inbox
from actors.interfaces.std_msgs.msg import Int32, String
from actors.qos import QoS
from actors.qos_policies import History
from actors.stream import Stream, Subscription
from tests.stage import number, values, word

pytestmark = pytest.mark.virtual


class Someone:
    """A participant that remembers its warnings."""

    def __init__(self, fqn: str = "/someone") -> None:
        self.fqn = fqn
        self.warnings: list[tuple[str, dict[str, object]]] = []

    def warn(self, event: str, **fields: object) -> None:
        self.warnings.append((event, fields))


ME = Someone()


def topic() -> TopicEntry:
    return Graph(asyncio.get_running_loop().time).topic("/numbers")


def publisher(entry: TopicEntry, policy: QoS = qos.DEFAULT) -> Publisher[Int32]:
    made = Publisher(ME, entry, Int32, policy)
    entry.add_publisher(made)
    return made


def subscription(entry: TopicEntry, policy: QoS = qos.DEFAULT) -> Subscription[Int32]:
    made = Subscription(ME, entry, Int32, policy)
    entry.add_subscription(made)
    return made


async def test_calling_a_publisher_publishes_and_counts() -> None:
    entry = topic()
    out, queue = publisher(entry), subscription(entry)
    out(number(1))
    out.publish(number(2))
    assert values(queue.messages) == [1, 2]
    assert (out.count, out.subscription_count, queue.received) == (2, 1, 2)
    assert repr(out) == "<publisher of /numbers [Int32] in /someone: 2 sent>"


async def test_a_suspended_publisher_discards_silently_what_is_of_its_type() -> None:
    entry = topic()
    out, queue = publisher(entry), subscription(entry)
    out.suspend()
    out(number(1))
    await out.send(number(2))
    with pytest.raises(WrongType):
        out(word("x"))  # type: ignore[arg-type]
    assert (out.count, queue.received) == (0, 0)
    out.resume()
    out(number(3))
    assert values(queue.messages) == [3]


async def test_a_closed_publisher_has_left_and_refuses() -> None:
    entry = topic()
    out, queue = publisher(entry), subscription(entry)
    out(number(1))
    out.suspend()
    out.close()
    out.close()
    with pytest.raises(NotStarted):
        out(number(2))
    with pytest.raises(NotStarted):
        await out.send(number(2))
    assert (entry.publishers, entry.message_count, queue.received) == ([], 1, 1)


async def test_delivery_is_in_the_order_of_subscription() -> None:
    entry = topic()
    out = publisher(entry)
    story: list[str] = []

    class Noting(Queue[Int32]):
        def __init__(self, name: str) -> None:
            super().__init__(ME, entry, Int32, qos.DEFAULT)
            self.name = name

        def deliver(self, message: Int32) -> None:
            story.append(self.name)

    for name in ("first", "second", "third"):
        entry.add_subscription(Noting(name))
    out(number(1))
    assert story == ["first", "second", "third"]


async def test_a_bare_queue_does_not_know_what_to_do_with_a_message() -> None:
    with pytest.raises(NotImplementedError):
        Queue(ME, topic(), Int32, qos.DEFAULT).deliver(number(1))


async def test_a_full_queue_loses_the_oldest_or_with_keep_all_the_newest() -> None:
    entry = topic()
    out = publisher(entry)
    last = subscription(entry, QoS(depth=2))
    everything = subscription(entry, QoS(history=History.KEEP_ALL, limit=2))
    for value in range(5):
        out(number(value))
    assert (values(last.messages), last.dropped) == ([3, 4], 3)
    assert (values(everything.messages), everything.dropped) == ([0, 1], 3)
    assert last.latest == everything.latest == number(4)
    assert entry.dropped == 6


async def test_senders_wake_when_there_is_room_and_go_on_in_order() -> None:
    entry = topic()
    out = publisher(entry)
    stream = Stream(subscription(entry, QoS(history=History.KEEP_ALL, limit=1)))
    senders = [asyncio.create_task(out.send(number(value))) for value in range(4)]
    seen = []
    for _ in range(4):
        await asyncio.sleep(0)
        seen.append((await stream.next()).data)
    assert seen == [0, 1, 2, 3]
    await asyncio.wait(senders)


async def test_a_sender_that_gives_up_is_forgotten() -> None:
    entry = topic()
    out, queue = publisher(entry), subscription(entry, QoS(history=History.KEEP_ALL, limit=1))
    await out.send(number(1))
    for _ in range(3):
        with pytest.raises(TimeoutError):
            await asyncio.wait_for(out.send(number(2)), 1.0)
    assert queue.rooms == []
    late = asyncio.create_task(out.send(number(3)))
    await asyncio.sleep(0)
    late.cancel()
    queue.made_room()  # in the very moment of the cancellation
    await asyncio.wait([late])
    assert late.cancelled()
    assert values(queue.messages) == [1]


async def test_a_feed_puts_itself_into_the_inbox_once_for_each_message_it_keeps() -> None:
    entry = topic()
    out, inbox = publisher(entry), Inbox(asyncio.get_running_loop())
    seen: list[int] = []
    feed: Feed[Int32] = Feed(ME, entry, Int32, QoS(depth=2), inbox, "Node.take")
    feed.handler = lambda message: seen.append(message.data)
    entry.add_subscription(feed)
    for value in range(5):
        out(number(value))
    assert repr(feed) == "<Node.take on /numbers: 2 waiting, 3 dropped>"
    assert list(inbox.items) == [feed, feed]
    task = asyncio.create_task(inbox.serve())
    await asyncio.sleep(1.0)
    assert seen == [3, 4]
    task.cancel()
    await asyncio.sleep(0)
    canceled = inbox.waiter = asyncio.get_running_loop().create_future()
    canceled.cancel()
    out(number(9))  # whoever waited has been canceled in this moment
    assert len(inbox.items) == 1


async def test_a_concurrent_feed_begins_nothing_between_two_lives_and_an_old_task_takes_nothing_from_the_new() -> None:
    entry = topic()
    out, inbox = publisher(entry), Inbox(asyncio.get_running_loop())
    story: list[tuple[str, int]] = []
    feed: ConcurrentFeed[Int32] = ConcurrentFeed(ME, entry, Int32, QoS(depth=9), inbox, "Node.take", 1)

    def life(name: str) -> Any:
        async def handle(message: Int32) -> None:
            story.append((name, message.data))
            await asyncio.sleep(1.0)

        return handle

    tasks: list[asyncio.Task[None]] = []
    spawn_old, spawn_new = (lambda work: tasks.append(asyncio.create_task(work)) for _ in range(2))
    feed.handler, feed.spawn = life("old"), spawn_old
    entry.add_subscription(feed)
    out(number(1))
    out(number(2))
    await asyncio.sleep(0.5)
    feed.spawn = None
    out(number(3))
    feed.handler, feed.spawn, feed.active = life("new"), spawn_new, 0
    feed.work()
    await asyncio.sleep(5.0)
    assert story == [("old", 1), ("new", 2), ("new", 3)]
    assert feed.active == 0
    assert len(tasks) == 2


async def test_a_subscription_closes_once() -> None:
    entry = topic()
    queue = subscription(entry)
    closed: list[Any] = []
    queue.on_close = closed.append
    queue.close()
    queue.close()
    assert closed == [queue]
    assert entry.subscriptions == []


async def test_a_message_and_a_cancellation_together_leave_the_message() -> None:
    entry = topic()
    out, stream = publisher(entry), Stream(subscription(entry))
    reader = asyncio.create_task(stream.next())
    await asyncio.sleep(0)
    out(number(1))
    out(number(2))  # the reader has been woken, but has not run
    reader.cancel()
    with pytest.raises(asyncio.CancelledError):
        await reader
    assert [(await stream.next()).data for _ in range(2)] == [1, 2]


async def test_a_reader_that_is_canceled_as_the_stream_closes_just_ends() -> None:
    entry = topic()
    stream = Stream(subscription(entry))
    reader = asyncio.create_task(stream.next())
    await asyncio.sleep(0)
    reader.cancel()
    await asyncio.sleep(0)
    stream.close()
    await asyncio.wait([reader])
    assert reader.cancelled()


async def test_a_stream_that_was_never_finished_being_made_can_be_forgotten() -> None:
    half = Stream.__new__(Stream)
    del half


async def test_types_of_the_same_ros_name_are_the_same_type() -> None:
    class Copy:
        __ros_type__ = Int32.__ros_type__

    entry = topic()
    out, queue = publisher(entry), Subscription(ME, entry, Copy, qos.DEFAULT)  # type: ignore[type-var]
    entry.add_subscription(queue)
    assert out.subscription_count == 1
    assert entry.type_names == ("std_msgs/msg/Int32",)


async def test_types_of_another_ros_name_are_kept_apart() -> None:
    entry = topic()
    out, queue = publisher(entry), Subscription(Someone("/other"), entry, String, qos.DEFAULT)
    entry.add_subscription(queue)
    out(number(1))
    assert (out.subscription_count, queue.received) == (0, 0)
    assert queue.publisher_count == 0
    told = len(ME.warnings)
    again = Subscription(Someone("/other"), entry, String, qos.DEFAULT)
    entry.add_subscription(again)
    assert len(ME.warnings) == told  # once for each pair of nodes; the counts go on
    assert (out.status.incompatible_type, again.status.incompatible_type) == (2, 1)
