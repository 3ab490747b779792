"""The recorder: what it records, when, and that nothing is lost without being counted."""

from __future__ import annotations

import asyncio
import contextlib
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from actors import Child, Node, StartFailed, Topic, every, publishes, qos, run, temporary
from actors.bag import BagError, BagReader, BagWriter, Recorder, RecordOptions, Selection, WriterOptions, type_of
from actors.bag.ring import Channel
from actors.bag.write_queue import Taken, WriteQueue
from actors.checks import create
from actors.interfaces import decode
from actors.interfaces.rosbag2_interfaces import srv
from actors.interfaces.rosbag2_interfaces.msg import WriteSplitEvent
from actors.interfaces.rosbag2_interfaces.srv import IsPaused, Pause, Resume, Snapshot, SplitBagfile, Stop, TogglePaused
from actors.interfaces.rosgraph_msgs.msg import Clock
from actors.interfaces.sensor_msgs.msg import Image, Imu
from actors.interfaces.std_msgs.msg import Int32, String
from actors.logs import LogRecord
from actors.qos.policies import Reliability
from actors.system import System
from actors.testing import Rig
from actors.time.values import stamp_of
from actors.topics.lazy_message import LazyMessage
from actors.transport.bridge import connect
from tests.actors.bag.bags import by_rosbags, largest_file
from tests.actors.transport.memory import Network
from tests.stage import COUNT, WORDS, events, order, result, step, word

from actors import Done, Service  # isort: skip

FAST = Topic(Imu, "imu", qos.SENSOR_DATA)
MAP = Topic(String, "map", qos.LATCHED)
IMAGE = Topic(Image, "image", qos.SENSOR_DATA)
PICTURE = np.arange(640 * 480 * 3, dtype=np.uint8)
ALL = Selection(all_topics=True)
ONLY = Selection(topics=["/words"])


class Talker(Node):
    words = publishes(WORDS)
    map = publishes(MAP)


class Robot(Node):
    """Publishes a lot, and pictures only while somebody looks."""

    imu = publishes(FAST)
    map = publishes(MAP)
    image = publishes(IMAGE)

    async def on_start(self) -> None:
        self.map(word("the house"))

    @every(hz=400)
    def feel(self) -> None:
        self.imu(Imu(angular_velocity_covariance=np.full(9, self.clock.now())))

    @every(hz=10)
    def look(self) -> None:
        if self.image.subscription_count:
            self.image(Image(height=480, width=640, encoding="rgb8", step=1920, data=PICTURE))


def recorder(path: Path, selection: Selection = ALL, **options: Any) -> Child:
    return Child(Recorder, args=(path, RecordOptions(selection=selection, **options)), restart=temporary)


def read(path: Path) -> dict[str, list[Any]]:
    """The messages of a bag by topic."""
    found: dict[str, list[Any]] = {}
    with BagReader(path) as bag:
        for one in bag.messages():
            found.setdefault(one.topic.name, []).append(decode(type_of(one.topic), one.data))
    return found


def texts(path: Path) -> list[str]:
    return [message.data for message in read(path).get("/words", [])]


async def test_a_minute_of_everything_is_recorded_without_a_loss(rig: Rig, tmp_path: Path) -> None:
    await rig.start(recorder(tmp_path / "walk"), Robot)
    await rig.advance(60.0)
    sent = {name: getattr(rig.node(Robot), name).count for name in ("imu", "map", "image")}
    recording = rig.node(Recorder)
    await rig.stop()
    assert recording.dropped == 0
    counts = {name: len(messages) for name, messages in read(tmp_path / "walk").items()}
    assert counts["/imu"] == sent["imu"] == 24_000
    assert counts["/map"] == 1, "kept by its publisher for those who come later"
    assert counts["/image"] == sent["image"] >= 599
    assert recording.recorded == sum(counts.values())
    assert recording.size == sum(file.stat().st_size for file in (tmp_path / "walk").glob("*.mcap"))
    assert len(by_rosbags(tmp_path / "walk")) == sum(counts.values())


async def test_every_message_has_its_time_and_a_topic_its_quality_of_service(rig: Rig, tmp_path: Path) -> None:
    await rig.start(recorder(tmp_path / "walk"), Talker)
    talker = rig.node(Talker)
    await rig.advance(1.5)
    talker.words(word("one"))
    await rig.advance(2.0)
    talker.words(word("two"))
    await rig.stop()
    with BagReader(tmp_path / "walk") as bag:
        times = [(one.received_ns, one.published_ns) for one in bag.messages(["/words"])]
        (described,) = [topic for topic in bag.topics if topic.name == "/map"]
    assert times == [(1_500_000_000, 1_500_000_000), (3_500_000_000, 3_500_000_000)]
    assert "transient_local" in described.offered_qos_profiles
    assert "/map" in {topic.name for topic in bag.topics}, "also without a message"


async def test_what_appears_later_is_recorded_too_unless_told_not_to(rig: Rig, tmp_path: Path) -> None:
    await rig.start(
        recorder(tmp_path / "a"), Child(Recorder, name="other", args=(tmp_path / "b", RecordOptions(discovery=False)))
    )
    late = rig.me.publisher(WORDS)
    await rig.quiet()
    late(word("late"))
    assert "/words" not in rig.node("other").topics  # type: ignore[attr-defined]
    await rig.stop()
    assert texts(tmp_path / "a") == ["late"]
    assert texts(tmp_path / "b") == []


async def test_log_lines_and_changes_of_parameters_are_recorded_though_nobody_asked_for_them(
    rig: Rig, tmp_path: Path
) -> None:
    await rig.start(recorder(tmp_path / "walk"), Talker)
    await rig.quiet()
    rig.node(Talker).log.info("hello", who="you")
    rig.node(Talker).set_parameter("use_sim_time", False)
    await rig.stop()
    found = read(tmp_path / "walk")
    assert any("hello" in line.msg for line in found["/rosout"])
    assert [event.node for event in found["/parameter_events"]] == ["/talker"]


async def test_a_publisher_that_offers_less_is_recorded_from_its_arrival_on(rig: Rig, tmp_path: Path) -> None:
    await rig.start(recorder(tmp_path / "walk", ONLY), Talker)
    await rig.quiet()
    rig.node(Talker).words(word("reliable"))
    weak = rig.me.publisher(WORDS, qos=qos.SENSOR_DATA)
    await rig.quiet()
    weak(word("weak"))
    rig.node(Talker).words(word("still"))
    strong = rig.me.publisher(WORDS, qos=qos.LATCHED)
    await rig.quiet()
    strong(word("strong"))
    await rig.stop()
    assert texts(tmp_path / "walk") == ["reliable", "weak", "still", "strong"]


async def test_what_was_lost_before_a_publisher_that_offers_less_came_stays_counted(rig: Rig, tmp_path: Path) -> None:
    await rig.start(recorder(tmp_path / "walk", ONLY), Talker)
    recording = rig.node(Recorder)
    (subscription,) = rig.system.graph.topic("/words").subscriptions
    subscription.count_lost(3)  # as a transport tells of a gap in the numbers of a publisher
    assert recording.dropped == 3
    rig.me.publisher(WORDS, qos=qos.SENSOR_DATA)
    await rig.quiet()
    (again,) = rig.system.graph.topic("/words").subscriptions
    assert again is not subscription
    assert recording.dropped == 3
    again.count_lost(2)
    assert recording.dropped == 5
    await rig.stop()
    assert recording.dropped == 5


async def test_what_is_requested_of_a_topic_may_be_told(rig: Rig, tmp_path: Path) -> None:
    asked = qos.DEFAULT.replace(reliability=Reliability.BEST_EFFORT, depth=7)
    await rig.start(recorder(tmp_path / "walk", ONLY, qos={"/words": asked}), Talker)
    (subscription,) = rig.system.graph.topic("/words").subscriptions
    assert (subscription.qos.reliable, subscription.qos.depth) == (False, 7)


class Listener(Node):
    @Topic(Int32, "wanted").on()
    def want(self, message: Int32) -> None: ...

    @WORDS.on()
    def hear(self, message: String) -> None: ...


async def test_topics_without_publishers_are_taken_if_so_told(rig: Rig, tmp_path: Path) -> None:
    await rig.start(recorder(tmp_path / "walk", unpublished=True), Listener)
    assert rig.node(Recorder).topics == ["/parameter_events", "/rosout", "/wanted", "/words"]


async def test_topics_without_other_readers_are_left_out_if_so_told(rig: Rig, tmp_path: Path) -> None:
    await rig.start(recorder(tmp_path / "walk", leaf_topics=False), Listener, Talker)
    await rig.quiet()
    assert rig.node(Recorder).topics == ["/words"]


async def test_paused_it_records_nothing_and_counts_nothing(rig: Rig, tmp_path: Path) -> None:
    await rig.start(recorder(tmp_path / "walk", ONLY, paused=True), Talker)
    say, recording = rig.node(Talker).words, rig.node(Recorder)
    say(word("unheard"))
    recording.unpause()
    say(word("heard"))
    recording.pause()
    say(word("unheard again"))
    await rig.stop()
    assert texts(tmp_path / "walk") == ["heard"]
    assert recording.dropped == 0


async def test_it_is_controlled_by_the_services_of_ros2_bag(rig: Rig, tmp_path: Path) -> None:
    await rig.start(recorder(tmp_path / "walk", ONLY), Talker)
    splits = rig.probe(Topic(WriteSplitEvent, "/events/write_split"))
    say = rig.node(Talker).words

    async def ask(kind: Any, verb: str) -> Any:
        return await rig.call(Service(kind, f"/rosbag2_recorder/{verb}"), kind.Request())

    say(word("one"))
    await ask(Pause, "pause")
    assert (await ask(IsPaused, "is_paused")).paused
    say(word("unheard"))
    await ask(Resume, "resume")
    await ask(TogglePaused, "toggle_paused")
    assert (await ask(IsPaused, "is_paused")).paused
    await ask(TogglePaused, "toggle_paused")
    await ask(SplitBagfile, "split_bagfile")
    say(word("two"))
    assert not (await ask(Snapshot, "snapshot")).success, "it keeps nothing in memory"
    await ask(Stop, "stop")
    say(word("unheard"))
    await rig.node(Recorder).wait()
    assert texts(tmp_path / "walk") == ["one", "two"]
    walk = tmp_path / "walk"
    assert [(one.closed_file, one.opened_file, one.node_name) for one in splits] == [
        (str(walk / "walk_0.mcap"), str(walk / "walk_1.mcap"), "/rosbag2_recorder")
    ]


async def test_splits_by_time_are_told_too(rig: Rig, tmp_path: Path) -> None:
    await rig.start(recorder(tmp_path / "walk", ONLY, writer=WriterOptions(max_seconds=1.0)), Talker)
    splits = rig.probe(Topic(WriteSplitEvent, "/events/write_split"))
    for text in ("a", "b", "c"):
        rig.node(Talker).words(word(text))
        await rig.advance(1.0)
    assert [Path(one.opened_file).name for one in splits] == ["walk_1.mcap", "walk_2.mcap"]
    await rig.stop()
    assert texts(tmp_path / "walk") == ["a", "b", "c"]


async def test_by_snapshot_only_the_last_seconds_are_written_and_what_was_latched_before(
    rig: Rig, tmp_path: Path
) -> None:
    await rig.start(recorder(tmp_path / "walk", snapshot=True, snapshot_seconds=10.0), Talker)
    talker, recording = rig.node(Talker), rig.node(Recorder)
    talker.map(word("the house"))
    for second in range(30):
        talker.words(word(f"{second}"))
        await rig.advance(1.0)
    assert recording.recorded == 0
    assert await recording.snapshot()
    for second in range(30, 33):
        talker.words(word(f"{second}"))
        await rig.advance(1.0)
    assert await recording.snapshot()
    await rig.stop()
    assert texts(tmp_path / "walk" / "walk_0.mcap") == [f"{second}" for second in range(20, 30)]
    assert texts(tmp_path / "walk" / "walk_1.mcap") == ["30", "31", "32"]
    assert [len(read(tmp_path / "walk" / f"walk_{file}.mcap")["/map"]) for file in (0, 1)] == [1, 1]
    assert not await recording.snapshot(), "it has ended"
    assert recording.dropped == 0


async def test_a_ring_that_is_too_small_counts_what_it_drops_early(rig: Rig, tmp_path: Path) -> None:
    await rig.start(recorder(tmp_path / "walk", ONLY, snapshot=True, max_cache_bytes=5_000), Talker)
    for _ in range(10):
        rig.node(Talker).words(word("x" * 1000))
    assert rig.node(Recorder).dropped == 6
    await rig.node(Recorder).snapshot()
    for _ in range(4):
        rig.node(Talker).words(word("x" * 1000))
    assert rig.node(Recorder).dropped == 6, "there is room again"
    await rig.stop()


async def test_what_finds_no_room_to_wait_is_counted(rig: Rig, tmp_path: Path) -> None:
    await rig.start(recorder(tmp_path / "walk", ONLY, max_cache_bytes=5_000), Talker)
    say, recording = rig.node(Talker).words, rig.node(Recorder)
    for _ in range(10):
        say(word("x" * 1000))
    await rig.advance(1.0)
    say(word("room again"))
    await rig.stop()
    assert (len(texts(tmp_path / "walk")), recording.dropped) == (5, 6)


def test_everything_that_is_handed_over_is_in_the_bag_or_counted(tmp_path: Path) -> None:
    writer = BagWriter(tmp_path / "walk", WriterOptions(compression="none"))
    outbox, channel = WriteQueue(writer, 10**9), Channel("/words", String)
    with largest_file(1_000_000):
        for second in range(5):
            for _ in range(300):
                outbox.add(Taken(channel, LazyMessage(word("x" * 1000)), second * 10**9, second * 10**9, 1000))
            outbox.take()
            with contextlib.suppress(OSError):
                outbox.write()
        with contextlib.suppress(OSError):
            writer.close()
    assert 0 < len(texts(tmp_path / "walk")) < 1500
    assert len(texts(tmp_path / "walk")) + outbox.dropped + writer.lost == 1500


async def test_what_cannot_be_encoded_is_counted(rig: Rig, tmp_path: Path) -> None:
    await rig.start(recorder(tmp_path / "walk", ONLY), Talker)
    rig.node(Talker).words(word("\ud800"))
    rig.node(Talker).words(word("good"))
    recording = rig.node(Recorder)
    await rig.stop()
    assert (texts(tmp_path / "walk"), recording.dropped) == (["good"], 1)


async def test_when_the_disk_is_full_it_says_so_and_everything_else_goes_on(rig: Rig, tmp_path: Path) -> None:
    path = tmp_path / "walk"
    options = WriterOptions(compression="none")
    with largest_file(600_000):
        await rig.start(recorder(path, ONLY, writer=options), Talker)
        for _ in range(20):
            for _ in range(50):
                rig.node(Talker).words(word("x" * 1000))
            await rig.advance(1.0)
    recording = rig.node(Recorder)
    assert recording.recorded == len(texts(path)), "what is not in the bag does not count as recorded"
    assert recording.failure is not None
    (line,) = events(rig.logs, "recording has ended")
    assert line.fields["because"] == "File too large"
    assert line.fields["bag"] == str(path)
    kept = len(texts(path))
    assert 300 < kept < 600
    assert recording.dropped + kept <= 1000
    assert rig.system.graph.topic("/words").subscriptions == [], "it has left all topics"
    await asyncio.wait_for(recording.wait(), 1.0)
    rig.node(Talker).words(word("the talker lives"))
    await recording.split()
    await rig.stop()
    assert len(by_rosbags(path)) == kept


async def test_without_room_for_the_index_that_is_said(rig: Rig, tmp_path: Path) -> None:
    path = tmp_path / "walk"
    await rig.start(recorder(path, ONLY, writer=WriterOptions(compression="none")), Talker)
    rig.node(Talker).words(word("first"))
    await rig.advance(1.2)
    rig.node(Talker).words(word("second"))
    await rig.advance(1.2)
    with largest_file((path / "walk_0.mcap").stat().st_size):
        rig.node(Talker).words(word("x" * 2_000_000))
        await rig.advance(1.0)
    assert events(rig.logs, "the index of the bag could not be written")
    await rig.stop()
    assert texts(path) == ["first", "second"]


async def test_a_folder_that_exists_already_is_an_error_of_the_start(rig: Rig, tmp_path: Path) -> None:
    rig.expect_failure()
    with pytest.raises(StartFailed) as caught:
        await rig.start(recorder(tmp_path))
    assert isinstance(caught.value.__cause__, BagError)


def test_a_cache_of_nothing_is_refused() -> None:
    with pytest.raises(ValueError, match="a recorder needs a cache of more than 0 bytes"):
        RecordOptions(max_cache_bytes=0)


async def test_with_simulated_time_times_are_those_of_the_clock_topic(rig: Rig, tmp_path: Path) -> None:
    await rig.start(recorder(tmp_path / "walk", ONLY).replace(parameters={"use_sim_time": True}), Talker)
    tick = rig.me.publisher(Topic(Clock, "/clock", qos.CLOCK))
    await rig.quiet()
    from actors.interfaces.builtin_interfaces.msg import Time

    rig.node(Talker).words(word("before time"))
    tick(Clock(clock=Time(sec=1000, nanosec=5)))
    rig.node(Talker).words(word("in time"))
    await rig.stop()
    with BagReader(tmp_path / "walk") as bag:
        (one,) = bag.messages()
    assert (decode(String, one.data).data, one.received_ns) == ("in time", 1_000_000_000_005)


# -- services and actions -------------------------------------------------------------------------------------------------------


class Counter(Node):
    @COUNT.serve()
    async def count(self, goal: Any) -> Any:
        yield step(1)
        yield Done(result(1, 2))


async def test_the_feedback_and_status_of_actions_are_recorded(rig: Rig, tmp_path: Path) -> None:
    await rig.start(recorder(tmp_path / "walk", Selection(all_actions=True)), Counter)
    await rig.quiet()
    async with await rig.send_goal(COUNT, order(1)) as goal:
        await goal
    await rig.stop()
    found = read(tmp_path / "walk")
    assert [list(one.feedback.sequence) for one in found["/count/_action/feedback"]] == [[1]]
    assert [one.status_list[0].status for one in found["/count/_action/status"] if one.status_list][-1] == 4


# -- from other processes -------------------------------------------------------------------------------------------------------


async def test_from_another_process_both_times_are_kept_and_the_bytes_are_those_that_came(tmp_path: Path) -> None:
    network, lines = Network(), list[LogRecord]()
    far = create(System, sinks=())
    connect(far.runtime, network.end())
    far.open()
    async with run(recorder(tmp_path / "walk"), transport=network.end(), sinks=(lines.append,)) as near:
        await far.join(Child(Robot, name="robot"))
        await far.runtime.opened()
        await asyncio.sleep(3.0)
        recording = near.node(Recorder)
        assert "/image" in recording.topics
        sent = far.node(Robot).imu.count
        await far.stop("the test is over")
        await asyncio.sleep(0.2)
        await recording.finish()
    assert recording.dropped == 0
    found = read(tmp_path / "walk")
    assert sent - 50 < len(found["/imu"]) <= sent
    assert found["/image"][0].data.tobytes() == PICTURE.tobytes()
    with BagReader(tmp_path / "walk") as bag:
        assert all(one.published_ns < one.received_ns for one in bag.messages(["/imu"]))


async def test_a_type_that_nobody_describes_is_named_once(rig: Rig, tmp_path: Path) -> None:
    from actors.bag.offers import offers
    from actors.interfaces.foreign import ForeignType
    from actors.transport.remote_topics import RemotePublisher

    await rig.start(recorder(tmp_path / "walk"))

    class Elsewhere:
        fqn = "/elsewhere"

        def warn(self, event: str, **fields: object) -> None: ...

    entry = rig.system.graph.topic("/secret")
    side: Any = SimpleNamespace(wall_ns=rig.system.clock.wall_ns, unreadable=None)
    for _ in range(2):
        foreign = ForeignType("secret_msgs/msg/Secret", "RIHS01_" + 64 * "0")
        entry.add_publisher(RemotePublisher(Elsewhere(), entry, foreign, qos.DEFAULT, side))
        await rig.advance(5.0)
    (line,) = events(rig.logs, "not recorded: its type is not known here")
    assert (line.fields["topic"], line.fields["type"]) == ("/secret", "secret_msgs/msg/Secret")
    assert rig.node(Recorder).topics == ["/parameter_events", "/rosout"]
    assert [one.type for one in offers(rig.system.graph, rig.me, unpublished=False) if one.entry is entry] == [None]  # type: ignore[arg-type]
    for publisher in entry.publishers:
        entry.remove_publisher(publisher)


async def test_the_services_of_rosbag2_say_what_they_cannot_do_and_switch_discovery(rig: Rig, tmp_path: Path) -> None:
    await rig.start(recorder(tmp_path / "walk"), Talker)
    recording = rig.node(Recorder)

    async def ask(kind: Any, name: str, **fields: Any) -> Any:
        return await rig.me.call(Service(kind, f"/rosbag2_recorder/{name}"), kind.Request(**fields))

    later = stamp_of(2**60)
    assert (
        await ask(srv.Resume, "resume", resume_time=later)
    ).return_code == srv.Resume_Response.RETURN_CODE_RESUME_FAILED
    split = await ask(srv.SplitBagfile, "split_bagfile", split_time=later)
    assert split.return_code == srv.SplitBagfile_Response.RETURN_CODE_SPLIT_FAILED
    assert (await ask(srv.IsDiscoveryRunning, "is_discovery_running")).running
    assert (await ask(srv.StartDiscovery, "start_discovery")).return_code == 1
    assert (await ask(srv.StopDiscovery, "stop_discovery")).return_code == 0
    assert (await ask(srv.StopDiscovery, "stop_discovery")).return_code == 1
    rig.me.publisher(Topic(String, "/late", 10))
    await rig.quiet()
    assert "/late" not in recording.topics
    assert (await ask(srv.StartDiscovery, "start_discovery")).return_code == 0
    await rig.quiet()
    assert "/late" in recording.topics
    assert (await ask(srv.Stop, "stop")).return_code == 0
    assert recording.over
    assert (await ask(srv.Stop, "stop")).return_code == 1
    assert (
        await ask(srv.SplitBagfile, "split_bagfile")
    ).return_code == srv.SplitBagfile_Response.RETURN_CODE_NOT_RECORDING
