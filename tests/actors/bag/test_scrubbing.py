"""Who looks at a recording goes to any time of it, and sees what was to be seen then."""

from __future__ import annotations

import random
from collections import defaultdict
from pathlib import Path
from typing import Any

import pytest
from rosbags.rosbag2 import StoragePlugin

from actors import Child, Topic, qos, temporary
from actors.bag import BagReader, BagWriter, Player, PlayOptions, WriterOptions, mcap_records, topic_of
from actors.bag.contents import Newest
from actors.interfaces import encode
from actors.interfaces.std_msgs.msg import Int32, String
from actors.interfaces.tf2_msgs.msg import TFMessage
from actors.testing import Probe, Rig
from tests.actors.bag.bags import BEGIN, MS, WORDS, foreign_bag, text, write

S = 1000 * MS
SAID = Topic(String, "words", 1000)
MAP = topic_of("/map", String, [qos.LATCHED])
STATE = topic_of("/state", Int32, [qos.LATCHED.replace(depth=2)])
TF = topic_of("/tf", TFMessage, [qos.SENSOR_DATA])


def told(message: Any) -> tuple[str, int]:
    return message.topic.name, message.received_ns - BEGIN


def walk(path: Path) -> Path:
    """Ten seconds: a map at the start and after five seconds, a state each second, a word each 100 ms, and transforms."""
    with BagWriter(path, WriterOptions()) as bag:
        for at in range(100):
            ns = BEGIN + at * 100 * MS
            if at in (0, 50):
                bag.write(MAP, text(f"map {at}"), received_ns=ns, published_ns=ns)
            if at % 10 == 5:
                bag.write(STATE, encode(Int32(data=at)), received_ns=ns, published_ns=ns)
            bag.write(WORDS, text(f"{at}"), received_ns=ns, published_ns=ns)
            bag.write(TF, encode(TFMessage()), received_ns=ns, published_ns=ns)
            if at % 7 == 0:
                bag.flush()  # so that there are many chunks, of which few have the map
    return path


# -- the reader ---------------------------------------------------------------------------------------------------------------------


def test_the_newest_messages_before_a_time_are_found_however_old_they_are(tmp_path: Path) -> None:
    with BagReader(walk(tmp_path / "walk")) as bag:
        found = bag.before(BEGIN + 4 * S, {"/map": 1, "/state": 2, "/words": 1, "/nobody": 3})
    assert [told(one) for one in found] == [
        ("/map", 0), ("/state", 2500 * MS), ("/state", 3500 * MS), ("/words", 3900 * MS),
    ]  # fmt: skip


def test_with_an_index_only_the_chunks_that_hold_them_are_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    read: list[int] = []
    whole = mcap_records.unpacked

    def counted(data: bytes) -> bytes:
        read.append(mcap_records.chunk_times(data)[0] - BEGIN)
        return whole(data)

    with BagReader(walk(tmp_path / "walk")) as bag:
        monkeypatch.setattr(mcap_records, "unpacked", counted)
        assert [told(one) for one in bag.before(BEGIN + 5 * S, {"/map": 1})] == [("/map", 0)]
    assert read == [0]  # one of fifteen


@pytest.mark.parametrize("plugin", StoragePlugin)
def test_bags_of_others_and_of_several_files_tell_the_same(tmp_path: Path, plugin: StoragePlugin) -> None:
    words = [f"word {number}" for number in range(50)]
    ours = write(tmp_path / "ours", words, WriterOptions(max_seconds=0.1))
    theirs = foreign_bag(tmp_path / "theirs", words, plugin)
    for path in (ours, theirs):
        with BagReader(path) as bag:
            for at in (-1, 0, 1, 100, 235, 10_000):
                end_ns = BEGIN + at * MS
                expected = [told(one) for one in bag.messages() if one.received_ns < end_ns][-3:]
                assert [told(one) for one in bag.before(end_ns, {"/words": 3})] == expected, (path, at)


def test_a_file_that_was_cut_is_read_from_its_start(tmp_path: Path) -> None:
    path = walk(tmp_path / "walk") / "walk_0.mcap"
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(path.read_bytes()[:-3000])
    with BagReader(cut) as bag:
        assert bag.cut
        found = bag.before(BEGIN + 3 * S, {"/map": 1, "/words": 1})
    assert [told(one) for one in found] == [("/map", 0), ("/words", 2900 * MS)]


def test_a_bag_that_rosbag2_has_compressed_by_message_is_unpacked(tmp_path: Path) -> None:
    from rosbags.rosbag2 import CompressionMode

    path = foreign_bag(tmp_path / "walk", ["one", "two"], compression=CompressionMode.MESSAGE)
    with BagReader(path) as bag:
        (found,) = bag.before(BEGIN + S, {"/words": 1})
    assert found.data == text("two")


def test_the_newest_of_many_are_those_of_a_sorted_list() -> None:
    chance = random.Random(1)
    for _ in range(50):
        counts = {"/words": chance.randrange(4), "/map": chance.randrange(4)}
        newest, all_of = Newest(counts), defaultdict[str, list[Any]](list)
        for number in range(chance.randrange(30)):
            topic = chance.choice([WORDS, MAP, STATE])
            from actors.bag import BagMessage

            message = BagMessage(topic, b"", BEGIN + chance.randrange(9), 0)
            place = (0, chance.randrange(3), number)
            wanted = newest.wants(topic.name, message.received_ns)
            before = newest.messages()
            newest.add(message, place)
            assert wanted or newest.messages() == before
            all_of[topic.name].append((message.received_ns, place, message))
        kept = [one for name, count in counts.items() if count for one in sorted(all_of[name])[-count:]]
        assert newest.messages() == [message for *_, message in sorted(kept)]


# -- the player ---------------------------------------------------------------------------------------------------------------------


def player(bag: Path, **options: Any) -> Child:
    return Child(Player, args=(bag, PlayOptions(**{"paused": True, "scrub": True, **options})), restart=temporary)


def words(probe: Probe[String]) -> list[str]:
    return [one.data for one in probe]


async def test_a_seek_plays_what_every_topic_showed_then_and_the_next_message_follows(rig: Rig, tmp_path: Path) -> None:
    await rig.start(player(walk(tmp_path / "walk")))
    play = rig.node(Player)
    said, maps = rig.probe(SAID), rig.probe(Topic(String, "map", qos.LATCHED))
    states, transforms = (
        rig.probe(Topic(Int32, "state", qos.LATCHED)),
        rig.probe(Topic(TFMessage, "tf", qos.SENSOR_DATA.replace(depth=1000))),
    )
    times: list[int | None] = []
    rig.system.graph.tap(lambda publisher: lambda message: times.append(play.message_ns))

    assert (play.start_ns, dict(play.counts)) == (BEGIN, {"/map": 1, "/state": 2, "/words": 1, "/tf": 100})
    assert play.seek(BEGIN + 7 * S)
    await rig.advance(0.1)
    assert (words(said), words(maps), [one.data for one in states]) == (["69"], ["map 50"], [55, 65])
    assert len(transforms) == 70  # each message of transforms tells a part only
    recalled = [at for at in times if at is not None]
    assert recalled == sorted(recalled) and recalled[-1] == BEGIN + 6900 * MS
    assert play.message_ns is None and play.played == 0

    assert await play.play_next()
    assert words(said) == ["69", "70"]


async def test_backwards_the_older_map_is_shown_again(rig: Rig, tmp_path: Path) -> None:
    await rig.start(player(walk(tmp_path / "walk")))
    play, maps = rig.node(Player), rig.probe(Topic(String, "map", qos.LATCHED))
    for at in (9, 2):
        play.seek(BEGIN + at * S)
        await rig.advance(0.1)
    assert words(maps) == ["map 50", "map 0"]
    assert play.seeks == 2


async def test_of_several_seeks_at_once_only_the_last_one_is_shown(rig: Rig, tmp_path: Path) -> None:
    await rig.start(player(walk(tmp_path / "walk")))
    play, said = rig.node(Player), rig.probe(SAID)
    for at in (9, 2, 4):
        play.seek(BEGIN + at * S)
    await play.play_next()
    assert words(said) == ["39", "40"]


async def test_a_seek_while_what_an_earlier_one_shows_is_read_takes_its_place(rig: Rig, tmp_path: Path) -> None:
    await rig.start(player(walk(tmp_path / "walk")))
    play, said = rig.node(Player), rig.probe(SAID)
    before = play.bag.before

    def slowly(at_ns: int, counts: Any) -> Any:
        if at_ns == BEGIN + 9 * S:
            play.seek(BEGIN + 2 * S)
        return before(at_ns, counts)

    play.bag.before = slowly  # type: ignore[method-assign]
    play.seek(BEGIN + 9 * S)
    await rig.advance(0.1)
    assert words(said) == ["19"]


async def test_a_seek_while_messages_are_read_shows_its_time_before_it_plays_on(rig: Rig, tmp_path: Path) -> None:
    await rig.start(player(walk(tmp_path / "walk")))
    play, said = rig.node(Player), rig.probe(SAID)
    messages = play.bag.messages

    def slowly(topics: Any, *, start_ns: int) -> Any:
        if start_ns == BEGIN + 2 * S:
            play.seek(BEGIN + 6 * S)
        yield from messages(topics, start_ns=start_ns)

    play.bag.messages = slowly  # type: ignore[method-assign]
    play.seek(BEGIN + 2 * S)
    play.unpause()
    await rig.advance(0.15)
    assert words(said) == ["59", "60", "61"]


async def test_at_the_end_the_player_waits_for_the_next_seek(rig: Rig, tmp_path: Path) -> None:
    await rig.start(player(walk(tmp_path / "walk"), paused=False))
    play = rig.node(Player)
    await rig.advance(20.0)
    assert (play.paused, play.position_ns, play.played) == (True, play.end_ns, 204 + 8)
    play.seek(BEGIN + 9_850 * MS)
    said = rig.probe(SAID)
    play.unpause()
    await rig.advance(5.0)
    assert words(said)[-1] == "99" and play.paused


async def test_with_a_loop_it_begins_anew_and_an_empty_bag_does_not(rig: Rig, tmp_path: Path) -> None:
    once = write(tmp_path / "once", ["only"])
    await rig.start(
        player(walk(tmp_path / "walk"), paused=False, loop=True),
        Child(Player, name="once", args=(once, PlayOptions(scrub=True, loop=True)), restart=temporary),
    )
    await rig.advance(25.0)
    looping, single = rig.system.node("/rosbag2_player"), rig.system.node("/once")
    assert isinstance(looping, Player) and isinstance(single, Player)
    assert (looping.seeks, looping.paused) == (2, False)
    assert (single.seeks, single.paused) == (0, True)


async def test_without_scrub_a_seek_plays_nothing_of_before(rig: Rig, tmp_path: Path) -> None:
    await rig.start(player(walk(tmp_path / "walk"), scrub=False))
    play, said = rig.node(Player), rig.probe(SAID)
    play.seek(BEGIN + 7 * S)
    await play.play_next()
    assert words(said) == [] or words(said) == ["70"]
    assert play.position_ns == BEGIN + 7 * S


def test_requests_are_not_sent_again_by_a_seek() -> None:
    with pytest.raises(ValueError, match="sends no requests"):
        PlayOptions(scrub=True, service_requests="client")
