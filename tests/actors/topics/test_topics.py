"""Topics, as nodes meet them: who gets what, in which order, and what is lost."""

from __future__ import annotations

import asyncio
import gc
import threading
from functools import partial
from typing import Any

import pytest

from actors import Child, Node, QoS, Supervisor, Topic, every, publishes, qos, subscribes
from actors.errors import CallTimeout, Ended, NotStarted, WrongThread, WrongType
from actors.interfaces.sensor_msgs.msg import LaserScan
from actors.interfaces.std_msgs.msg import Float32, Header, Int32, String
from actors.qos.policies import History
from actors.testing import Rig
from tests.stage import NUMBERS, WORDS, events, number, values, word

KEEP_ALL_3 = QoS(history=History.KEEP_ALL, limit=3)
LATCHED_3 = qos.LATCHED.replace(depth=3)


class Collector(Node):
    """Takes every number."""

    def __init__(self) -> None:
        self.seen: list[int] = []

    @NUMBERS.on()
    async def take(self, message: Int32) -> None:
        self.seen.append(message.data)


class Talker(Node):
    """Publishes what it is told to."""

    out = publishes(NUMBERS)


class Slow(Node):
    """Needs a second for every number."""

    def __init__(self) -> None:
        self.seen: list[int] = []

    @NUMBERS.on(qos=5)
    async def take(self, message: Int32) -> None:
        await self.clock.sleep(1.0)
        self.seen.append(message.data)


# -- who gets what ---------------------------------------------------------------------------------------------------


async def test_a_publisher_never_waits_for_a_slow_reader(rig: Rig) -> None:
    await rig.start(Talker, Slow)
    before = rig.now
    for value in range(100):
        rig.node(Talker).out(number(value))
    assert rig.now == before
    await rig.advance(10.0)
    assert rig.node(Slow).seen == [95, 96, 97, 98, 99]


async def test_each_of_ten_readers_gets_all_of_a_hundred_messages_in_order(rig: Rig) -> None:
    readers = [Child(Collector, name=f"reader_{index}") for index in range(10)]
    await rig.start(Talker, *readers)
    for value in range(100):
        rig.node(Talker).out(number(value))
    await rig.quiet()
    for index in range(10):
        core = rig.state(f"reader_{index}").running
        assert core is not None
        assert core.node.seen == list(range(100))  # type: ignore[attr-defined]


async def test_a_reader_gets_the_messages_of_three_publishers_each_in_its_own_order(rig: Rig) -> None:
    class Counter(Node):
        out = publishes(NUMBERS)

        def __init__(self, first: int) -> None:
            self.next = first

        @every(hz=50)
        async def count(self) -> None:
            if self.next % 1000 < 50:
                self.out(number(self.next))
                self.next += 1

    counters = [Child(Counter, name=f"counter_{index}", args=(1000 * index,)) for index in range(3)]
    await rig.start(Collector, *counters)
    await rig.advance(2.0)
    seen = rig.node(Collector).seen
    assert len(seen) == 150
    for index in range(3):
        assert [value for value in seen if value // 1000 == index] == list(range(1000 * index, 1000 * index + 50))


async def test_the_order_of_starting_does_not_matter(rig: Rig) -> None:
    await rig.start(Child(Collector, name="early"), Talker, Child(Collector, name="late"))
    assert rig.node(Talker).out.subscription_count == 2
    rig.node(Talker).out(number(1))
    rig.crash(Talker)
    await rig.settled()
    rig.node(Talker).out(number(2))
    await rig.quiet()
    for name in ("early", "late"):
        assert rig.state(name).node.seen == [1, 2]  # type: ignore[union-attr]


async def test_a_crash_of_either_side_leaves_the_other_alive(rig: Rig) -> None:
    await rig.start(Talker, Collector)
    collector = rig.node(Collector)
    rig.crash(Talker)
    await rig.settled()
    rig.node(Talker).out(number(1))
    await rig.quiet()
    assert rig.node(Collector) is collector
    assert collector.seen == [1]
    talker = rig.node(Talker)
    rig.crash(Collector)
    await rig.settled()
    assert rig.node(Talker) is talker
    talker.out(number(2))
    await rig.quiet()
    assert rig.node(Collector).seen == [2]


async def test_messages_that_come_during_a_restart_wait_for_the_next_life(rig: Rig) -> None:
    rig.expect_failure(ValueError)

    class Fragile(Node):
        """Cannot stand a negative number."""

        seen: list[tuple[int, int]]

        async def on_start(self) -> None:
            self.seen = []
            if self.incarnation > 1:
                await self.clock.sleep(1.0)

        @NUMBERS.on()
        async def take(self, message: Int32) -> None:
            if message.data < 0:
                raise ValueError(f"{message.data} is negative")
            self.seen.append((self.incarnation, message.data))

    await rig.start(Fragile)
    for value in (1, -1, 2, 3):
        rig.publish(NUMBERS, number(value))
    await rig.quiet()
    rig.publish(NUMBERS, number(4))
    assert rig.state(Fragile).state == "restarting"
    await rig.settled()
    assert rig.node(Fragile).seen == [(2, 2), (2, 3), (2, 4)]
    assert rig.incarnation(Fragile) == 2


def test_a_number_is_the_depth_of_the_default_profile() -> None:
    assert Topic(String, "x", 10).qos == qos.DEFAULT


async def test_who_comes_late_misses_what_was_volatile(rig: Rig) -> None:
    await rig.start(Talker)
    for value in range(5):
        rig.node(Talker).out(number(value))
    stream = rig.me.subscribe(NUMBERS)
    rig.node(Talker).out(number(5))
    assert (await stream.next()).data == 5
    assert stream.received == 1


async def test_a_flood_is_bounded_by_the_depth_and_its_losses_are_counted(rig: Rig) -> None:
    await rig.start(Talker)
    streams = [rig.me.subscribe(NUMBERS, qos=5) for _ in range(3)]
    for value in range(100_000):
        rig.node(Talker).out(number(value))
    for stream in streams:
        assert (stream.received, stream.dropped) == (100_000, 99_995)
        assert [(await stream.next()).data for _ in range(5)] == list(range(99_995, 100_000))
    assert rig.system.graph.topic("/numbers").dropped == 3 * 99_995
    assert rig.system.graph.topic("/numbers").message_count == 100_000


async def test_relative_names_live_in_the_namespace_of_their_node(rig: Rig) -> None:
    absolute = Topic(Int32, "/numbers")

    class Both(Node):
        near = publishes(NUMBERS)
        far = publishes(absolute)

    await rig.start(Child(Both, namespace="/ns"))
    near, far = rig.probe(NUMBERS, name="/ns/numbers"), rig.probe(NUMBERS)
    rig.node(Both).near(number(1))
    rig.node(Both).far(number(2))
    assert (values(near), values(far)) == ([1], [2])


async def test_a_topic_is_renamed_from_outside(rig: Rig) -> None:
    await rig.start(Child(Talker, remap={"numbers": "/renamed"}))
    probe = rig.probe(NUMBERS, name="/renamed")
    rig.node(Talker).out(number(1))
    assert values(probe) == [1]


async def test_a_slow_reader_never_stalls_the_others(rig: Rig) -> None:
    await rig.start(Talker, Slow, Collector)
    for value in range(3):
        rig.node(Talker).out(number(value))
        await rig.advance(0.001)
    assert rig.node(Collector).seen == [0, 1, 2]
    assert rig.node(Slow).seen == []


async def test_two_types_under_one_name_are_reported_once_to_both_and_never_mixed(rig: Rig) -> None:
    as_text = Topic(String, "numbers", 100)

    class Reader(Node):
        def __init__(self) -> None:
            self.seen: list[Any] = []

        @as_text.on()
        async def take(self, message: String) -> None:
            self.seen.append(message)

    await rig.start(Talker, Reader)
    for value in range(3):
        rig.node(Talker).out(number(value))
    rig.crash(Reader)
    await rig.settled()
    rig.node(Talker).out(number(4))
    await rig.quiet()
    assert rig.node(Reader).seen == []
    reports = events(rig.logs, "Incompatible types on topic '/numbers'")
    assert [record.node for record in reports] == ["/talker", "/reader"]
    assert all("std_msgs/msg/Int32" in str(record) and "std_msgs/msg/String" in str(record) for record in reports)
    assert rig.system.graph.topic("/numbers").type_names == ("std_msgs/msg/Int32", "std_msgs/msg/String")


async def test_an_incompatible_pair_is_reported_once_to_both_sides_with_the_policy(rig: Rig) -> None:
    best_effort = Topic(Int32, "numbers", qos.SENSOR_DATA)

    class Sensor(Node):
        out = publishes(best_effort)

    class Strict(Node):
        @NUMBERS.on()
        async def take(self, message: Int32) -> None:
            raise AssertionError("nothing may arrive")

    await rig.start(Sensor, Strict)
    rig.crash(Sensor)
    await rig.settled()
    rig.node(Sensor).out(number(1))
    await rig.quiet()
    offered, requested = events(rig.logs, "incompatible QoS")
    assert offered.node == "/sensor"
    assert offered.event.startswith("New subscription discovered on topic '/numbers', requesting incompatible QoS.")
    assert offered.fields["subscriber"] == "/strict"
    assert requested.node == "/strict"
    assert requested.event.startswith("New publisher discovered on topic '/numbers', offering incompatible QoS.")
    assert requested.fields["publisher"] == "/sensor"
    assert all(record.event.endswith("Last incompatible policy: RELIABILITY") for record in (offered, requested))


@pytest.mark.parametrize("text", ["1bad", "a b", "a//b", "a-"])
def test_a_bad_name_is_refused_when_the_contract_is_made(text: str) -> None:
    with pytest.raises(TypeError, match=r"Topic\(\.\.\., "):
        Topic(String, text)


# -- histories -------------------------------------------------------------------------------------------------------


async def test_a_latched_topic_replays_its_last_messages_without_gap_or_duplicate(rig: Rig) -> None:
    latched = Topic(Int32, "state", LATCHED_3)

    class State(Node):
        out = publishes(latched)

    await rig.start(State)
    out = rig.node(State).out
    for value in range(1, 6):
        out(number(value))
    late = rig.me.subscribe(latched)
    later = rig.me.subscribe(latched, qos=LATCHED_3.replace(depth=2))
    volatile = rig.me.subscribe(latched, qos=10)
    out(number(6))
    assert [(await late.next(timeout=1.0)).data for _ in range(3)] == [4, 5, 6]
    assert late.dropped == 1
    assert [(await later.next(timeout=1.0)).data for _ in range(2)] == [5, 6]
    assert (await volatile.next(timeout=1.0)).data == 6
    assert late.latest == number(6)


async def test_a_latched_topic_replays_to_a_reader_that_takes_its_time_nothing_twice(rig: Rig) -> None:
    latched = Topic(Int32, "state", LATCHED_3)
    await rig.start(Talker)
    first, second = rig.me.publisher(latched), rig.me.publisher(latched)
    first(number(1))
    second(number(10))
    first(number(2))
    stream = rig.me.subscribe(latched, qos=LATCHED_3.replace(depth=10))
    first(number(3))
    assert [(await stream.next(timeout=1.0)).data for _ in range(4)] == [1, 2, 10, 3]
    with pytest.raises(CallTimeout, match=r"no message on /state within 1\.0 s \(2 matching publishers"):
        await stream.next(timeout=1.0)


async def test_what_was_latched_goes_with_its_publisher(rig: Rig) -> None:
    latched = Topic(Int32, "state", qos.LATCHED)

    class State(Node):
        out = publishes(latched)

        async def on_start(self) -> None:
            if self.incarnation == 1:
                self.out(number(1))

    await rig.start(State)
    rig.crash(State)
    await rig.settled()
    assert rig.me.subscribe(latched).latest is None


async def test_a_paused_reader_gets_the_newest_and_its_losses_are_visible(rig: Rig) -> None:
    await rig.start(Talker)
    stream = rig.me.subscribe(NUMBERS, qos=5)
    for value in range(20):
        rig.node(Talker).out(number(value))
    assert repr(stream) == "<stream of /numbers [Int32]: 5 waiting, 15 dropped>"
    assert [(await stream.next()).data for _ in range(5)] == [15, 16, 17, 18, 19]


async def test_keep_all_holds_back_a_sender_that_awaits_and_loses_nothing(rig: Rig) -> None:
    everything = Topic(Int32, "everything", KEEP_ALL_3)

    class Worker(Node):
        def __init__(self) -> None:
            self.seen: list[int] = []

        @everything.on()
        async def take(self, message: Int32) -> None:
            await self.clock.sleep(1.0)
            self.seen.append(message.data)

    class Source(Node):
        out = publishes(everything)
        sent: list[float]

        async def on_start(self) -> None:
            self.sent = []
            self.create_task(self.send_all())

        async def send_all(self) -> None:
            for value in range(8):
                await self.out.send(number(value))
                self.sent.append(self.clock.now())

    await rig.start(Worker, Source)
    await rig.advance(20.0)
    assert rig.node(Worker).seen == list(range(8))
    assert rig.node(Source).sent == [0.0, 0.0, 0.0, 0.0, 1.0, 2.0, 3.0, 4.0]


async def test_keep_all_never_overwrites_what_waits_a_plain_publish_is_lost_and_counted(rig: Rig) -> None:
    everything = Topic(Int32, "everything", KEEP_ALL_3)
    await rig.start(Talker)
    stream = rig.me.subscribe(everything)
    for value in range(5):
        rig.publish(everything, number(value))
    assert stream.dropped == 2
    assert [(await stream.next()).data for _ in range(3)] == [0, 1, 2]


async def test_a_reader_that_leaves_lets_the_waiting_sender_go_on(rig: Rig) -> None:
    everything = Topic(Int32, "everything", KEEP_ALL_3)
    await rig.start(Talker)
    out, stream = rig.me.publisher(everything), rig.me.subscribe(everything)
    for value in range(3):
        await out.send(number(value))
    sending = [asyncio.create_task(out.send(number(value))) for value in (3, 4)]
    impatient = asyncio.create_task(out.send(number(5)))
    await rig.advance(1.0)
    assert not any(task.done() for task in sending)
    impatient.cancel()
    await rig.quiet()
    stream.close()
    await asyncio.wait(sending)
    assert out.count == 5


async def test_a_probe_watches_a_keep_all_topic_without_holding_anybody_back(rig: Rig) -> None:
    everything = Topic(Int32, "everything", KEEP_ALL_3)
    await rig.start(Talker)
    probe, out = rig.probe(everything), rig.me.publisher(everything)
    for value in range(10):
        await asyncio.wait_for(out.send(number(value)), 1.0)
    assert values(probe) == list(range(10))


async def test_sending_what_is_not_of_the_type_fails_at_once_not_when_there_is_room(rig: Rig) -> None:
    everything = Topic(Int32, "everything", KEEP_ALL_3)
    await rig.start(Talker)
    out, stream = rig.me.publisher(everything), rig.me.subscribe(everything)
    for value in range(3):
        await out.send(number(value))
    with pytest.raises(WrongType):
        await asyncio.wait_for(out.send(word("x")), 1.0)  # type: ignore[arg-type]
    assert stream.received == 3


# -- streams ---------------------------------------------------------------------------------------------------------


async def test_a_stream_and_a_handler_get_the_same_messages(rig: Rig) -> None:
    await rig.start(Talker, Collector)
    seen: list[int] = []

    async def listen() -> None:
        async for message in rig.me.subscribe(NUMBERS):
            seen.append(message.data)

    task = asyncio.create_task(listen())
    await rig.quiet()
    for value in range(10):
        rig.node(Talker).out(number(value))
    await rig.quiet()
    assert seen == rig.node(Collector).seen == list(range(10))
    assert rig.node(Talker).out.subscription_count == 2
    task.cancel()
    await asyncio.wait([task])
    del task
    gc.collect()
    assert rig.node(Talker).out.subscription_count == 1


async def test_a_break_out_of_the_loop_unsubscribes(rig: Rig) -> None:
    await rig.start(Talker)
    out = rig.node(Talker).out

    async def first() -> Int32 | None:
        async for message in rig.me.subscribe(NUMBERS):
            return message
        return None

    task = asyncio.create_task(first())
    await rig.quiet()
    out(number(7))
    assert await task == number(7)
    assert out.subscription_count == 0


async def test_a_stream_ends_with_its_block_and_what_waits_can_still_be_taken(rig: Rig) -> None:
    await rig.start(Talker)
    out = rig.node(Talker).out
    async with rig.me.subscribe(NUMBERS) as stream:
        out(number(1))
    out(number(2))
    assert repr(stream) == "<stream of /numbers [Int32]: closed>"
    assert [message.data async for message in stream] == [1]
    with pytest.raises(Ended, match="the stream of /numbers has ended: subscribe again"):
        await stream.next()
    stream.close()


async def test_closing_wakes_who_waits(rig: Rig) -> None:
    await rig.start(Talker)
    stream = rig.me.subscribe(NUMBERS)

    async def listen() -> str:
        async for _ in stream:
            pass
        return "ended"

    task = asyncio.create_task(listen())
    await rig.quiet()
    stream.close()
    assert await task == "ended"


async def test_a_forgotten_stream_leaves_the_topic(rig: Rig) -> None:
    await rig.start(Talker)
    stream = rig.me.subscribe(NUMBERS)
    assert rig.node(Talker).out.subscription_count == 1
    assert stream.publisher_count == 1
    del stream
    assert rig.node(Talker).out.subscription_count == 0


async def test_two_tasks_on_one_stream_are_told_to_have_one_each(rig: Rig) -> None:
    await rig.start(Talker)
    stream = rig.me.subscribe(NUMBERS)
    waiting = asyncio.create_task(stream.next())
    await rig.quiet()
    with pytest.raises(
        RuntimeError, match=r"two tasks wait on one stream of /numbers: give each its own subscribe\(\)"
    ):
        await stream.next()
    rig.node(Talker).out(number(1))
    assert await waiting == number(1)


async def test_an_impatient_reader_loses_no_message(rig: Rig) -> None:
    await rig.start(Talker)
    stream = rig.me.subscribe(NUMBERS)
    with pytest.raises(CallTimeout):
        await stream.next(timeout=1.0)
    rig.node(Talker).out(number(1))
    assert await stream.next(timeout=1.0) == number(1)


async def test_a_declared_stream_listens_from_the_start_on_and_ends_with_its_node(rig: Rig) -> None:
    class Watcher(Node):
        numbers = subscribes(NUMBERS)

    await rig.start(Talker, Watcher)
    stream = rig.node(Watcher).numbers
    rig.node(Talker).out(number(1))
    rig.node(Talker).out(number(2))
    assert stream.latest == number(2)
    rig.crash(Watcher)
    await rig.settled()
    assert rig.node(Watcher).numbers is not stream
    assert [message.data async for message in stream] == [1, 2]


# -- what is refused -------------------------------------------------------------------------------------------------


async def test_a_message_of_another_type_is_refused_in_the_publishers_frame(rig: Rig) -> None:
    await rig.start(Talker, Collector)
    with pytest.raises(WrongType, match="/talker publishes Int32 on /numbers, not Float32 "):
        rig.node(Talker).out(Float32(data=1.0))  # type: ignore[arg-type]
    await rig.quiet()
    assert rig.node(Collector).seen == []
    assert rig.node(Talker).out.count == 0


async def test_a_message_is_a_value_that_nobody_can_change_under_anothers_hands(rig: Rig) -> None:
    await rig.start(Talker)
    one, other = rig.me.subscribe(WORDS), rig.me.subscribe(WORDS)
    message = word("first")
    rig.publish(WORDS, message)
    with pytest.raises(AttributeError, match=r"message\.replace\(data=\.\.\.\)"):
        message.data = "changed"  # type: ignore[misc]
    changed = message.replace(data="changed")
    assert (await one.next(), await other.next()) == (word("first"), word("first"))
    assert changed == word("changed")
    scan = LaserScan(header=Header(frame_id="laser"), ranges=[1.0, 2.0])
    with pytest.raises(ValueError, match="read-only"):
        scan.ranges[0] = 9.0


def from_a_thread(work: Any) -> list[BaseException]:
    """Run `work` in a thread of its own and return what it raised."""
    caught: list[BaseException] = []

    def run() -> None:
        try:
            work()
        except BaseException as error:
            caught.append(error)

    thread = threading.Thread(target=run)
    thread.start()
    thread.join()
    return caught


async def test_a_foreign_thread_that_sends_is_refused_at_once_also_where_a_full_subscription_makes_it_wait(
    rig: Rig,
) -> None:
    class Slow(Node):
        """Handles a number a second, and keeps one."""

        @NUMBERS.on(qos=QoS(history=History.KEEP_ALL, limit=1))
        async def take(self, message: Int32) -> None:
            await self.clock.sleep(1.0)

    await rig.start(Talker, Slow)
    talker = rig.node(Talker)
    for value in range(2):
        await talker.out.send(number(value))
    (error,) = from_a_thread(lambda: asyncio.run(talker.out.send(number(3))))
    assert isinstance(error, WrongThread)


async def test_a_foreign_thread_is_refused_and_told_of_threadsafe(rig: Rig) -> None:
    await rig.start(Talker, Collector)
    talker = rig.node(Talker)
    (error,) = from_a_thread(lambda: talker.out(number(1)))
    assert isinstance(error, WrongThread)
    assert "use node.threadsafe(publisher.publish, message)" in str(error)
    for use in (
        lambda: talker.publisher(NUMBERS),
        lambda: talker.subscribe(NUMBERS),
        lambda: talker.on(NUMBERS, print),
        lambda: talker.create_task(asyncio.sleep(0)),
        lambda: talker.stop(),
    ):
        (error,) = from_a_thread(use)
        assert isinstance(error, WrongThread)
        assert "/talker was used from a foreign thread: use node.threadsafe(function, *arguments)" in str(error)
    await rig.quiet()
    assert rig.node(Collector).seen == []


async def test_threadsafe_calls_come_in_the_order_of_submission(rig: Rig) -> None:
    await rig.start(Talker, Collector)
    talker = rig.node(Talker)

    def burst() -> None:
        for value in range(100):
            talker.threadsafe(talker.out, number(value))

    assert from_a_thread(burst) == []
    await rig.until(lambda: len(rig.node(Collector).seen) == 100)
    assert rig.node(Collector).seen == list(range(100))


async def test_threadsafe_calls_of_many_threads_at_once_all_come(rig: Rig) -> None:
    await rig.start(Talker)
    talker = rig.node(Talker)
    came: list[int] = []

    def burst() -> None:
        for _ in range(2_000):
            talker.threadsafe(came.append, 1)

    threads = [threading.Thread(target=burst) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        await rig.quiet()
        thread.join()
    await rig.quiet()
    assert len(came) == 8_000


async def test_a_threadsafe_call_that_raises_is_its_nodes_failure_and_loses_no_other_call(rig: Rig) -> None:
    rig.expect_failure(WrongType)
    await rig.start(Talker, Collector)
    talker = rig.node(Talker)

    def work() -> None:
        talker.threadsafe(talker.out, word("no number"))  # type: ignore[arg-type]
        talker.threadsafe(talker.out, number(1))

    assert from_a_thread(work) == []
    await rig.settled()
    assert rig.incarnation(Talker) == 2
    assert rig.node(Collector).seen == [1]
    assert from_a_thread(lambda: rig.node(Talker).threadsafe(rig.node(Talker).out, number(2))) == []
    await rig.quiet()
    assert rig.node(Collector).seen == [1, 2]


async def test_a_threadsafe_call_that_comes_after_its_node_has_ended_is_dropped_with_a_log_line(rig: Rig) -> None:
    await rig.start(Talker)
    talker = rig.node(Talker)
    rig.crash(Talker)
    await rig.settled()
    assert from_a_thread(lambda: talker.threadsafe(talker.out, number(1))) == []
    await rig.quiet()
    assert rig.incarnation(Talker) == 2
    (line,) = events(rig.logs, "failed after the end")
    assert "Ended" in line.fields["error"]


async def test_a_publisher_of_a_node_that_has_ended_refuses(rig: Rig) -> None:
    await rig.start(Talker)
    talker = rig.node(Talker)
    rig.crash(Talker)
    await rig.settled()
    with pytest.raises(Ended, match=r"/talker can no longer publish on /numbers: .* its node has ended"):
        talker.out(number(1))
    for use in (
        lambda: talker.publisher(NUMBERS),
        lambda: talker.subscribe(NUMBERS),
        lambda: talker.on(NUMBERS, print),
    ):
        with pytest.raises(Ended, match=r"/talker, incarnation 1, has ended"):
            use()


async def test_nothing_works_before_the_start(rig: Rig) -> None:
    class Hasty(Node):
        out = publishes(NUMBERS)
        numbers = subscribes(NUMBERS)

    hasty = Hasty()
    assert repr(hasty) == "<Hasty, not started>"
    for use, what in (
        (lambda: hasty.out, r"Hasty\.out: .*publish in on_start or later"),
        (lambda: hasty.numbers, r"Hasty\.numbers: .*read it in on_start or later"),
        (lambda: hasty.fqn, "Hasty has not been started yet"),
        (lambda: hasty.threadsafe(print), "Hasty has not been started yet"),
    ):
        with pytest.raises(NotStarted, match=what):
            use()
    assert Hasty.out is NUMBERS
    assert Hasty.numbers is NUMBERS


# -- handlers --------------------------------------------------------------------------------------------------------


async def test_a_concurrent_handler_runs_in_as_many_tasks_as_it_said_and_no_more(rig: Rig) -> None:
    class Parallel(Node):
        def __init__(self) -> None:
            self.now = self.most = 0
            self.done: list[float] = []

        @NUMBERS.on(concurrent=3)
        async def take(self, message: Int32) -> None:
            self.now += 1
            self.most = max(self.most, self.now)
            await self.clock.sleep(1.0)
            self.now -= 1
            self.done.append(self.clock.now())

    await rig.start(Talker, Parallel)
    for value in range(7):
        rig.node(Talker).out(number(value))
    await rig.advance(5.0)
    assert rig.node(Parallel).most == 3
    assert rig.node(Parallel).done == [1.0] * 3 + [2.0] * 3 + [3.0]


async def test_a_concurrent_handler_may_be_a_plain_function_and_counts_what_it_loses(rig: Rig) -> None:
    class Parallel(Node):
        def __init__(self) -> None:
            self.seen: list[int] = []

        @NUMBERS.on(qos=2, concurrent=1)
        def take(self, message: Int32) -> None:
            self.seen.append(message.data)

    await rig.start(Talker, Parallel)
    for value in range(5):
        rig.node(Talker).out(number(value))
    await rig.quiet()
    assert rig.node(Parallel).seen == [3, 4]
    assert rig.system.graph.topic("/numbers").dropped == 3


async def test_a_concurrent_handler_takes_up_its_messages_again_after_a_restart_in_all_its_tasks(rig: Rig) -> None:
    class Parallel(Node):
        def __init__(self) -> None:
            self.begun: list[tuple[float, int]] = []

        @NUMBERS.on(concurrent=2)
        async def take(self, message: Int32) -> None:
            self.begun.append((self.clock.now(), message.data))
            try:
                await self.clock.sleep(1.0)
            finally:
                await self.clock.sleep(0.5)

    await rig.start(Talker, Parallel)
    for value in range(6):
        rig.node(Talker).out(number(value))
    await rig.advance(0.25)
    assert rig.node(Parallel).begun == [(0.0, 0), (0.0, 1)]
    rig.crash(Parallel)
    await rig.settled()
    assert rig.now == 1.25  # two half seconds of clean-up, one after the other
    await rig.advance(10.0)
    assert rig.node(Parallel).begun == [(1.25, 2), (1.25, 3), (2.75, 4), (2.75, 5)]


async def test_one_handler_may_listen_to_two_topics(rig: Rig) -> None:
    rig.expect_failure(ValueError)
    left, right = Topic(Int32, "left"), Topic(Int32, "right")

    class Both(Node):
        def __init__(self) -> None:
            self.seen: list[int] = []

        @left.on()
        @right.on()
        async def take(self, message: Int32) -> None:
            if message.data < 0:
                raise ValueError
            self.seen.append(message.data)

    await rig.start(Both)
    rig.publish(left, number(1))
    rig.publish(right, number(2))
    await rig.quiet()
    assert rig.node(Both).seen == [1, 2]
    rig.publish(left, number(-1))
    rig.publish(right, number(4))
    await rig.settled()
    assert rig.node(Both).seen == [4]


async def test_handlers_added_while_running_each_get_everything_and_keep_their_messages_over_a_restart(
    rig: Rig,
) -> None:
    rig.expect_failure(ValueError)

    class Late(Node):
        async def on_start(self) -> None:
            self.seen: list[tuple[str, int]] = []
            for name in ("a", "b"):
                self.on(NUMBERS, partial(self.take, name))

        def take(self, name: str, message: Int32) -> None:
            if message.data < 0:
                raise ValueError
            self.seen.append((name, message.data))

    await rig.start(Talker, Late)
    out = rig.node(Talker).out
    out(number(1))
    await rig.quiet()
    assert rig.node(Late).seen == [("a", 1), ("b", 1)]
    out(number(-1))
    out(number(2))
    await rig.settled()
    assert rig.incarnation(Late) == 3  # both handlers met the negative number, one life each
    assert rig.node(Late).seen == [("a", 2), ("b", 2)]
    assert out.subscription_count == 2


async def test_a_handler_that_the_next_life_does_not_add_any_more_is_forgotten_with_its_messages(rig: Rig) -> None:
    rig.expect_failure(ValueError)

    class Fickle(Node):
        seen: list[tuple[int, int]] = []

        async def on_start(self) -> None:
            if self.incarnation == 1:
                self.on(NUMBERS, self.take)

        async def take(self, message: Int32) -> None:
            if message.data < 0:
                raise ValueError
            self.seen.append((self.incarnation, message.data))

    await rig.start(Talker, Fickle)
    for value in (1, -1, 2):
        rig.node(Talker).out(number(value))
    await rig.settled()
    assert rig.node(Fickle).seen == [(1, 1)]
    assert rig.node(Talker).out.subscription_count == 0


# -- time ------------------------------------------------------------------------------------------------------------


async def test_periodic_callbacks_do_not_drift(rig: Rig) -> None:
    class Busy(Node):
        def __init__(self) -> None:
            self.ticks: list[float] = []

        @every(period=0.1)
        async def tick(self) -> None:
            self.ticks.append(self.clock.now())
            await self.clock.sleep(0.03)

    await rig.start(Busy)
    await rig.advance(30.0)
    assert rig.node(Busy).ticks == pytest.approx([0.1 * k for k in range(1, 301)], abs=2e-9)


async def test_stamps_follow_the_clock_of_the_system(rig: Rig) -> None:
    await rig.start(Talker)
    await rig.advance(12.5)
    stamp = rig.node(Talker).clock.stamp()
    assert (stamp.sec, stamp.nanosec) == (12, 500_000_000)


async def test_the_second_reader_of_a_mismatch_in_another_node_is_reported_too(rig: Rig) -> None:
    best_effort = Topic(Int32, "numbers", qos.SENSOR_DATA)
    await rig.start(Supervisor("system", children=[Child(Collector, name="one"), Child(Collector, name="two")]))
    rig.me.publisher(best_effort)
    assert [record.node for record in events(rig.logs, "offering incompatible QoS")] == ["/one", "/two"]


async def test_of_ten_commands_that_come_while_a_reader_of_depth_1_is_busy_the_newest_is_next(rig: Rig) -> None:
    class Driver(Node):
        def __init__(self) -> None:
            self.taken: list[int] = []

        @NUMBERS.on(qos=1)
        async def drive(self, message: Int32) -> None:
            self.taken.append(message.data)
            await self.clock.sleep(1.0)

    await rig.start(Driver)
    for value in range(10):
        rig.publish(NUMBERS, Int32(data=value))
        await rig.quiet()
    await rig.advance(5.0)
    assert rig.node(Driver).taken == [0, 9]


async def test_a_wait_on_a_misspelt_topic_tells_the_nearest_on_which_somebody_publishes(rig: Rig) -> None:
    await rig.start(Talker)
    for asked in ("numbes", "/spot1/numbers"):
        with pytest.raises(CallTimeout, match=r"\(0 matching publishers in this system\); did you mean '/numbers'\?$"):
            await rig.me.subscribe(Topic(Int32, asked)).next(timeout=1.0)
    for asked in ("numbers", "quite_different"):
        with pytest.raises(CallTimeout, match=r"matching publishers in this system\)$"):
            await rig.me.subscribe(Topic(Int32, asked)).next(timeout=1.0)
