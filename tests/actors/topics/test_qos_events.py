"""What quality of service tells nodes: who fits, who is late, who is silent, what was lost, what was too old."""

from __future__ import annotations

import asyncio

import pytest

from actors import Child, DeclarationError, Node, QoS, Supervisor, Topic, background, every, publishes, qos
from actors.errors import Ended
from actors.interfaces.rcl_interfaces.msg import Log
from actors.interfaces.std_msgs.msg import Int32
from actors.qos.events import (
    DeadlineMissed,
    IncompatibleQoS,
    IncompatibleType,
    LivelinessChanged,
    LivelinessLost,
    Matched,
    MessageLost,
    PublisherEvent,
    SubscriptionEvent,
)
from actors.qos.policies import Durability, History, Liveliness
from actors.runtime import standard as derived
from actors.testing import Probe, Rig
from tests.facts import lacks
from tests.stage import NUMBERS, events, number

CAMERA = Topic(Int32, "camera", QoS(depth=5, deadline=0.1))
HEARTBEAT = Topic(Int32, "heartbeat", QoS(depth=1, liveliness=Liveliness.MANUAL_BY_TOPIC, liveliness_lease=0.5))
COMMAND = Topic(Int32, "command", QoS(depth=10, lifespan=0.5))


class Camera(Node):
    """Publishes at 10 Hz until its lens is covered."""

    out = publishes(CAMERA)
    covered = False

    @every(hz=10)
    async def shoot(self) -> None:
        if not self.covered:
            self.out(number(1))


class Watcher(Node):
    """Takes pictures, and notes what its subscription tells of them."""

    def __init__(self) -> None:
        self.pictures = 0
        self.told: list[tuple[float, SubscriptionEvent]] = []

    @CAMERA.on()
    async def look(self, picture: Int32) -> None:
        self.pictures += 1

    @background
    async def watch(self) -> None:
        async for event in self.subscription(CAMERA).events():
            self.told.append((round(self.clock.now(), 6), event))


# -- who fits ---------------------------------------------------------------------------------------------------------------


async def test_an_incompatible_pair_hears_of_it_on_both_sides_and_the_log_says_once_what_to_change(
    rig: Rig,
) -> None:
    class Sensor(Node):
        out = publishes(Topic(Int32, "numbers", qos.SENSOR_DATA))

        def __init__(self) -> None:
            self.told: list[PublisherEvent] = []

        @background
        async def watch(self) -> None:
            async for event in self.out.events():
                self.told.append(event)

    class Strict(Node):
        @NUMBERS.on()
        async def take(self, message: Int32) -> None:
            raise AssertionError("nothing may arrive")

    await rig.start(Sensor, Child(Strict, name="first"), Child(Strict, name="second"))
    dynamic = rig.me.subscribe(NUMBERS)
    await rig.quiet()
    sensor = rig.node(Sensor)
    assert sensor.out.status.incompatible_qos == 3
    assert sensor.told == [IncompatibleQoS(count, 1, last_policy_kind="RELIABILITY") for count in (1, 2, 3)]
    for status in (rig.system.runtime.directory.find("/first").node.subscription(NUMBERS).status, dynamic.status):  # type: ignore[union-attr]
        assert (status.incompatible_qos, status.last_policy_kind, status.matched) == (1, "RELIABILITY", 0)
    told = events(rig.logs, "incompatible QoS")
    assert [record.node for record in told] == ["/sensor", "/first", "/sensor", "/second", "/sensor", "/rig"]
    (remedy,) = {record.fields["remedy"] for record in told}
    assert lacks(remedy, "publisher reliability=reliable subscription reliability=best_effort") == []
    assert {record.fields["why"] for record in told} == {
        "the publisher offers less than the subscription requests: reliability (offered best_effort, requested reliable)"
    }


async def test_a_reliable_publisher_serves_a_best_effort_reader_without_a_word(rig: Rig) -> None:
    await rig.start(Camera)
    out, easy = rig.me.publisher(NUMBERS), rig.me.subscribe(NUMBERS, qos=qos.SENSOR_DATA)
    out(number(1))
    assert (await easy.next()).data == 1
    assert events(rig.logs, "incompatible") == []
    assert (out.status.incompatible_qos, easy.status.incompatible_qos) == (0, 0)


async def test_another_type_under_the_same_name_is_an_event_of_its_own(rig: Rig) -> None:
    from actors.interfaces.std_msgs.msg import String

    await rig.start(Camera)
    out = rig.me.publisher(NUMBERS)
    told = out.events()
    other = rig.me.subscribe(Topic(String, "numbers"))
    assert told.take() == [IncompatibleType(1, 1)]
    assert (out.status.incompatible_type, other.status.incompatible_type) == (1, 1)


async def test_a_publisher_knows_its_readers_through_their_restarts(rig: Rig) -> None:
    await rig.start(Camera, Watcher)
    told = rig.node(Camera).out.events()
    heard = rig.node(Watcher).subscription(CAMERA)
    rig.crash(Watcher)
    await rig.settled()
    assert told.take() == []  # a queue waits for its reader's next life
    assert rig.node(Watcher).subscription(CAMERA) is heard
    rig.crash(Camera)
    await rig.settled()
    with pytest.raises(Ended):
        await told.next()
    assert [event for _, event in rig.node(Watcher).told] == [
        Matched(1, 0, 0, -1),
        LivelinessChanged(0, -1, 0, 0),
        Matched(2, 1, 1, 1),
        LivelinessChanged(1, 1, 0, 0),
    ]
    assert heard.status.matched_total == 2


async def test_a_handler_is_asked_for_by_its_topic(rig: Rig) -> None:
    await rig.start(Child(Watcher, remap={"camera": "/front/camera"}))
    watcher = rig.node(Watcher)
    assert watcher.subscription(CAMERA).entry.name == "/front/camera"
    with pytest.raises(DeclarationError, match=r"/watcher has no handler of /numbers: declare one with @Topic"):
        watcher.subscription(NUMBERS)


# -- who is late ------------------------------------------------------------------------------------------------------------


async def test_a_camera_that_falls_silent_is_missed_once_each_deadline_on_both_sides(rig: Rig) -> None:
    await rig.start(Watcher, Camera)
    camera, watcher = rig.node(Camera), rig.node(Watcher)
    await rig.advance(2.0)
    assert watcher.pictures == 20
    assert (camera.out.status.deadline_missed, watcher.subscription(CAMERA).status.deadline_missed) == (0, 0)
    camera.covered = True
    await rig.advance(0.35)
    missed = [(at, event) for at, event in watcher.told if isinstance(event, DeadlineMissed)]
    assert missed == [(2.1, DeadlineMissed(1, 1)), (2.2, DeadlineMissed(2, 1)), (2.3, DeadlineMissed(3, 1))]
    camera.covered = False
    await rig.advance(1.0)
    assert camera.out.status.deadline_missed == watcher.subscription(CAMERA).status.deadline_missed == 3


async def test_a_listener_that_is_busy_gets_what_it_missed_as_one_event(rig: Rig) -> None:
    await rig.start(Camera)
    stream = rig.me.subscribe(CAMERA)
    told = stream.events()
    rig.node(Camera).covered = True
    await rig.advance(1.05)
    assert told.take() == [DeadlineMissed(10, 10)]
    assert await told.next(timeout=0.1) == DeadlineMissed(11, 1)


# -- who is silent ----------------------------------------------------------------------------------------------------------


async def test_a_heartbeat_that_stops_is_lost_and_a_word_brings_it_back(rig: Rig) -> None:
    class Planner(Node):
        beat = publishes(HEARTBEAT)
        stuck = False

        @every(hz=5)
        async def think(self) -> None:
            if not self.stuck:
                self.beat.assert_liveliness()

    class Guard(Node):
        def __init__(self) -> None:
            self.story: list[tuple[float, str]] = []

        async def on_start(self) -> None:
            self.create_task(self.guard())

        async def guard(self) -> None:
            async for event in self.subscribe(HEARTBEAT).events():
                if isinstance(event, LivelinessChanged):
                    word = "stop" if event.not_alive_count else "go"
                    self.story.append((round(self.clock.now(), 6), word))

    await rig.start(Guard, Planner)
    planner = rig.node(Planner)
    lost = planner.beat.events()
    await rig.advance(3.0)
    planner.stuck = True
    await rig.advance(2.0)
    planner.stuck = False
    await rig.advance(1.0)
    assert rig.node(Guard).story == [(0.0, "go"), (3.5, "stop"), (5.2, "go")]
    assert lost.take() == [LivelinessLost(1, 1)]


# -- what was lost ----------------------------------------------------------------------------------------------------------


async def test_a_reader_that_is_too_slow_hears_how_much_it_loses(rig: Rig) -> None:
    class Processor(Node):
        """Needs 50 ms for a picture that comes every 33."""

        @NUMBERS.on(qos=5)
        async def work(self, message: Int32) -> None:
            await self.clock.sleep(0.05)

    class Sensor(Node):
        out = publishes(NUMBERS)

        @every(hz=30)
        async def sample(self) -> None:
            self.out(number(1))

    await rig.start(Processor, Sensor)
    feed = rig.node(Processor).subscription(NUMBERS)
    told = feed.events()
    await rig.advance(10.0)
    (lost,) = told.take()
    assert isinstance(lost, MessageLost)
    assert lost.total_count == lost.total_count_change == feed.dropped
    assert 90 <= lost.total_count <= 100  # 10 a second, once the queue is full
    assert feed.publisher_count == 1


# -- what was too old -------------------------------------------------------------------------------------------------------


async def test_a_command_that_waited_for_a_restart_too_long_is_not_obeyed(rig: Rig) -> None:
    class Legs(Node):
        obeyed: list[tuple[int, int]]

        async def on_start(self) -> None:
            self.obeyed = []
            await self.clock.sleep(1.0 if self.incarnation > 1 else 0.0)

        @COMMAND.on()
        async def obey(self, command: Int32) -> None:
            self.obeyed.append((self.incarnation, command.data))

    await rig.start(Legs)
    out = rig.me.publisher(COMMAND)
    rig.crash(Legs)
    await rig.quiet()
    out(number(1))
    await rig.advance(0.9)
    out(number(2))
    await rig.settled()
    assert rig.node(Legs).obeyed == [(2, 2)]
    assert rig.node(Legs).subscription(COMMAND).dropped == 0


async def test_what_is_latched_with_a_lifespan_reaches_late_joiners_while_it_lasts(rig: Rig) -> None:
    fleeting = Topic(Int32, "fleeting", QoS(depth=3, durability=Durability.TRANSIENT_LOCAL, lifespan=1.0))
    await rig.start(Camera)
    out = rig.me.publisher(fleeting)
    for value in range(3):
        out(number(value))
        await rig.advance(0.4)
    late = rig.me.subscribe(fleeting)
    assert [(await late.next()).data for _ in range(2)] == [1, 2]
    assert late.received == 2


async def test_late_listeners_of_rosout_get_what_was_said_in_the_last_ten_seconds(rig: Rig) -> None:
    class Talkative(Node):
        @every(hz=1)
        def talk(self) -> None:
            self.log.info(f"it is {self.clock.now():g}")

    def said(probe: Probe[Log]) -> list[str]:
        return [line.msg for line in probe if line.name == "talkative"]

    assert qos.ROSOUT.lifespan == derived.ROSOUT_SECONDS
    rosout = Topic(Log, "/rosout", qos.ROSOUT)
    await rig.start(Talkative)
    await rig.advance(20.5)
    first = rig.probe(rosout)
    assert said(first) == [f"it is {second}" for second in range(11, 21)]
    await rig.advance(20.0)
    assert said(rig.probe(rosout)) == [f"it is {second}" for second in range(31, 41)]


async def test_a_reader_of_the_log_with_the_profile_for_logs_keeps_the_newest_20_lines_and_hears_nothing_old(
    rig: Rig,
) -> None:
    class Chatty(Node):
        async def on_start(self) -> None:
            self.log.info("before anybody listens")

        @every(hz=1)
        def talk(self) -> None:
            for line in range(30):
                self.log.info(f"line {line}")

    class Reader(Node):
        async def on_start(self) -> None:
            self.lines = self.subscribe(Topic(Log, "/rosout", qos.LOGS))

    await rig.start(Chatty, Reader)
    await rig.advance(1.0)
    log = next(topic for topic in rig.system.snapshot().topics if topic.name == "/rosout")
    assert [edge.qos for edge in log.subscriptions] == ["QoS(keep_last 20, best_effort, volatile, automatic)"]
    lines = rig.node(Reader).lines
    assert lines.dropped == 10
    assert [(await lines.next()).msg for _ in range(20)] == [f"line {line}" for line in range(10, 30)]


async def test_a_sender_is_held_back_by_a_slow_keep_all_handler_and_nothing_is_lost(rig: Rig) -> None:
    everything = Topic(Int32, "everything", QoS(history=History.KEEP_ALL, limit=3))

    class Archive(Node):
        def __init__(self) -> None:
            self.kept: list[int] = []

        @everything.on()
        async def keep(self, message: Int32) -> None:
            await self.clock.sleep(0.1)
            self.kept.append(message.data)

    class Source(Node):
        out = publishes(everything)

        @background
        async def pour(self) -> None:
            for value in range(50):
                await self.out.send(number(value))

    await rig.start(Supervisor("archive", children=[Child(Archive), Child(Source)]))
    await rig.advance(1.05)
    feed = rig.node(Archive).subscription(everything)
    assert (len(rig.node(Archive).kept), len(feed.messages)) == (10, 3)
    await rig.advance(10.0)
    assert rig.node(Archive).kept == list(range(50))
    assert (feed.dropped, feed.status.message_lost) == (0, 0)


async def test_an_event_stream_ends_with_its_node(rig: Rig) -> None:
    await rig.start(Camera)
    told = rig.node(Camera).out.events()
    waiting = asyncio.create_task(anext(told, None))
    rig.crash(Camera)
    await rig.settled()
    assert await waiting is None
