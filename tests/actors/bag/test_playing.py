"""The player: what was recorded is published again, in its time, by whoever is at the controls."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from rosbags.rosbag2 import StoragePlugin

from actors import Child, Node, Service, StartFailed, Topic, every, publishes, qos, run, temporary
from actors.bag import (
    BagTopic,
    BagWriter,
    Player,
    PlayOptions,
    Recorder,
    RecordOptions,
    Selection,
    qos_overrides,
    topic_of,
)
from actors.interfaces import encode
from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.rosbag2_interfaces.srv import (
    Burst,
    GetRate,
    IsPaused,
    Pause,
    PlayNext,
    Resume,
    Seek,
    SetRate,
    Stop,
    TogglePaused,
)
from actors.interfaces.rosgraph_msgs.msg import Clock
from actors.interfaces.std_msgs.msg import Int32, String
from actors.qos import InvalidQoS
from actors.testing import Probe, Rig
from actors.time.values import nanoseconds_of, stamp_of
from tests.actors.bag.bags import BEGIN, MS, NUMBERS, WORDS, foreign_bag, text, write
from tests.stage import events

SAID = Topic(String, "words", 100)
CLOCK = Topic(Clock, "/clock", qos.CLOCK)
S = 1000 * MS


def player(bag: Path, **options: Any) -> Child:
    return Child(Player, args=(bag, PlayOptions(**options)), restart=temporary)


async def playing(rig: Rig, bag: Path, **options: Any) -> Player:
    """Start a player that is paused, so that nothing is missed."""
    await rig.start(player(bag, **{"paused": True, **options}))
    return rig.node(Player)


async def test_of_a_topic_in_two_types_the_one_that_is_known_is_played(rig: Rig, tmp_path: Path) -> None:
    with BagWriter(tmp_path / "both") as bag:
        for at in range(3):
            bag.write(WORDS, text(f"{at}"), received_ns=BEGIN + at * MS, published_ns=BEGIN)
            odd = BagTopic("/words", "garden_msgs/msg/Brick")
            bag.write(odd, b"\0\1\0\0\5\0\0\0", received_ns=BEGIN + at * MS, published_ns=BEGIN)
    playing_it = await playing(rig, tmp_path / "both")
    probe = rig.probe(SAID)
    playing_it.unpause()
    await rig.advance(1.0)
    assert words(probe) == ["0", "1", "2"]
    assert len(events(rig.logs, "a topic of the bag is not played")) == 1


def words(probe: Probe[String]) -> list[str]:
    return [one.data for one in probe]


def bag_of(path: Path, count: int = 10, step: int = S) -> Path:
    """A bag with the numbers from 0 on, one a second."""
    return write(path, [f"{number}" for number in range(count)], step=step)


async def test_messages_come_at_the_times_of_the_recording(rig: Rig, tmp_path: Path) -> None:
    play = await playing(rig, bag_of(tmp_path / "walk"))
    heard = rig.probe(SAID)
    begin = rig.now
    play.unpause()
    await play.wait()
    assert words(heard) == [f"{number}" for number in range(10)]
    assert [round(at - begin, 6) for at in heard.times] == [float(number) for number in range(10)]
    assert (play.played, play.position_ns) == (10, BEGIN + 9 * S)


@pytest.mark.parametrize("plugin", StoragePlugin)
async def test_bags_that_rosbags_has_written_are_played(rig: Rig, tmp_path: Path, plugin: StoragePlugin) -> None:
    play = await playing(rig, foreign_bag(tmp_path / "walk", ["one", "two", "three"], plugin))
    heard = rig.probe(SAID)
    play.unpause()
    await play.wait()
    assert words(heard) == ["one", "two", "three"]


async def test_what_was_recorded_is_played_the_same(rig: Rig, tmp_path: Path) -> None:
    class Talker(Node):
        said = publishes(SAID)
        n = 0

        @every(hz=30)
        def talk(self) -> None:
            self.n += 1
            self.said(String(data=f"{self.n}"))

    only = RecordOptions(selection=Selection(topics=["/words"]))
    await rig.start(Child(Recorder, args=(tmp_path / "walk", only)), Talker)
    first = rig.probe(SAID)
    await rig.advance(5.0)
    await rig.stop()
    again = Rig()
    await again.start(player(tmp_path / "walk", paused=True))
    second = again.probe(SAID)
    again.node(Player).unpause()
    await again.node(Player).wait()
    recorded, played = words(first), words(second)
    assert played == recorded[-len(played) :]
    assert len(played) >= 149
    gaps = [round(b - a, 6) for a, b in zip(second.times, second.times[1:], strict=False)]
    assert set(gaps) <= {round(1 / 30, 6), round(1 / 30, 6) + 1e-6, round(1 / 30, 6) - 1e-6}
    await again.close()


async def test_the_rate_makes_it_faster_also_while_it_plays(rig: Rig, tmp_path: Path) -> None:
    play = await playing(rig, bag_of(tmp_path / "walk"), rate=2.0)
    heard = rig.probe(SAID)
    begin = rig.now
    play.unpause()
    await rig.advance(2.25)  # at 4.5 s of the bag
    play.rate = 0.5
    await play.wait()
    assert [round(at - begin, 6) for at in heard.times] == [0.0, 0.5, 1.0, 1.5, 2.0, 3.25, 5.25, 7.25, 9.25, 11.25]
    assert play.rate == 0.5
    with pytest.raises(ValueError, match="cannot be played at the rate 0"):
        play.rate = 0.0


async def test_it_plays_from_an_offset_for_a_while_or_until_a_time(rig: Rig, tmp_path: Path) -> None:
    bag = bag_of(tmp_path / "walk")
    heard: list[list[str]] = []
    for options in ({"start_offset": 3.0, "duration": 2.5}, {"until_ns": BEGIN + 2 * S}, {"start_offset": 8.5}):
        other = Rig()
        play = await playing(other, bag, **options)
        probe = other.probe(SAID)
        play.unpause()
        await play.wait()
        heard.append(words(probe))
        await other.close()
    assert heard == [["3", "4", "5"], ["0", "1", "2"], ["9"]]


async def test_a_loop_begins_anew_and_the_delay_is_before_its_first_pass(rig: Rig, tmp_path: Path) -> None:
    play = await playing(rig, bag_of(tmp_path / "walk", 3), loop=True, delay=5.0)
    heard = rig.probe(SAID)
    play.unpause()
    await rig.advance(19.5)
    assert [round(at) for at in heard.times][:7] == [5, 6, 7, 7, 8, 9, 9]
    play.finish()
    count = len(heard)
    await rig.advance(20.0)
    assert len(heard) == count
    await play.wait()


async def test_paused_it_stands_still_and_plays_one_message_at_a_time(rig: Rig, tmp_path: Path) -> None:
    play = await playing(rig, bag_of(tmp_path / "walk"))
    heard = rig.probe(SAID)
    await rig.advance(100.0)
    assert words(heard) == []
    assert await play.play_next()
    assert (words(heard), play.position_ns) == (["0"], BEGIN)
    assert await play.burst(3) == 3
    assert (words(heard), play.position_ns) == (["0", "1", "2", "3"], BEGIN + 3 * S)
    play.unpause()
    assert not await play.play_next(), "it is not paused"
    await rig.advance(1.5)
    assert words(heard)[-1] == "4"
    play.pause()
    assert await play.burst(0) == 5, "all that is left"
    assert not await play.play_next()


async def test_it_goes_on_where_it_is_sent(rig: Rig, tmp_path: Path) -> None:
    play = await playing(rig, bag_of(tmp_path / "walk", 1000), read_ahead=7)
    heard = rig.probe(SAID)
    play.unpause()
    await rig.advance(1.5)
    assert play.seek(BEGIN + 500 * S)
    await rig.advance(1.5)
    assert play.seek(BEGIN + 20 * S)
    await rig.advance(0.5)
    assert words(heard) == ["0", "1", "500", "501", "20"]
    assert not play.seek(BEGIN - 1)
    assert not play.seek(BEGIN + 1000 * S)


async def test_it_is_controlled_by_the_services_of_ros2_bag(rig: Rig, tmp_path: Path) -> None:
    play = await playing(rig, bag_of(tmp_path / "walk"))
    heard = rig.probe(SAID)

    async def ask(kind: Any, verb: str, **fields: Any) -> Any:
        return await rig.call(Service(kind, f"/rosbag2_player/{verb}"), kind.Request(**fields))

    assert (await ask(IsPaused, "is_paused")).paused
    assert (await ask(PlayNext, "play_next")).success
    assert (await ask(Burst, "burst", num_messages=2)).actually_burst == 2
    assert (await ask(SetRate, "set_rate", rate=4.0)).success
    assert not (await ask(SetRate, "set_rate", rate=-1.0)).success
    assert (await ask(GetRate, "get_rate")).rate == 4.0
    assert (await ask(Seek, "seek", time=Time(sec=BEGIN // S + 7))).success
    assert not (await ask(Seek, "seek", time=Time(sec=5))).success
    await ask(Resume, "resume")
    await rig.advance(0.3)
    await ask(Pause, "pause")
    await ask(TogglePaused, "toggle_paused")
    assert not (await ask(IsPaused, "is_paused")).paused
    await ask(TogglePaused, "toggle_paused")
    assert play.paused
    await ask(Stop, "stop")
    await play.wait()
    assert words(heard) == ["0", "1", "2", "7", "8"]


async def test_topics_are_chosen_and_renamed(rig: Rig, tmp_path: Path) -> None:
    path = tmp_path / "walk"
    with BagWriter(path) as bag:
        bag.write(WORDS, text("a"), received_ns=BEGIN, published_ns=BEGIN)
        bag.write(NUMBERS, encode(Int32(data=7)), received_ns=BEGIN, published_ns=BEGIN)
    play = await playing(rig, path, selection=Selection(topics=["/words"]), remap={"/words": "/elsewhere"})
    heard = rig.probe(Topic(String, "/elsewhere"))
    play.unpause()
    await play.wait()
    assert words(heard) == ["a"]
    assert "/numbers" not in rig.system.graph.topics


async def test_publishers_offer_what_was_recorded_or_what_is_told(rig: Rig, tmp_path: Path) -> None:
    path = tmp_path / "walk"
    plain = BagTopic("/plain", "std_msgs/msg/String")
    odd = BagTopic("/odd", "std_msgs/msg/String", offered_qos_profiles="- {depth: much}")
    both = BagTopic("/both", "std_msgs/msg/String", offered_qos_profiles="- {depth: 2}\n- {depth: 3}")
    latched = "- {history: keep_last, depth: 2, reliability: reliable, durability: transient_local}\n"
    frames = BagTopic("/frames", "std_msgs/msg/String", offered_qos_profiles=latched * 3)
    with BagWriter(path) as bag:
        for topic in (plain, odd, both, frames, WORDS):
            bag.add(topic)
    await playing(rig, path, qos={"/words": qos.SENSOR_DATA})
    offered = {name: entry.publishers[0].qos for name, entry in rig.system.graph.topics.items() if entry.publishers}
    assert offered["/plain"] == offered["/odd"] == qos.resolve_publisher(qos.DEFAULT)
    assert offered["/both"].depth == 2
    assert (offered["/frames"].depth, offered["/frames"].transient_local) == (6, True)
    assert offered["/words"] == qos.resolve_publisher(qos.SENSOR_DATA)
    assert [one.fields["topic"] for one in events(rig.logs, "cannot be read")] == ["/odd"]
    assert [one.fields["topic"] for one in events(rig.logs, "first of several")] == ["/both"]


async def test_a_message_that_cannot_be_decoded_is_left_out_and_logged(rig: Rig, tmp_path: Path) -> None:
    path = tmp_path / "walk"
    with BagWriter(path) as bag:
        bag.write(WORDS, b"\0\1\0\0", received_ns=BEGIN, published_ns=BEGIN)
        bag.write(WORDS, text("good"), received_ns=BEGIN, published_ns=BEGIN)
    play = await playing(rig, path)
    heard = rig.probe(SAID)
    play.unpause()
    await play.wait()
    assert words(heard) == ["good"]
    assert events(rig.logs, "a message of the bag cannot be decoded")[0].fields["topic"] == "/words"


async def test_a_bag_in_another_encoding_is_refused(rig: Rig, tmp_path: Path) -> None:
    path = tmp_path / "walk"
    with BagWriter(path) as bag:
        bag.add(BagTopic("/words", "std_msgs/msg/String", serialization_format="json"))
    rig.expect_failure()
    with pytest.raises(
        StartFailed, match=r"nothing of .*walk can be played: /words is recorded in 'json', and only CDR can be decoded"
    ):
        await rig.start(player(path))


async def test_many_messages_at_one_time_leave_others_their_turn(rig: Rig, tmp_path: Path) -> None:
    play = await playing(rig, write(tmp_path / "walk", [f"{number}" for number in range(500)], step=0))
    heard = rig.probe(SAID)
    play.unpause()
    await play.wait()
    assert len(heard) == 500


# -- the time of the bag --------------------------------------------------------------------------------------------------------


async def test_the_time_of_the_bag_is_published_at_a_rate_and_what_the_bag_has_of_it_is_not(
    rig: Rig, tmp_path: Path
) -> None:
    path = tmp_path / "walk"
    ticks = BagTopic("/clock", "rosgraph_msgs/msg/Clock")
    with BagWriter(path) as bag:
        bag.write(ticks, encode(Clock(clock=Time(sec=1))), received_ns=BEGIN, published_ns=BEGIN)
        bag.write(WORDS, text("end"), received_ns=BEGIN + 2 * S, published_ns=BEGIN)
    play = await playing(rig, path, clock_hz=10.0, rate=2.0)
    times = rig.probe(CLOCK)
    play.unpause()
    await play.wait()
    stamps = [nanoseconds_of(one.clock) - BEGIN for one in times]
    assert stamps == [200 * MS * number for number in range(1, 10)] or stamps == [200 * MS * n for n in range(11)]


async def test_the_time_is_published_before_each_message_of_some_topics_or_of_all(rig: Rig, tmp_path: Path) -> None:
    path = tmp_path / "walk"
    with BagWriter(path) as bag:
        bag.write(WORDS, text("a"), received_ns=BEGIN, published_ns=BEGIN)
        bag.write(NUMBERS, encode(Int32(data=7)), received_ns=BEGIN + S, published_ns=BEGIN)
    stamps: list[list[int]] = []
    for topics in (frozenset({"/numbers"}), None):
        other = Rig()
        play = await playing(other, path, clock_topics=topics)
        times = other.probe(CLOCK)
        play.unpause()
        await play.wait()
        stamps.append([nanoseconds_of(one.clock) - BEGIN for one in times])
        await other.close()
    assert stamps == [[S], [0, S]]


async def test_a_node_on_simulated_time_lives_in_the_time_of_the_bag(rig: Rig, tmp_path: Path) -> None:
    class Sleeper(Node):
        @every(hz=1)
        def tick(self) -> None:
            ticked.append(self.clock.now_ns() // S)

    ticked: list[int] = []
    await rig.start(
        player(bag_of(tmp_path / "walk", 6), clock_hz=100.0, rate=3.0),
        Child(Sleeper, parameters={"use_sim_time": True}),
    )
    begin = rig.now
    await rig.node(Player).wait()
    assert rig.now - begin < 2.0
    assert ticked[-1] - ticked[0] >= 3


# -- what it is told ------------------------------------------------------------------------------------------------------------


def test_options_without_a_meaning_are_refused() -> None:
    with pytest.raises(ValueError, match="a bag cannot be played at the rate 0"):
        PlayOptions(rate=0.0)
    with pytest.raises(ValueError, match="cannot be negative"):
        PlayOptions(delay=-1.0)


def test_profiles_are_read_from_the_file_that_ros2_bag_takes(tmp_path: Path) -> None:
    path = tmp_path / "qos.yaml"
    path.write_text("/words:\n  reliability: best_effort\n  history: keep_last\n  depth: 3\n")
    assert qos_overrides(path) == {"/words": qos.SENSOR_DATA.replace(depth=3)}
    for broken, said in (("{", "cannot be read"), ("[]", "holds no topics"), ("/words: {speed: 1}", "is no policy")):
        path.write_text(broken)
        with pytest.raises(InvalidQoS, match=said):
            qos_overrides(path)


@pytest.mark.realtime
async def test_on_the_real_clock_it_may_be_sent_elsewhere_while_it_reads(tmp_path: Path) -> None:
    bag = bag_of(tmp_path / "walk", 1000, MS)
    async with run(player(bag, read_ahead=3, paused=True), sinks=()) as system:
        play = system.node(Player)
        heard = system.node(Player).subscribe(SAID)
        play.unpause()
        for place in (500, 20, 900):
            assert play.seek(BEGIN + place * MS)
        await play.wait()
        found = [(await heard.next(timeout=1.0)).data for _ in range(heard.received)]
    assert found[-100:] == [f"{number}" for number in range(900, 1000)]


async def test_with_a_delay_time_begins_with_the_bag_and_with_an_offset_latched_topics_come_first(
    rig: Rig, tmp_path: Path
) -> None:
    latched = topic_of("/map", String, [qos.LATCHED])
    with BagWriter(tmp_path / "walk") as bag:
        for at, topic, word in ((0, latched, "old"), (1, latched, "map"), (2, WORDS, "a"), (8, WORDS, "b")):
            bag.write(topic, text(word), received_ns=BEGIN + at * S, published_ns=BEGIN)
    play = await playing(rig, tmp_path / "walk", start_offset=5.0, delay=2.0, clock_hz=1.0)
    heard, maps = rig.probe(SAID), rig.probe(Topic(String, "map", qos.LATCHED))
    clock = rig.probe(CLOCK)
    begin = rig.now
    play.unpause()
    assert play.position_ns == BEGIN + 5 * S
    await play.wait()
    assert [stamp.clock.sec - BEGIN // S for stamp in clock] == [5, 6, 7]
    assert [round(at - begin) for at in clock.times] == [2, 3, 4]
    assert (words(maps), words(heard)) == (["map"], ["b"])

    async def ask(kind: Any, name: str, **fields: Any) -> Any:
        return await rig.me.call(Service(kind, f"/rosbag2_player/{name}"), kind.Request(**fields))

    assert (
        await ask(Resume, "resume", resume_time=stamp_of(1))
    ).error_string == "a player resumes at once: leave resume_time zero"
    assert (await ask(Stop, "stop")).return_code == 1
