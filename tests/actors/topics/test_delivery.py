"""The delivery core by itself: publishers, queues and streams on a bare graph."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

from actors import QoS, qos
from actors.checks import create
from actors.errors import Ended, WrongThread, WrongType
from actors.graph.graph import Graph, TopicEntry
from actors.graph.interceptor import TopicInterceptor
from actors.inbox.inbox import Inbox, Item
from actors.interfaces.std_msgs.msg import Int32, String
from actors.qos.events import Matched
from actors.qos.policies import History
from actors.topics.handler import ConcurrentSubscription, HandlerSubscription
from actors.topics.peers import PublisherPeer, SubscriptionPeer, Target
from actors.topics.publisher import Publisher
from actors.topics.stream import Stream, StreamSubscription
from actors.topics.subscription import Subscription
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
    made = create(Publisher, ME, entry, Int32, policy)
    entry.add_publisher(made)
    return made


def subscription(entry: TopicEntry, policy: QoS = qos.DEFAULT) -> StreamSubscription[Int32]:
    made = StreamSubscription(ME, entry, Int32, policy)
    entry.add_subscription(made)
    return made


async def test_calling_a_publisher_publishes_and_counts() -> None:
    entry = topic()
    out, queue = publisher(entry), subscription(entry)
    out(number(1))
    out.publish(number(2))
    assert values(queue.messages) == [1, 2]
    assert (out.count, out.subscription_count, queue.received, queue.waiting) == (2, 1, 2, 2)
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


async def test_a_sign_of_life_comes_from_the_node_s_own_thread() -> None:
    out = publisher(topic())
    out.assert_liveliness()
    with pytest.raises(WrongThread, match=r"use node\.threadsafe"):
        await asyncio.to_thread(out.assert_liveliness)


async def test_a_closed_publisher_has_left_and_refuses() -> None:
    entry = topic()
    out, queue = publisher(entry), subscription(entry)
    out(number(1))
    out.suspend()
    out.close()
    out.close()
    with pytest.raises(Ended):
        out(number(2))
    with pytest.raises(Ended):
        await out.send(number(2))
    assert (entry.publishers, entry.message_count, queue.received) == ([], 1, 1)


async def test_delivery_is_in_the_order_of_subscription() -> None:
    entry = topic()
    out = publisher(entry)
    story: list[str] = []

    class Noting(Subscription[Int32]):
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
        Subscription(ME, topic(), Int32, qos.DEFAULT).deliver(number(1))


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
    stream = create(Stream, subscription(entry, QoS(history=History.KEEP_ALL, limit=1)))
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
    assert queue.senders is not None
    assert len(queue.senders) == 0
    late = asyncio.create_task(out.send(number(3)))
    await asyncio.sleep(0)
    late.cancel()
    queue.senders.wake_all()  # in the very moment of the cancellation
    await asyncio.wait([late])
    assert late.cancelled()
    assert values(queue.messages) == [1]


async def test_a_feed_puts_itself_into_the_inbox_once_for_each_message_it_keeps() -> None:
    entry = topic()
    out, inbox = publisher(entry), Inbox(asyncio.get_running_loop())
    seen: list[int] = []
    feed: HandlerSubscription[Int32] = HandlerSubscription(
        ME, entry, Int32, QoS(depth=2), inbox, "Node.take", lambda message: seen.append(message.data)
    )
    entry.add_subscription(feed)
    for value in range(5):
        out(number(value))
    assert repr(feed) == "<Node.take on /numbers: 2 waiting, 3 dropped>"
    assert feed.received == 5
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


async def handling(
    feed: HandlerSubscription[Int32], seconds: float, on_holding: Callable[[Item, float], None] | None = None
) -> list[int]:
    """Serve the feed's inbox from now on, `seconds` for each message; what the handler has seen."""
    seen: list[int] = []

    async def handle(message: Int32) -> None:
        seen.append(message.data)
        await asyncio.sleep(seconds)

    feed.take_over(feed.node, handle)
    feed.entry.add_subscription(feed)
    life: Any = None if on_holding is None else SimpleNamespace(on_holding=on_holding)
    feed.inbox.task = asyncio.create_task(feed.inbox.serve(life))
    await asyncio.sleep(0)
    return seen


def plain_feed(entry: TopicEntry, policy: QoS) -> HandlerSubscription[Int32]:
    return HandlerSubscription(ME, entry, Int32, policy, Inbox(asyncio.get_running_loop()), "Node.take", lambda _: None)


async def test_a_stream_refuses_a_timeout_that_is_no_number() -> None:
    stream = create(Stream, subscription(topic()))
    with pytest.raises(ValueError, match=r"the stream of /numbers: timeout=nan must be a number of seconds"):
        await stream.next(timeout=float("nan"))


async def test_the_wait_of_the_oldest_message_is_measured_on_when_a_newer_one_is_dropped() -> None:
    entry = topic()
    out, feed = publisher(entry), plain_feed(entry, QoS(history=History.KEEP_ALL, limit=2))
    entry.add_subscription(feed)
    out(number(1))
    feed.inbox.mark = feed.stamp()
    out(number(2))
    out(number(3))
    await asyncio.sleep(1.0)
    assert (feed.dropped, len(feed.messages)) == (1, 2)
    assert feed.inbox.load.age == 1.0


async def test_a_message_that_waits_brings_the_report_of_who_holds_the_node_up() -> None:
    loop, entry = asyncio.get_running_loop(), topic()
    out, feed = publisher(entry), plain_feed(entry, QoS(depth=9))
    held: list[tuple[str, float]] = []
    await handling(feed, 2.0, lambda item, seconds: held.append((item.label, loop.time())))
    out(number(1))
    await asyncio.sleep(0.5)
    out(number(2))
    await asyncio.sleep(0.75)
    assert held == [("Node.take", 1.0)]


async def test_the_message_whose_wait_is_measured_reaches_the_handler_as_itself_wherever_it_stands() -> None:
    entry = topic()
    out, feed = publisher(entry), plain_feed(entry, QoS(depth=99))
    seen = await handling(feed, 0.4)
    for value in range(10):
        out(number(value))
    await asyncio.sleep(10.0)
    assert seen == list(range(10))
    assert feed.inbox.load.longest_wait == pytest.approx(3.6)  # of the last one
    assert not feed.must_unwrap  # taking out is as cheap again as before


async def test_a_measured_message_that_is_dropped_is_measured_no_more() -> None:
    entry = topic()
    out, feed = publisher(entry), plain_feed(entry, QoS(depth=3))
    seen = await handling(feed, 3.0)
    out(number(1))
    await asyncio.sleep(1.0)
    out(number(2))
    await asyncio.sleep(0.25)
    assert feed.inbox.load.age == 0.25
    for value in (3, 4, 5):
        out(number(value))
    assert feed.inbox.load.age == 0.0
    await asyncio.sleep(0.5)
    assert feed.inbox.load.age == 0.25  # half a second after the first had to wait, another one is measured: the last
    await asyncio.sleep(19.0)
    assert (seen, feed.dropped) == ([1, 3, 4, 5], 1)
    assert not feed.must_unwrap


async def test_a_publisher_hears_at_once_who_comes_and_who_leaves() -> None:
    entry = topic()
    out = publisher(entry)
    told = out.events()
    waiting = asyncio.create_task(told.next(timeout=1.0))
    await asyncio.sleep(0)
    queue = subscription(entry)
    assert await waiting == Matched(1, 1, 1, 1)
    waiting = asyncio.create_task(told.next(timeout=1.0))
    await asyncio.sleep(0)
    queue.close()
    assert await waiting == Matched(1, 0, 0, -1)


async def test_a_concurrent_feed_begins_nothing_between_two_lives_and_an_old_task_takes_nothing_from_the_new() -> None:
    entry = topic()
    out, inbox = publisher(entry), Inbox(asyncio.get_running_loop())
    story: list[tuple[str, int]] = []

    def life(name: str) -> Any:
        async def handle(message: Int32) -> None:
            story.append((name, message.data))
            await asyncio.sleep(1.0)

        return handle

    tasks: list[asyncio.Task[None]] = []
    spawn_old, spawn_new = (lambda work, name: tasks.append(asyncio.create_task(work, name=name)) for _ in range(2))
    feed: ConcurrentSubscription[Int32] = ConcurrentSubscription(
        ME, entry, Int32, QoS(depth=9), inbox, "Node.take", life("old"), 1
    )
    feed.start(spawn_old)
    entry.add_subscription(feed)
    out(number(1))
    out(number(2))
    await asyncio.sleep(0.5)
    feed.pause()
    out(number(3))
    feed.take_over(ME, life("new"))
    feed.start(spawn_new)
    await asyncio.sleep(5.0)
    assert story == [("old", 1), ("new", 2), ("new", 3)]
    assert feed.active == 0
    assert [task.get_name() for task in tasks] == ["Node.take", "Node.take"]
    feed.pause()
    out(number(4))
    assert (feed.received, values(feed.messages)) == (4, [4])


async def test_who_waits_for_the_events_of_a_subscription_hears_at_once_that_it_has_closed() -> None:
    queue = subscription(topic())
    waiting = asyncio.create_task(queue.events().next(timeout=1.0))
    await asyncio.sleep(0)
    queue.close()
    with pytest.raises(Ended, match="have ended"):
        await waiting
    assert asyncio.get_running_loop().time() == 0.0


async def test_a_subscription_closes_once() -> None:
    entry = topic()
    closed: list[Any] = []
    queue = StreamSubscription(ME, entry, Int32, qos.DEFAULT, closed.append)
    entry.add_subscription(queue)
    queue.close()
    queue.close()
    assert closed == [queue]
    assert entry.subscriptions == []


async def test_a_message_and_a_cancellation_together_leave_the_message() -> None:
    entry = topic()
    out, stream = publisher(entry), create(Stream, subscription(entry))
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
    stream = create(Stream, subscription(entry))
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
    out, queue = publisher(entry), StreamSubscription(ME, entry, Copy, qos.DEFAULT)  # type: ignore[type-var]
    entry.add_subscription(queue)
    assert out.subscription_count == 1
    assert entry.type_names == ("std_msgs/msg/Int32",)


async def test_types_of_another_ros_name_are_kept_apart() -> None:
    entry = topic()
    out, queue = publisher(entry), StreamSubscription(Someone("/other"), entry, String, qos.DEFAULT)
    entry.add_subscription(queue)
    out(number(1))
    assert (out.subscription_count, queue.received) == (0, 0)
    assert queue.publisher_count == 0
    told = len(ME.warnings)
    again = StreamSubscription(Someone("/other"), entry, String, qos.DEFAULT)
    entry.add_subscription(again)
    assert len(ME.warnings) == told  # once for each pair of nodes; the counts go on
    assert (out.status.incompatible_type, again.status.incompatible_type) == (2, 1)


def counting() -> tuple[TopicEntry, list[SubscriptionPeer]]:
    """A topic, and every question of its publishers for the way into a subscription."""
    asked: list[SubscriptionPeer] = []

    class Counting(TopicInterceptor):
        def delivering(self, publisher: PublisherPeer, subscription: SubscriptionPeer, target: Target) -> Target:
            asked.append(subscription)
            return target

    graph = Graph(asyncio.get_running_loop().time)
    graph.intercept(Counting())
    return graph.topic("/numbers"), asked


async def test_subscriptions_that_come_and_go_cost_nothing_until_somebody_publishes() -> None:
    entry, asked = counting()
    out = publisher(entry)
    queues = [subscription(entry) for _ in range(100)]
    assert asked == []
    out(number(1))
    out(number(2))
    assert asked == queues
    for queue in queues[10:]:
        queue.close()
    assert len(asked) == 100
    out(number(3))
    out(number(4))
    assert asked[100:] == queues[:10]
    assert [values(queue.messages) for queue in queues[8:12]] == [[1, 2, 3, 4], [1, 2, 3, 4], [1, 2], [1, 2]]


async def test_who_comes_or_goes_during_a_publish_does_so_for_the_next_one() -> None:
    entry = topic()
    out = publisher(entry)
    story: list[tuple[str, int]] = []
    later: list[Subscription[Int32]] = []

    class Noting(Subscription[Int32]):
        def __init__(self, name: str) -> None:
            super().__init__(ME, entry, Int32, qos.DEFAULT)
            self.name = name
            entry.add_subscription(self)

        def deliver(self, message: Int32) -> None:
            story.append((self.name, message.data))
            if self.name == "first" and message.data == 1:
                second.close()
                later.append(Noting("third"))

    first, second = Noting("first"), Noting("second")
    assert out.peers == (first, second)
    out(number(1))
    assert out.peers == (first, later[0])
    assert out.subscription_count == 2
    out(number(2))
    assert story == [("first", 1), ("second", 1), ("first", 2), ("third", 2)]


async def test_a_tap_takes_what_a_changing_audience_takes() -> None:
    entry = topic()
    out = publisher(entry)
    heard: list[Int32] = []
    out.add_tap(heard.append)
    queue = subscription(entry)
    out(number(1))
    queue.close()
    out(number(2))
    assert (values(heard), values(queue.messages), out.peers) == ([1, 2], [1], ())
    out.close()
    assert (out.peers, out.targets, entry.publishers) == ((), (), [])


async def test_a_subscription_that_is_collected_while_a_publisher_comes_is_not_joined() -> None:
    entry = topic()
    left: list[Subscription[Int32]] = []

    class Closing(StreamSubscription[Int32]):
        def join(self, publisher: Publisher[Any]) -> None:
            super().join(publisher)
            for queue in left:  # as the garbage collector may do at any moment
                queue.close()

    first = Closing(ME, entry, Int32, qos.DEFAULT)
    entry.add_subscription(first)
    left.append(subscription(entry))
    last = subscription(entry)
    out = publisher(entry)
    assert out.peers == (first, last)
    assert entry.subscriptions == [first, last]


async def test_to_part_from_a_peer_that_is_not_matched_is_nothing() -> None:
    entry = topic()
    out, queue = publisher(entry), subscription(entry)
    other, stranger = publisher(topic()), subscription(topic())
    told = (out.events(), queue.events())
    out.part(stranger)
    queue.part(other)
    assert [events.take() for events in told] == [[], []]
    assert (out.peers, queue.publishers) == ((queue,), [out])


async def test_a_publisher_and_a_subscription_that_leave_are_forgotten_by_the_other_side() -> None:
    entry = topic()
    out, queue = publisher(entry), subscription(entry)
    second = publisher(entry)
    assert queue.publishers == [out, second]
    out.close()
    assert queue.publishers == [second]
    queue.close()
    assert (queue.publishers, second.peers) == ([], ())
    assert queue.status.matched_total == 2


async def test_peers_that_share_a_target_are_reached_by_one_call() -> None:
    entry = topic()
    out = publisher(entry)
    seen: list[Int32] = []

    class StandIn(StreamSubscription[Int32]):
        def target(self, publisher: PublisherPeer) -> Target:
            return seen.append

    local = subscription(entry)
    for _ in range(3):
        entry.add_subscription(StandIn(ME, entry, Int32, qos.DEFAULT))
    out(number(1))
    assert (out.subscription_count, len(out.targets)) == (4, 2)
    assert values(seen) == values(local.messages) == [1]
