"""Filters beyond the vectors: callbacks and streams, what is refused, what is counted, and nodes on the virtual clock."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

from actors import Child, Node, Supervisor, Topic, background, every, open_node
from actors.interfaces.geometry_msgs.msg import Point, PointStamped
from actors.interfaces.sensor_msgs.msg import JointState
from actors.interfaces.std_msgs.msg import Header, String
from actors.message_filters import (
    ApproximateTime,
    ApproximateTimeSynchronizer,
    Cache,
    Chain,
    DeltaFilter,
    InputAligner,
    PassThrough,
    QueueStatus,
    SimpleFilter,
    Subscriber,
    TimeSequencer,
    TimeSynchronizer,
)
from actors.testing import Rig
from actors.time import Time, stamp_of

LEFT = Topic(PointStamped, "left")
RIGHT = Topic(PointStamped, "right")
WORDS = Topic(String, "words")


def point(seconds: float) -> PointStamped:
    return PointStamped(header=Header(stamp=stamp_of(round(seconds * 1e9))))


def seconds_of(message: Any) -> float:
    return round(message.header.stamp.sec + message.header.stamp.nanosec * 1e-9, 9)


# -- callbacks and streams --------------------------------------------------------------------------------------------------------


def test_callbacks_are_called_in_order_with_their_arguments_until_they_are_disconnected() -> None:
    source, heard = SimpleFilter[str](), list[tuple[Any, ...]]()
    first = source.register_callback(lambda *given: heard.append(given), 1)
    source.registerCallback(lambda *given: heard.append(given), 2, "b")
    source.signalMessage("x")
    first.disconnect()
    first.disconnect()
    source.signal_message("y")
    assert heard == [("x", 1), ("x", 2, "b"), ("y", 2, "b")]


def test_a_callback_that_would_wait_is_refused_with_the_remedy() -> None:
    async def slow(message: str) -> None: ...

    with pytest.raises(TypeError, match=r"slow\): a callback of a filter is a plain function.*async for"):
        SimpleFilter[str]().register_callback(slow)


async def test_a_stream_gets_what_comes_from_its_creation_on_and_keeps_the_last() -> None:
    source = SimpleFilter[int]()
    source.signal_message(0)
    async with source.stream(depth=2) as stream:
        for number in (1, 2, 3):
            source.signal_message(number)
        assert stream.dropped == 1
        assert [await anext(stream), await anext(stream)] == [2, 3]
        later = asyncio.create_task(anext(stream))
        await asyncio.sleep(0)
        source.signal_message(4)
        assert await later == 4
    source.signal_message(5)  # it is closed
    assert [item async for item in stream] == []


async def test_what_waited_when_a_filter_was_closed_can_still_be_read() -> None:
    source = PassThrough[int]()
    stream = aiter(PassThrough(source))  # a second filter, which is closed by the first
    chained = PassThrough(source).stream()
    del stream
    source.add(1)
    source.close()
    source.close()
    assert [item async for item in chained] == [1]
    assert [item async for item in source] == []  # one that is made too late is closed from the beginning


async def test_a_stream_that_nobody_holds_any_more_is_forgotten() -> None:
    source = SimpleFilter[int]()
    stream = source.stream()
    assert len(source._streams) == 1
    del stream
    assert len(source._streams) == 0


def test_a_stream_keeps_at_least_one_item() -> None:
    with pytest.raises(ValueError, match="at least one"):
        SimpleFilter[int]().stream(depth=0)


async def test_sets_are_iterated_as_tuples() -> None:
    left, right = SimpleFilter[PointStamped](), SimpleFilter[PointStamped]()
    pairs = TimeSynchronizer([left, right], 5).stream()
    for seconds in (1.0, 2.0):
        left.signal_message(point(seconds))
        right.signal_message(point(seconds))
    left.close()
    assert [(seconds_of(a), seconds_of(b)) async for a, b in pairs] == [(1.0, 1.0), (2.0, 2.0)]


# -- inputs and chains ------------------------------------------------------------------------------------------------------------


def test_a_filter_has_one_input_the_last_that_was_given() -> None:
    first, second = PassThrough[int](), PassThrough[int]()
    end = PassThrough(first)
    heard = list[int]()
    end.register_callback(heard.append)
    end.connect_input(second)
    first.add(1)
    second.add(2)
    assert heard == [2]


async def test_a_chain_is_its_filters_in_a_row_also_while_it_grows() -> None:
    class Plus(PassThrough[int]):
        def add(self, message: int) -> None:
            self.signal_message(message + 1)

    class Double(PassThrough[int]):
        def add(self, message: int) -> None:
            self.signal_message(message * 2)

    heard, source = list[int](), PassThrough[int]()
    chain = Chain[int]()
    chain.register_callback(heard.append)
    chain.add(7)
    assert repr(chain) == "<Chain of nothing>"
    assert chain.add_filter(Plus()) == 0
    chain.add(7)
    assert chain.add_filter(Double()) == 1
    chain.connect_input(source)
    source.add(7)
    assert heard == [7, 8, 16]
    assert isinstance(chain.get_filter(1), Double) and repr(chain) == "<Chain of Plus, Double>"
    assert repr(Chain(Plus(), Double())) == "<Chain of Plus, Double>"
    with pytest.raises(IndexError):
        chain.get_filter(2)
    stream = chain.stream()
    source.close()
    assert [item async for item in stream] == []


# -- cache ------------------------------------------------------------------------------------------------------------------------


def test_a_cache_tells_its_first_and_last_and_passes_everything_on() -> None:
    source, heard = PassThrough[PointStamped](), list[PointStamped]()
    cache = Cache(source, 2)
    cache.register_callback(heard.append)
    assert (cache.get_oldest_time(), cache.get_latest_time(), cache.get_last()) == (None, None, None)
    assert cache.get_elem_before_time(Time(seconds=1)) is None and cache.get_elem_after_time(Time(seconds=1)) is None
    for seconds in (3.0, 1.0, 2.0):
        source.add(point(seconds))
    oldest, latest, last = cache.get_oldest_time(), cache.get_latest_time(), cache.get_last()
    assert oldest is not None and oldest.seconds == 2.0
    assert latest is not None and latest.seconds == 3.0
    assert last is not None and seconds_of(last) == 3.0
    assert (len(heard), len(cache), repr(cache)) == (3, 2, "<Cache of 2 of 2 messages>")
    with pytest.raises(ValueError, match="at least one message"):
        Cache[PointStamped](cache_size=0)


async def test_messages_without_a_header_are_refused_or_stamped_at_their_arrival(rig: Rig) -> None:
    with pytest.raises(TypeError, match=r"String has no header.*allow_headerless=self\.clock"):
        Cache[String]().add(String())
    system = await rig.start(Supervisor("empty", children=[]))
    cache = Cache[String](cache_size=5, allow_headerless=system.clock)
    for _ in range(3):
        await rig.advance(1.0)
        cache.add(String(data=f"{rig.now:.0f}"))
    assert [one.data for one in cache.get_interval(Time(seconds=1.5), Time(seconds=9))] == ["2", "3"]


# -- synchronizers ----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", [TimeSynchronizer, ApproximateTime])
def test_a_synchronizer_needs_two_inputs_and_a_queue(kind: type[Any]) -> None:
    with pytest.raises(ValueError, match="of 1 inputs with queue_size=5: it takes a list of two inputs or more"):
        kind([SimpleFilter()], 5)
    with pytest.raises(ValueError, match="queue_size=0"):
        kind([SimpleFilter(), SimpleFilter()], 0)


def test_a_slop_of_nothing_and_negative_bounds_are_refused() -> None:
    inputs = [SimpleFilter[Any](), SimpleFilter[Any]()]
    with pytest.raises(ValueError, match="give a time above 0"):
        ApproximateTimeSynchronizer(inputs, 5, 0.0)
    for options in ({"age_penalty": -0.1}, {"lower_bounds": {0: -1.0}}, {"max_interval": -1.0}):
        with pytest.raises(ValueError, match="not negative"):
            ApproximateTime(inputs, 5, **options)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="of the inputs 0 to 1"):
        ApproximateTime(inputs, 5, lower_bounds={2: 1.0})


def test_what_leaves_a_full_queue_is_counted() -> None:
    exact = TimeSynchronizer([SimpleFilter[Any](), SimpleFilter[Any]()], 2)
    near = ApproximateTime([SimpleFilter[Any](), SimpleFilter[Any]()], 2)
    for sync in (exact, near):
        for seconds in (1.0, 2.0, 3.0, 4.0):
            sync.add(point(seconds), 0)
        assert sync.dropped == 2
    assert repr(exact) == "<TimeSynchronizer of 2 inputs: 2, 0 wait>"
    assert repr(near) == "<ApproximateTime of 2 inputs: 2, 0 wait>"


def test_a_message_of_a_set_that_is_not_yet_known_to_be_best_takes_its_place_in_the_queue() -> None:
    near = ApproximateTime([SimpleFilter[Any](), SimpleFilter[Any](), SimpleFilter[Any]()], 3)
    for seconds, number in (
        (1.0, 0),
        (1.02, 1),
        (1.4, 2),
    ):  # a candidate: the second input may still have something later
        near.add(point(seconds), number)
    for seconds in (1.5, 1.6):
        near.add(point(seconds), 0)
    assert (near.dropped, repr(near)) == (0, "<ApproximateTime of 3 inputs: 3, 1, 1 wait>")
    near.add(point(1.7), 0)
    assert near.dropped == 1


def test_messages_closer_than_the_bound_or_out_of_order_are_counted() -> None:
    near = ApproximateTime([SimpleFilter[Any](), SimpleFilter[Any]()], 10, lower_bounds={0: 1.0})
    for seconds in (1.0, 2.0, 2.5, 2.2):
        near.add(point(seconds), 0)
    assert near.closer_than_bound == 2
    aside = ApproximateTime([SimpleFilter[Any](), SimpleFilter[Any]()], 10, lower_bounds={0: 0.25})
    aside.add(point(1.0), 0)
    aside.add(point(1.3), 1)  # a candidate: 1.0 waits no more for another, but is not let through yet
    aside.add(point(1.2), 0)
    assert aside.closer_than_bound == 1


def test_sets_longer_than_the_longest_are_not_made() -> None:
    near = ApproximateTime([SimpleFilter[Any](), SimpleFilter[Any]()], 10, max_interval=0.5)
    came: list[tuple[float, float]] = []
    near.register_callback(lambda a, b: came.append((seconds_of(a), seconds_of(b))))
    for index, seconds in ((0, 1.0), (1, 2.0), (0, 3.0), (1, 3.2), (0, 5.0), (1, 5.0)):
        near.add(point(seconds), index)
    assert came == [(3.0, 3.2), (5.0, 5.0)]


def test_a_smaller_penalty_prefers_the_later_set_of_the_same_length() -> None:
    came: dict[float, list[tuple[float, float]]] = {0.0: [], 2.0: []}
    for penalty, sets in came.items():
        near = ApproximateTime([SimpleFilter[Any](), SimpleFilter[Any]()], 10, age_penalty=penalty)
        near.register_callback(lambda a, b, sets=sets: sets.append((seconds_of(a), seconds_of(b))))
        for index, seconds in ((0, 0.0), (1, 1.0), (0, 1.7), (1, 4.0), (0, 4.0)):
            near.add(point(seconds), index)
    assert came[0.0][0] == (1.7, 1.0)
    assert came[2.0][0] == (0.0, 1.0)


# -- nodes on the virtual clock ---------------------------------------------------------------------------------------------------


class Eyes(Node):
    """Two cameras: the right one 20 ms after the left one."""

    async def on_start(self) -> None:
        self.left, self.right = self.publisher(LEFT), self.publisher(RIGHT)

    @every(hz=10)
    async def look(self) -> None:
        self.left(PointStamped(header=Header(stamp=self.clock.stamp())))
        await self.clock.sleep(0.02)
        self.right(PointStamped(header=Header(stamp=self.clock.stamp())))


class Stereo(Node):
    async def on_start(self) -> None:
        left, right = Subscriber(self, LEFT), Subscriber(self, RIGHT)
        self.pairs = ApproximateTimeSynchronizer([left, right], queue_size=5, slop=0.05)
        self.called: list[float] = []
        self.pairs.register_callback(lambda a, b: self.called.append(seconds_of(b) - seconds_of(a)))
        self.seen: list[float] = []
        assert repr(left) == "<Subscriber of left>"

    @background
    async def pair(self) -> None:
        async for a, b in self.pairs:
            self.seen.append(seconds_of(b) - seconds_of(a))


async def test_pairs_of_two_topics_come_to_callbacks_and_tasks(rig: Rig) -> None:
    await rig.start(Supervisor("head", children=[Child(Stereo), Child(Eyes)]))
    await rig.advance(1.055)
    stereo = rig.node(Stereo)
    assert stereo.seen == stereo.called == pytest.approx([0.02] * len(stereo.called))
    assert len(stereo.called) == 10


class Ordered(Node):
    async def on_start(self) -> None:
        self.out: list[tuple[float, float]] = []
        self.sequencer = TimeSequencer(self, Subscriber(self, LEFT), delay=0.25, update_rate=0.01, queue_size=3)
        self.sequencer.register_callback(lambda message: self.out.append((self.clock.now(), seconds_of(message))))


async def test_a_sequencer_brings_messages_into_order_a_delay_later(rig: Rig) -> None:
    await rig.start(Supervisor("line", children=[Child(Ordered)]))
    await rig.advance(1.0)
    for seconds in (1.0, 0.98, 0.99):
        rig.publish(LEFT, point(seconds))
    await rig.advance(0.1)
    ordered = rig.node(Ordered)
    assert ordered.out == [] and repr(ordered.sequencer) == "<TimeSequencer of /ordered: 3 wait>"
    await rig.advance(1.0)
    assert [stamp for _, stamp in ordered.out] == [0.98, 0.99, 1.0]
    assert all(0.25 - 1e-9 <= now - stamp <= 0.26 + 1e-9 for now, stamp in ordered.out)
    rig.publish(LEFT, point(0.5))  # older than what was let through
    for seconds in (5.0, 5.1, 5.2, 5.3):  # the queue holds three
        rig.publish(LEFT, point(seconds))
    await rig.advance(6.0)
    assert [stamp for _, stamp in ordered.out[3:]] == [5.1, 5.2, 5.3]
    assert ordered.sequencer.dropped == 2
    with pytest.raises(ValueError, match="update_rate is a time above 0"):
        TimeSequencer(ordered, delay=0.1, update_rate=0.0)


class Aligned(Node):
    async def on_start(self) -> None:
        self.out: list[float] = []
        inputs = [Subscriber(self, LEFT), Subscriber(self, RIGHT)]
        self.aligner = InputAligner(inputs, timeout=1.0, periods={0: 0.1, 1: 0.1}, node=self, update_rate=0.01)
        for output in self.aligner.outputs:
            output.register_callback(lambda message: self.out.append(seconds_of(message)))


async def test_an_aligner_with_a_node_dispatches_by_itself(rig: Rig) -> None:
    await rig.start(Supervisor("line", children=[Child(Aligned)]))
    rig.publish(RIGHT, point(1.05))
    rig.publish(LEFT, point(1.0))
    await rig.advance(0.02)
    aligned = rig.node(Aligned)
    assert aligned.out == [1.0, 1.05]
    assert repr(aligned.aligner) == "<InputAligner of 2 inputs: 0, 0 wait>"


def test_an_aligner_tells_the_state_of_its_inputs() -> None:
    inputs = [SimpleFilter[PointStamped](), SimpleFilter[PointStamped]()]
    aligner = InputAligner(inputs, timeout=0.01, periods={0: 0.002, 1: 0.002})
    for index, milliseconds in ((1, 2), (0, 3), (0, 5)):
        inputs[index].signal_message(point(milliseconds * 1e-3))
    assert aligner.get_queue_status(0) == QueueStatus(False, 2, 0, 0)
    assert aligner.get_queue_status(1) == QueueStatus(False, 1, 0, 0)
    aligner.dispatch_messages()
    assert aligner.get_queue_status(0) == QueueStatus(True, 1, 1, 0)
    assert aligner.get_queue_status(1) == QueueStatus(True, 0, 1, 0)
    for milliseconds in (1, 17):  # too late, and so far ahead that the other input is given up
        inputs[0].signal_message(point(milliseconds * 1e-3))
    aligner.dispatch_messages()
    assert aligner.get_queue_status(0) == QueueStatus(True, 0, 3, 1)
    assert aligner.get_queue_status(1) == QueueStatus(False, 0, 1, 0)
    with pytest.raises(ValueError, match="the rate a time above 0"):
        InputAligner(inputs, timeout=1.0, update_rate=0.0)


async def test_streams_end_with_the_node_that_feeds_them() -> None:
    async with open_node("listener") as node:
        words = aiter(Subscriber(node, WORDS))
        waiting = asyncio.create_task(anext(words, None))
        await asyncio.sleep(0)
    assert await waiting is None


async def test_an_exception_of_a_callback_is_the_nodes_failure(rig: Rig) -> None:
    class Fragile(Node):
        async def on_start(self) -> None:
            Subscriber(self, WORDS).register_callback(lambda message: 1 / 0)

    system = await rig.start(Supervisor("glass", children=[Child(Fragile)]))
    rig.expect_failure(ZeroDivisionError)
    rig.publish(WORDS, String())
    await rig.until(lambda: rig.incarnation(Fragile) == 2)
    assert any("ZeroDivisionError" in str(record) for record in system.records)


async def test_a_subscriber_that_is_closed_gives_back_its_subscription_and_is_silent(rig: Rig) -> None:
    """What a lifecycle node does whenever it is deactivated; or else each activation would hear everything once more."""
    await rig.start(Node)
    heard: list[Any] = []
    for _ in range(3):
        left, right = Subscriber(rig.me, LEFT), Subscriber(rig.me, RIGHT)
        pairs = TimeSynchronizer([left, right], 10)
        pairs.register_callback(lambda *pair: heard.append(pair))
        stream = pairs.stream()
        rig.publish(LEFT, point(1.0))
        rig.publish(RIGHT, point(1.0))
        rig.publish(LEFT, point(2.0))
        await rig.quiet()
        left.close()
        left.close()
        right.close()
        right.signal_message(point(2.0))
        assert [item async for item in stream] == [(point(1.0), point(1.0))]
    assert len(heard) == 3
    assert not rig.system.graph.topics["/left"].subscriptions


# -- messages that differ ---------------------------------------------------------------------------------------------------------


def passed(delta: DeltaFilter[Any], *messages: Any) -> list[Any]:
    heard: list[Any] = []
    delta.register_callback(heard.append)
    for message in messages:
        delta.add(message)
    return heard


def placed(x: float, frame: str = "map") -> PointStamped:
    return PointStamped(header=Header(frame_id=frame), point=Point(x=x))


def test_a_message_passes_when_a_field_differs_from_that_of_the_last_that_passed() -> None:
    messages = placed(1.0), placed(1.0), placed(2.0), placed(2.0, "odom"), placed(1.0, "odom")
    assert passed(DeltaFilter(["point.x"]), *messages) == [messages[0], messages[2], messages[4]]
    both = DeltaFilter[PointStamped](["point.x", lambda message: message.header.frame_id])
    assert passed(both, *messages) == [messages[0], *messages[2:]]


def test_what_counts_as_a_difference_may_be_said_and_small_steps_add_up() -> None:
    messages = [placed(x / 10) for x in range(10)]
    coarse = DeltaFilter[PointStamped](["point.x"], differs=lambda before, after: abs(after - before) > 0.25)
    assert [message.point.x for message in passed(coarse, *messages)] == [0.0, 0.3, 0.6, 0.9]


def test_arrays_and_messages_are_compared_as_a_whole() -> None:
    states = [JointState(position=position) for position in ([1.0], [1.0], [1.0, 2.0], [1.0, 3.0], [1.0, 3.0])]
    assert passed(DeltaFilter(["position"]), *states) == [states[0], states[2], states[3]]
    assert passed(DeltaFilter(["point"]), placed(1.0), placed(1.0, "odom"), placed(2.0)) == [placed(1.0), placed(2.0)]


def test_a_delta_filter_is_fed_by_another_and_refuses_what_it_cannot_compare() -> None:
    source = SimpleFilter[PointStamped]()
    delta = DeltaFilter(["point.x"], source)
    heard: list[PointStamped] = []
    delta.register_callback(heard.append)
    source.signal_message(placed(1.0))
    assert heard == [placed(1.0)] and repr(delta) == "<DeltaFilter of 1 fields>"
    with pytest.raises(AttributeError, match="poin"):
        passed(DeltaFilter(["poin.x"]), placed(1.0))
    with pytest.raises(ValueError, match="give at least one"):
        DeltaFilter([])


def test_the_names_of_rclpy_are_there() -> None:
    cache = Cache[PointStamped](cache_size=3)
    source = SimpleFilter[PointStamped]()
    cache.connectInput(source)
    for seconds in (1.0, 2.0, 3.0):
        source.signalMessage(point(seconds))
    assert [seconds_of(one) for one in cache.getInterval(Time(seconds=1), Time(seconds=2))] == [1.0, 2.0]
    assert cache.getElemAfterTime(Time(seconds=1.5)) == point(2.0) == cache.getElemBeforeTime(Time(seconds=2.5))
    assert (cache.getOldestTime(), cache.getLatestTime()) == (cache.get_oldest_time(), cache.get_latest_time())
    assert cache.getLast() == point(3.0)
    chain = Chain[PointStamped]()
    delta = DeltaFilter[PointStamped](["header"])
    assert chain.addFilter(delta) == 0 and chain.getFilter(0) is delta
    chain.connectInput(source)
    heard = list[PointStamped]()
    chain.registerCallback(heard.append)
    source.signalMessage(point(4.0))
    assert heard == [point(4.0)]
