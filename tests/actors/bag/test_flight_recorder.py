"""The flight recorder: what it keeps, for how long, in how much memory, and that nobody notices it."""

from __future__ import annotations

import asyncio
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader

from actors import Child, Node, QoS, Supervisor, Topic, every, execute, open_node, publishes, qos, run
from actors.bag import FlightRecorder, Trace
from actors.errors import NotStarted
from actors.interfaces import decode, get_message
from actors.interfaces.geometry_msgs.msg import PoseStamped
from actors.interfaces.message import Message
from actors.interfaces.nav_msgs.msg import Odometry
from actors.interfaces.nav_msgs.msg import Path as Plan
from actors.interfaces.sensor_msgs.msg import Image, Imu, JointState
from actors.interfaces.std_msgs.msg import Header, Int32, String
from actors.qos.policies import History
from actors.testing import Rig
from tests.stage import NUMBERS, WORDS, number, word

MAP = Topic(String, "map", qos.LATCHED)
IMU = Topic(Imu, "imu", qos.SENSOR_DATA)
JOINTS = Topic(JointState, "joints")
ODOMETRY = Topic(Odometry, "odometry")
IMAGE = Topic(Image, "image")
ROSOUT = "/rosout"
EVENTS = "/supervisor_events"
HEADER = Header(frame_id="f" * 50)

Read = list[tuple[str, Message, int, int]]


class Robot(Node):
    """Publishes of everything a little, logs, and tells the map once."""

    map = publishes(MAP)
    imu = publishes(IMU)
    joints = publishes(JOINTS)
    odometry = publishes(ODOMETRY)

    async def on_start(self) -> None:
        self.map(word("the house"))

    @every(hz=10)
    def tick(self) -> None:
        t = self.clock.now()
        self.imu(Imu(linear_acceleration_covariance=np.full(9, t)))
        self.joints(JointState(name=("fl", "fr"), position=np.array([t, -t])))
        self.odometry(Odometry(child_frame_id="body"))

    @every(hz=1)
    def say(self) -> None:
        self.log.info("standing", after=self.clock.now())


class Talker(Node):
    """Says what the test hands it."""

    words = publishes(WORDS)
    map = publishes(MAP)
    image = publishes(IMAGE)


class Planner(Node):
    plan = publishes(Topic(Plan, "plan"))


def read(path: Path) -> Read:
    """(topic, message, log time, publish time) of every message of a file, by the `mcap` library."""
    found: Read = []
    with path.open("rb") as stream:
        for schema, channel, raw in make_reader(stream).iter_messages(log_time_order=False):
            assert schema is not None
            assert (schema.encoding, channel.message_encoding) == ("ros2msg", "cdr")
            found.append((channel.topic, decode(get_message(schema.name), raw.data), raw.log_time, raw.publish_time))
    return found


def facts(path: Path) -> dict[str, str]:
    with path.open("rb") as stream:
        return next(one.metadata for one in make_reader(stream).iter_metadata() if one.name == "flight_record")


def on(read: Read, topic: str) -> list[Any]:
    return [message for name, message, _, _ in read if name == topic]


def texts(recorder: FlightRecorder, topic: str = "/words") -> list[str]:
    """What a recorder holds of a topic of strings."""
    entries = recorder.freeze().entries
    return [str(getattr(entry.message, "data", "")) for entry in entries if entry.source.channel.topic == topic]


def plain(value: Any) -> Any:
    """A message of ours or of rosbags as plain data, to compare the two."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, Message):
        return {name: plain(getattr(value, name)) for name in value.__struct_fields__}
    if hasattr(value, "__msgtype__"):
        return {
            name: plain(getattr(value, name))
            for name in value.__dataclass_fields__
            if name[0] != "_" and name[0].islower()
        }
    return value


# -- the file -------------------------------------------------------------------------------------------------------------------


async def test_what_happened_is_read_back_equal_with_its_times_by_mcap_and_by_rosbags(rig: Rig, tmp_path: Path) -> None:
    recorder = rig.observe(FlightRecorder())
    await rig.start(Robot, seed=9)
    probes = {name: rig.probe(topic) for name, topic in (("/joints", JOINTS), ("/odometry", ODOMETRY))}
    imu = rig.probe(IMU)
    await rig.advance(3.0)
    rig.crash(Robot, OSError("snapped"))
    await rig.advance(1.0)
    path = recorder.dump(tmp_path / "flight.mcap", notes={"why": "a look"})

    messages = read(path)
    for name, probe in probes.items():
        seen = [(message, log, publish) for topic, message, log, publish in messages if topic == name]
        expected = [(message, round(at * 1e9), round(at * 1e9)) for message, at in zip(probe, probe.times, strict=True)]
        assert seen == expected
    assert on(messages, "/imu") == list(imu)
    assert [message.data for message in on(messages, "/map")] == ["the house", "the house"]
    assert [log for _, _, log, _ in messages] == sorted(log for _, _, log, _ in messages)

    lines = [(line.name, line.level, line.msg.partition(" at=")[0]) for line in on(messages, ROSOUT)]
    assert ("robot", 20, "standing after=1.0") in lines
    assert (
        "system",
        40,
        "child terminated child=system/robot reason=it raised OSError: snapped",
    ) in lines
    events = [(event.context, event.child, event.incarnation, event.reason) for event in on(messages, EVENTS)]
    assert events == [
        ("progress", "system/robot", 1, ""),
        ("child_terminated", "system/robot", 1, "it raised OSError: snapped"),
        ("progress", "system/robot", 2, ""),
    ]
    count = len(messages)
    assert facts(path) == {
        "clock": "virtual", "seed": "9", "seconds": "30", "entries": str(count), "latched": "0", "lost": "0", "unencodable": "0",
        "why": "a look",
    }  # fmt: skip

    with AnyReader([path]) as bag:
        theirs = [(c.topic, at, plain(bag.deserialize(raw, c.msgtype))) for c, at, raw in bag.messages()]
        offered = {c.topic: repr(c.ext) for c in bag.connections}
    assert theirs == [(topic, log, plain(message)) for topic, message, log, _ in messages]
    assert "BEST_EFFORT" in offered["/imu"]
    assert "TRANSIENT_LOCAL" in offered["/map"]


async def test_a_file_is_whole_or_not_there(rig: Rig, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    recorder = rig.observe(FlightRecorder())
    await rig.start(Robot)
    path = tmp_path / "flight.mcap"
    path.write_bytes(b"an earlier one")
    monkeypatch.setattr("actors.bag.flight_recorder.encode", lambda message: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        recorder.dump(path)
    assert path.read_bytes() == b"an earlier one"
    assert os.listdir(tmp_path) == [path.name]
    with pytest.raises(FileNotFoundError):
        recorder.dump(tmp_path / "nowhere" / "flight.mcap")


async def test_what_no_message_can_carry_costs_only_itself(rig: Rig, tmp_path: Path) -> None:
    recorder = rig.observe(FlightRecorder())
    await rig.start(Talker)
    talker = rig.node(Talker)
    talker.words(word("before"))
    talker.words(word("\ud800"))
    talker.words(word("after"))
    talker.log.info("odd", text="\ud800")
    path = recorder.dump(tmp_path / "flight.mcap")
    messages = read(path)
    assert [message.data for message in on(messages, "/words")] == ["before", "after"]
    assert [line.msg for line in on(messages, ROSOUT) if line.name == "talker"] == ["odd text=\\ud800"]
    assert facts(path)["unencodable"] == "1"


async def test_a_file_can_be_written_by_a_thread_while_the_system_goes_on(rig: Rig, tmp_path: Path) -> None:
    recorder = rig.observe(FlightRecorder())
    await rig.start(Robot)
    await rig.advance(1.0)
    record = recorder.freeze()
    held = len(record.entries)
    await rig.advance(1.0)
    path = await asyncio.to_thread(record.write, tmp_path / "flight.mcap")
    assert len(read(path)) == held == len(record.entries) < len(recorder.freeze().entries)
    assert repr(record) == f"<flight record of {held} entries and 0 latched messages>"


async def test_an_empty_record_is_a_file_too(rig: Rig, tmp_path: Path) -> None:
    recorder = FlightRecorder()
    await rig.start(Node)
    rig.observe(recorder)
    assert read(recorder.dump(str(tmp_path / "flight.mcap"))) == []


async def test_two_types_on_one_topic_are_two_channels(rig: Rig, tmp_path: Path) -> None:
    class Words(Node):
        out = publishes(WORDS)

    class Numbers(Node):
        out = publishes(Topic(Int32, "words"))

    recorder = rig.observe(FlightRecorder())
    await rig.start(Words, Numbers)
    rig.node(Words).out(word("one"))
    rig.node(Numbers).out(number(2))
    messages = read(recorder.dump(tmp_path / "flight.mcap"))
    assert on(messages, "/words") == [word("one"), number(2)]
    assert not [line for line in rig.logs if "ncompatible" in line.event]


# -- what it keeps --------------------------------------------------------------------------------------------------------------


async def test_the_last_seconds_are_kept_of_messages_lines_and_events(rig: Rig) -> None:
    recorder = rig.observe(FlightRecorder(seconds=5.0))
    await rig.start(Robot)
    await rig.advance(60.0)
    record = recorder.freeze()
    assert {round(entry.at) for entry in record.entries} == {55, 56, 57, 58, 59, 60}
    assert min(entry.at for entry in record.entries) >= 55.0
    assert {entry.source.channel.topic for entry in record.entries} == {"/imu", "/joints", "/odometry", ROSOUT}
    assert (recorder.lost, record.lost) == (0, 0)
    assert repr(recorder).startswith(f"<flight recorder of the last 5 s: {len(record.entries)} entries, ")


async def test_in_a_system_that_fell_silent_the_last_seconds_are_those_before_the_silence(rig: Rig) -> None:
    recorder = rig.observe(FlightRecorder(seconds=5.0))
    await rig.start(Talker)
    rig.node(Talker).words(word("last words"))
    await rig.advance(3600.0)
    assert texts(recorder) == ["last words"]


async def test_old_lines_go_also_when_only_messages_come(rig: Rig) -> None:
    recorder = rig.observe(FlightRecorder(seconds=5.0))
    await rig.start(Talker)
    rig.node(Talker).log.info("long ago")
    await rig.advance(6.0)
    rig.node(Talker).words(word("now"))
    assert [entry.source.channel.topic for entry in recorder.freeze().entries] == ["/words"]


async def test_memory_is_bounded_and_a_flood_of_images_leaves_the_lines_alone(rig: Rig) -> None:
    recorder = rig.observe(FlightRecorder(max_bytes=100_000))
    await rig.start(Talker)
    talker = rig.node(Talker)
    talker.log.warning("before the flood")
    for _ in range(100):
        talker.image(Image(data=np.zeros(10_000, np.uint8)))
        assert recorder.bytes <= 100_000
    record = recorder.freeze()
    images = [entry for entry in record.entries if entry.source.channel.topic == "/image"]
    assert len(images) == 8
    assert recorder.lost == record.lost == 92
    assert any("before the flood" in getattr(entry.message, "msg", "") for entry in record.entries)
    talker.image(Image(data=np.zeros(1_000_000, np.uint8)))  # more than there is room for
    assert recorder.bytes <= 100_000
    for count in range(1000):
        talker.log.info("a flood of lines", count=count)
    assert recorder.bytes <= 100_000


async def test_every_kind_of_field_weighs(rig: Rig) -> None:
    recorder = rig.observe(FlightRecorder())
    await rig.start(Robot, Talker, Planner)
    talker = rig.node(Talker)

    def weight(publish: Callable[[Any], None], message: Message) -> int:
        before = recorder.bytes
        publish(message)
        return recorder.bytes - before

    assert weight(talker.words, word("x" * 1000)) - weight(talker.words, word("")) == 1000
    assert weight(talker.image, Image(data=np.zeros(5000, np.uint8))) - weight(talker.image, Image()) == 5000
    joints = rig.node(Robot).joints
    assert weight(joints, JointState(name=("a" * 100, "b" * 100))) - weight(joints, JointState()) >= 200
    imu = rig.node(Robot).imu
    empty, plan = weight(rig.node(Planner).plan, Plan()), Plan(poses=(PoseStamped(header=HEADER),) * 10)
    assert weight(rig.node(Planner).plan, plan) - empty >= 10 * (50 + 7 * 8)
    assert weight(imu, Imu(header=HEADER)) - weight(imu, Imu()) == 50


# -- latched messages -----------------------------------------------------------------------------------------------------------


async def test_what_a_latched_publisher_still_holds_outlasts_the_ring(rig: Rig, tmp_path: Path) -> None:
    recorder = rig.observe(FlightRecorder(seconds=5.0))
    await rig.start(Talker)
    talker = rig.node(Talker)
    talker.map(word("old map"))
    await rig.advance(1.0)
    talker.map(word("map"))
    await rig.advance(99.0)
    talker.words(word("now"))
    await rig.advance(2.0)
    talker.words(word("and now"))
    path = recorder.dump(tmp_path / "flight.mcap")
    assert [(topic, message, log, publish) for topic, message, log, publish in read(path) if topic != ROSOUT] == [
        ("/map", word("map"), 100_000_000_000, 1_000_000_000),
        ("/words", word("now"), 100_000_000_000, 100_000_000_000),
        ("/words", word("and now"), 102_000_000_000, 102_000_000_000),
    ]
    assert facts(path)["latched"] == "1"


async def test_the_next_incarnation_takes_the_place_of_what_the_last_one_had_latched(rig: Rig) -> None:
    recorder = rig.observe(FlightRecorder(seconds=5.0))
    await rig.start(Robot)
    for _ in range(5):
        await rig.advance(10.0)
        rig.crash(Robot)
    await rig.advance(10.0)
    latched = recorder.freeze().latched
    assert [entry.source.channel.topic for entry in latched] == ["/map"]
    assert latched[0].at == pytest.approx(50.0)


async def test_what_is_latched_outlasts_a_flood_but_never_takes_more_than_half_of_the_room(rig: Rig) -> None:
    class Mapper(Node):
        maps = publishes(Topic(Image, "maps", QoS(depth=50, durability=qos.Durability.TRANSIENT_LOCAL)))

    recorder = rig.observe(FlightRecorder(max_bytes=100_000, seconds=5.0))
    await rig.start(Talker, Mapper)
    rig.node(Talker).map(word("small"))
    for _ in range(40):
        rig.node(Mapper).maps(Image(data=np.zeros(5_000, np.uint8)))
    record = recorder.freeze()
    assert "small" in [getattr(entry.message, "data", "") for entry in record.latched]
    assert 5 <= len(record.latched) <= 9
    assert recorder.bytes <= 100_000
    await rig.advance(10.0)
    for _ in range(40):
        rig.node(Talker).image(Image(data=np.zeros(5_000, np.uint8)))
        assert recorder.bytes <= 100_000
    assert len(recorder.freeze().entries) >= 6


async def test_a_recorder_that_comes_late_has_what_is_latched_and_all_that_follows(rig: Rig) -> None:
    await rig.start(Robot)
    await rig.advance(10.0)
    recorder = rig.observe(FlightRecorder())
    assert texts(recorder, "/map") == ["the house"]
    imu = rig.probe(IMU)
    await rig.advance(1.0)
    recorded = [entry.message for entry in recorder.freeze().entries if entry.source.channel.topic == "/imu"]
    assert recorded == list(imu)
    assert len(recorded) == 10


# -- nobody notices it ----------------------------------------------------------------------------------------------------------


async def test_it_is_no_subscription_and_holds_nobody_up(rig: Rig) -> None:
    class Careful(Node):
        out = publishes(Topic(Int32, "numbers", QoS(history=History.KEEP_ALL, limit=1)))

        async def on_start(self) -> None:
            for value in range(100):
                await self.out.send(number(value))

    recorder = rig.observe(FlightRecorder())
    await rig.start(Careful)
    assert rig.node(Careful).out.subscription_count == 0
    assert rig.system.graph.topic("/numbers").subscriptions == []
    assert len([one for one in recorder.freeze().entries if one.source.channel.topic == "/numbers"]) == 100


def test_a_run_is_the_same_with_it_and_without() -> None:
    def trace(*more: FlightRecorder) -> str:
        trace = Trace()

        async def main() -> None:
            tree = Supervisor("robots", children=[Child(Robot), Child(Talker)])
            async with run(tree, sinks=(), observers=(*more, trace)) as system:
                await system.clock.sleep(5.0)

        execute(main, clock="virtual")
        return trace.hexdigest()

    assert trace(FlightRecorder()) == trace()


async def test_rosout_is_recorded_once_whether_somebody_listens_or_not(rig: Rig) -> None:
    from actors.interfaces.rcl_interfaces.msg import Log

    recorder = rig.observe(FlightRecorder())
    await rig.start(Talker)
    heard = rig.probe(Topic(Log, ROSOUT, qos.ROSOUT), name=ROSOUT)
    rig.node(Talker).log.info("once")
    assert [line.msg for line in heard] == ["once"]
    lines = [entry.message for entry in recorder.freeze().entries if entry.source.channel.topic == ROSOUT]
    assert [line.msg for line in lines if isinstance(line, Log) and line.name == "talker"] == ["once"]


def test_nobody_pays_for_the_file_library_who_writes_no_file() -> None:
    script = "import sys, actors; print('actors.bag' in sys.modules); import actors.bag, actors.testing.rig; print('mcap' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["False", "False"]


# -- mistakes -------------------------------------------------------------------------------------------------------------------


async def test_a_recorder_records_one_system(rig: Rig) -> None:
    recorder = FlightRecorder()
    with pytest.raises(NotStarted, match=r"recorder\.attach\(system\)"):
        recorder.freeze()
    system = await rig.start(Node)
    assert recorder.attach(system) is recorder
    assert recorder.system is system
    with pytest.raises(RuntimeError, match="make another recorder"):
        recorder.attach(system)


@pytest.mark.parametrize("seconds", [0.0, -1.0, float("nan")])
def test_the_seconds_are_positive(seconds: float) -> None:
    with pytest.raises(ValueError, match="give a positive number of seconds"):
        FlightRecorder(seconds=seconds)


async def test_on_the_real_clock_the_times_are_those_of_the_day(tmp_path: Path) -> None:
    async with open_node("lonely", sinks=()) as node:
        from actors.system import system_here

        system = system_here()
        assert system is not None
        recorder = FlightRecorder().attach(system)
        publisher = node.publisher(NUMBERS)
        before = system.clock.wall_ns()
        publisher(number(1))
        after = system.clock.wall_ns()
        path = recorder.dump(tmp_path / "flight.mcap")
    assert facts(path)["clock"] == "real"
    [(_, message, _, at)] = read(path)
    assert message == number(1)
    assert before - 1000 <= at <= after + 1000
