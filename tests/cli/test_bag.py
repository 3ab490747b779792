"""`bag` from another process: on the graph of this one, and on files."""

from __future__ import annotations

import asyncio
import json
import re
import shutil
import signal
from collections.abc import AsyncGenerator
from contextlib import suppress
from pathlib import Path

import pytest
import pytest_asyncio

from actors import Child, Node, System, Topic, every, publishes, qos, run, subscribes
from actors.bag import BagReader, BagWriter, Player, PlayOptions, WriterOptions, topic_of
from actors.interfaces import encode
from actors.interfaces.std_msgs.msg import Int32, String
from actors.transport import transport_from_environment
from cli.verbs.bag.keys import press
from tests.actors.bag.bags import BEGIN, MS, WORDS, by_rosbags, foreign_bag, text, words_of, write
from tests.cli.conftest import ROOT, Command, Start
from tests.wires import BOTH

CHATTER = Topic(String, "chatter", 10)
SAID = Topic(String, "words", 1000)


class Talker(Node):
    chatter = publishes(CHATTER)
    latched = publishes(Topic(String, "robot/description", qos.LATCHED))

    async def on_start(self) -> None:
        self.latched(String(data="four legs"))

    @every(hz=50)
    def talk(self) -> None:
        self.chatter(String(data=f"{self.chatter.count}"))


class Listener(Node):
    words = subscribes(SAID)


@pytest_asyncio.fixture
async def system(environment: dict[str, str], monkeypatch: pytest.MonkeyPatch) -> AsyncGenerator[System]:
    monkeypatch.setenv("ROS_DOMAIN_ID", "7")
    transport = transport_from_environment(environment)
    async with run(Child(Talker, name="talker"), Listener, transport=transport, signals=False, sinks=()) as system:
        yield system


# -- record and play ------------------------------------------------------------------------------------------------------------


@BOTH
async def test_what_another_process_publishes_is_recorded_until_ctrl_c(
    system: System, start: Start, tmp_path: Path
) -> None:
    bag = tmp_path / "walk"
    process = await start("bag", "record", "--all", "-o", str(bag), cwd=tmp_path)
    assert await process.stderr.readline() == f"Recording into {bag}; Ctrl-C ends it\n".encode()
    talker = system.node(Talker).chatter
    enough = talker.count + 40
    while talker.count < enough:
        await asyncio.sleep(0.01)
    process.send_signal(signal.SIGINT)
    ended = (await asyncio.wait_for(process.stderr.read(), 10.0)).decode()
    assert await process.wait() == 0
    said = re.fullmatch(r"(.*): (\d+) messages recorded, 0 lost, [\d.]+ KiB\n", ended)
    assert said is not None, ended
    with BagReader(bag) as read:
        counts = {topic.name: count for topic, count in read.metadata.topics.items()}
        chatter = [int(one.data[8:].rstrip(b"\0")) for one in read.messages(["/chatter"])]
    assert sum(counts.values()) == int(said[2])
    assert counts["/robot/description"] == 1
    assert len(chatter) > 10
    assert chatter == list(range(chatter[0], chatter[0] + len(chatter))), "no gap"
    assert len(by_rosbags(bag)) == sum(counts.values())


@BOTH
async def test_a_bag_is_played_to_another_process(system: System, robot: Command, tmp_path: Path) -> None:
    bag = write(tmp_path / "walk", [f"{number}" for number in range(50)])
    done = await robot("bag", "play", str(bag), "--rate", "2", "--clock", "100", "--topics", "/words")
    assert (done.code, done.out, done.err) == (0, "", "50 messages played\n")
    heard = system.node(Listener).words
    assert [(await heard.next(timeout=1.0)).data for _ in range(50)] == [f"{number}" for number in range(50)]


async def test_some_messages_are_played_at_once(system: System, robot: Command, tmp_path: Path) -> None:
    bag = write(tmp_path / "walk", [f"{number}" for number in range(50)], step=1000 * MS)
    bursting = asyncio.ensure_future(robot("bag", "burst", str(bag), "-n", "3", "--start-offset", "10"))
    heard = system.node(Listener).words
    assert [(await heard.next(timeout=20.0)).data for _ in range(3)] == ["10", "11", "12"]
    bursting.cancel()
    with suppress(asyncio.CancelledError):
        await bursting  # which waits for the end of the command


async def test_recording_wants_to_be_told_what(robot: Command, tmp_path: Path) -> None:
    nothing = await robot("bag", "record", "-o", str(tmp_path / "walk"))
    assert nothing.code == 1
    assert nothing.err.startswith("Need to specify at least one option out of --all, ")
    there = await robot("bag", "record", "-a", "-o", str(tmp_path))
    assert (there.code, there.err) == (1, f"Output folder '{tmp_path}' already exists.\n")
    for words, said in (
        (["-a", "-e", "("], "'(' is no regular expression"),
        (["-a", "--compression-mode", "none", "--compression-format", "zstd"], "leave one out"),
        (["-a", "--custom-data", "x"], "--custom-data 'x': write it as KEY=VALUE"),
        (["-a", "--max-cache-size", "0"], "a cache of more than 0 bytes"),
        (["-a", "--interfaces", "/nowhere"], "no definition in /nowhere"),
        (["-a", "-b", "-1"], "cannot be split at -1 bytes"),
        (["-a", "--qos-profile-overrides-path", "/nowhere"], "No such file or directory: '/nowhere'"),
    ):
        wrong = await robot("bag", "record", *words)
        assert wrong.code == 1, words
        assert said in wrong.err
        assert wrong.err.count("\n") == 1
    unclear = await robot("bag", "play", "x", "--rate", "0")
    assert unclear.code == 2
    assert "'0' is no number above 0" in unclear.err
    for words in (
        ("bag", "play", "x", "--playback-duration", "nan"),
        ("bag", "play", "x", "--playback-until-sec", "inf"),
        ("node", "list", "--spin-time", "inf"),
        ("param", "get", "/x", "y", "--timeout", "nan"),
        ("launch", "x.launch.py", "--duration", "nan"),
        ("topic", "echo", "/x", "--qos-liveliness-lease-duration-seconds", "nan"),
        ("web", "--port", "99999"),
    ):
        odd = await robot(*words)
        assert odd.code == 2, words
        assert f"{words[-1]!r} is no " in odd.err
    nowhere = await robot("bag", "play", "/nowhere", "-m", "a")
    assert (nowhere.code, nowhere.err) == (1, "--remap 'a': write it as OLD:=NEW\n")


async def test_a_recorder_of_a_topic_that_nobody_publishes_tells_so(
    system: System, start: Start, tmp_path: Path
) -> None:
    words = ("bag", "record", "chater", "/chatter", "-o", str(tmp_path / "walk"), "--start-paused")
    process = await start(*words, cwd=tmp_path)
    await process.stderr.readline()
    async with asyncio.timeout(30):
        while all(reader.here for reader in system.graph.topic("/chatter").subscriptions):
            await asyncio.sleep(0.01)
    process.send_signal(signal.SIGINT)
    ended = (await asyncio.wait_for(process.stderr.read(), 30.0)).decode()
    assert await process.wait() == 0
    assert ended.endswith("B\nnobody published /chater; did you mean '/chatter'?\n")


async def test_a_folder_that_cannot_be_made_is_told_once(robot: Command, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    refused = await robot("bag", "record", "--all", "-o", str(tmp_path / "file" / "walk"))
    assert (refused.code, refused.out) == (1, "")
    assert refused.err == f"{tmp_path}/file/walk cannot be made: Not a directory\n"


async def test_on_a_full_disk_the_command_ends_with_the_reason(system: System, start: Start, tmp_path: Path) -> None:
    limited = "import resource, sys; resource.setrlimit(resource.RLIMIT_FSIZE, (300_000, 300_000)); "
    limited += "from cli.entry import main; sys.exit(main(sys.argv[1:]))"
    bag = tmp_path / "walk"
    words = ("bag", "record", "--topics", "/words", "-o", str(bag), "--compression-mode", "none")
    process = await start("-c", limited, *words)
    await process.stderr.readline()
    say = system.node(Talker).publisher(SAID)
    while process.returncode is None:
        say(String(data="x" * 1000))
        await asyncio.sleep(0.005)
    ended = (await process.stderr.read()).decode()
    assert process.returncode == 1
    assert "recording has ended: the bag cannot be written" in ended
    assert re.search(r"walk: File too large; \d+ messages recorded, \d+ lost", ended)
    assert "Traceback" not in ended
    assert len(words_of(bag)) > 100


async def test_a_recorder_that_fails_ends_the_command_with_the_count_and_the_reason(
    system: System, start: Start, tmp_path: Path
) -> None:
    failing = (
        "import sys, actors.bag.recorder as r; take = r.WriteQueue.take\n"
        "def fail(self, left=[0]): return 1 / left.pop() if left and self._writer.given > 9 else take(self)\n"
        "r.WriteQueue.take = fail; from cli.entry import main; sys.exit(main(sys.argv[1:]))"
    )
    bag = tmp_path / "walk"
    words = ("bag", "record", "--topics", "/chatter", "-o", str(bag))
    process = await start("-c", failing, *words)
    ended = (await asyncio.wait_for(process.stderr.read(), 30.0)).decode()
    assert await process.wait() == 1
    said = re.search(r"walk: the recorder has failed: ZeroDivisionError.*; (\d+) messages recorded, \d+ lost", ended)
    assert said is not None, ended
    assert "Traceback" not in ended
    assert len(by_rosbags(bag)) == int(said[1])


async def test_keys_control_the_player(tmp_path: Path) -> None:
    bag = write(tmp_path / "walk", ["a", "b"], step=1000 * MS)
    async with run(Child(Player, args=(bag, PlayOptions(paused=True))), sinks=()) as system:
        player = system.node(Player)
        await press(player, b"\x1b[C")
        assert player.played == 1
        await press(player, b"\x1b[A")
        assert player.rate == pytest.approx(1.1)
        await press(player, b"\x1b[B")
        assert player.rate == pytest.approx(1.0)
        await press(player, b" ")
        assert not player.paused
        await press(player, b" ")
        await press(player, b"q")
        assert player.paused


# -- files ----------------------------------------------------------------------------------------------------------------------


def two_topics(path: Path) -> Path:
    numbers = topic_of("/numbers", Int32, [qos.DEFAULT])
    events = topic_of("/add/_service_event", String)
    with BagWriter(path, WriterOptions(custom_data={"robot": "x"})) as bag:
        for number in range(3):
            at = BEGIN + number * 500 * MS
            bag.write(WORDS, text(f"word {number}"), received_ns=at, published_ns=at - MS)
        bag.write(numbers, encode(Int32(data=7)), received_ns=BEGIN, published_ns=BEGIN)
        bag.write(events, text(""), received_ns=BEGIN, published_ns=BEGIN)
    return path


async def test_info_prints_what_ros2_prints(robot: Command, environment: dict[str, str], tmp_path: Path) -> None:
    environment["TZ"] = "UTC"
    bag = two_topics(tmp_path / "walk")
    told = await robot("bag", "info", str(bag))
    size = (bag / "walk_0.mcap").stat().st_size
    assert (
        told.out
        == f"""
Files:             walk_0.mcap
Bag size:          {size / 1024:.1f} KiB
Storage id:        mcap
ROS Distro:        robactor
Duration:          1.000000000s
Start:             Nov 14 2023 22:13:20.000000000 (1700000000.000000000)
End:               Nov 14 2023 22:13:21.000000000 (1700000001.000000000)
Messages:          4
Topic information: Topic: /numbers | Type: std_msgs/msg/Int32 | Count: 1 | Serialization Format: cdr
                   Topic: /words | Type: std_msgs/msg/String | Count: 3 | Serialization Format: cdr
Service:           1
Service information: Service: /add | Type: std_msgs/msg/String | Event Count: 1 | Serialization Format: cdr
"""
    )
    verbose = await robot("bag", "info", str(bag), "-v", "--sort", "count")
    assert "Topic: /words | Type: std_msgs/msg/String | Count: 3 | Size Contribution: 45 B | " in verbose.out
    assert verbose.out.index("/numbers") < verbose.out.index("/words")
    names = await robot("bag", "info", "-t", str(bag))
    assert names.out == "/add/_service_event\n/numbers\n/words\n"
    facts = json.loads((await robot("bag", "info", "--json", str(bag))).out)
    assert (facts["messages"], facts["bytes"], facts["complete"]) == (5, size, True)
    assert facts["custom_data"] == {"robot": "x"}
    assert facts["topics"][0]["name"] == "/words"
    plugins = await robot("bag", "list", "storage")
    assert plugins.out == "mcap\nsqlite3 (read only)\n"


async def test_messages_are_printed_as_yaml_or_json(robot: Command, tmp_path: Path) -> None:
    bag = two_topics(tmp_path / "walk")
    one = await robot("bag", "echo", str(bag), "/words", "-n", "2")
    assert one.out == "data: word 0\n---\ndata: word 1\n---\n"
    field = await robot("bag", "echo", str(bag), "--topics", "/words", "--field", "data", "--start-offset", "0.6")
    assert field.out == "word 2\n---\n"
    both = await robot("bag", "echo", str(bag), "/words", "/numbers", "-n", "2")
    assert both.out.splitlines()[0] == "# /words at 1700000000.000000000"
    lines = [json.loads(line) for line in (await robot("bag", "echo", str(bag), "/numbers", "--json")).out.splitlines()]
    assert lines == [
        {
            "topic": "/numbers",
            "type": "std_msgs/msg/Int32",
            "received_ns": BEGIN,
            "published_ns": BEGIN,
            "message": {"data": 7},
        }
    ]
    with BagWriter(tmp_path / "broken") as broken:
        broken.write(WORDS, b"\0\1\0\0", received_ns=BEGIN, published_ns=BEGIN)
    wrong = await robot("bag", "echo", str(tmp_path / "broken"))
    assert (wrong.code, wrong.out) == (1, "")
    assert wrong.err.startswith(f"/words at {BEGIN}: std_msgs/msg/String: the data end too early")


async def test_a_topic_that_a_bag_does_not_have_is_named(robot: Command, tmp_path: Path) -> None:
    bag = two_topics(tmp_path / "walk")
    told = f"{bag} has no topic /wrds; did you mean '/words'?\n"
    echoed = await robot("bag", "echo", str(bag), "/wrds", "/numbers", "--field", "data")
    assert (echoed.out, echoed.err) == ("7\n---\n", told)
    filtered = await robot("bag", "filter", str(bag), "-o", str(tmp_path / "some"), "--topics", "/wrds")
    assert told in filtered.err
    played = await robot("bag", "play", str(bag), "--topics", "/wrds", "--services", "/ad")
    assert told in played.err and f"{bag} has no service /ad; did you mean '/add'?\n" in played.err


async def test_bags_are_filtered_merged_converted_and_indexed(robot: Command, tmp_path: Path) -> None:
    bag = two_topics(tmp_path / "walk")
    some = tmp_path / "some"
    kept = await robot(
        "bag", "filter", str(bag), "-o", str(some), "--topics", "/words", "--start-offset", "0.4", "--duration", "0.2"
    )
    assert (kept.code, kept.out) == (0, f"{some}: 1 messages of 1 topics in 1 files\n")
    assert words_of(some) == ["word 1"]
    old = foreign_bag(tmp_path / "old", ["x", "y"])
    await robot("bag", "merge", str(some), str(old), "-o", str(tmp_path / "both"))
    assert sorted(words_of(tmp_path / "both")) == ["word 1", "x", "y"]
    await robot(
        "bag", "convert", "-i", str(old), "mcap", "--output", str(tmp_path / "new"), "--compression-format", "lz4"
    )
    assert words_of(tmp_path / "new") == ["x", "y"]
    shutil.copytree(tmp_path / "new", tmp_path / "bare")
    (tmp_path / "bare" / "metadata.yaml").unlink()
    indexed = await robot("bag", "reindex", str(tmp_path / "bare"))
    assert (indexed.code, (tmp_path / "bare" / "metadata.yaml").is_file()) == (0, True)


async def test_convert_takes_the_options_file_of_ros2(robot: Command, tmp_path: Path) -> None:
    bag = two_topics(tmp_path / "walk")
    told = tmp_path / "convert.yaml"
    told.write_text(f"""output_bags:
- {{uri: {tmp_path}/a, storage_id: mcap, topics: [/words], storage_preset_profile: zstd_fast}}
- {{uri: {tmp_path}/b, storage_id: "", all: true, compression_mode: none, max_bagfile_duration: 1}}
- {{uri: {tmp_path}/c, all_topics: true, exclude_topics: [/numbers]}}
""")
    done = await robot("bag", "convert", "-i", str(bag), "-o", str(told))
    assert (done.code, done.err) == (0, "")
    for name, counts in (
        ("a", {"/words": 3}),
        ("b", {"/words": 3, "/numbers": 1, "/add/_service_event": 1}),
        ("c", {"/words": 3}),
    ):
        with BagReader(tmp_path / name) as read:
            assert {topic.name: count for topic, count in read.metadata.topics.items()} == counts
    for wrong_text, said in (
        ("a: 1", "it has no list output_bags"),
        ("output_bags: [{uri: x, storage_id: sqlite3}]", "written in mcap"),
    ):
        told.write_text(wrong_text)
        wrong = await robot("bag", "convert", "-i", str(bag), "-o", str(told))
        assert wrong.code == 1
        assert said in wrong.err


async def test_a_cut_bag_is_seen_and_recovered(robot: Command, tmp_path: Path) -> None:
    bag = write(tmp_path / "walk", [f"{number}" for number in range(1000)])
    file = bag / "walk_0.mcap"
    file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])
    told = await robot("bag", "info", str(file))
    assert f"the bag was not closed; `bag recover {file} -o NEW` writes what it holds into a whole one" in told.out
    done = await robot("bag", "recover", str(bag), "-o", str(tmp_path / "whole"))
    count = len(words_of(tmp_path / "whole"))
    assert done.out == f"{tmp_path / 'whole'}: {count} messages of 1 topics in 1 files\n"
    assert re.fullmatch(r"not readable: 0 damaged chunks or records, and \d+ bytes at the end\n", done.err)
    assert 300 < count < 700


async def test_what_is_no_bag_is_one_line(robot: Command, tmp_path: Path) -> None:
    for verb in ("info", "echo", "play", "reindex"):
        wrong = await robot("bag", verb, str(tmp_path / "none"))
        assert wrong.code == 1
        assert wrong.err.count("\n") == 1, wrong.err
    unknown = await robot("bag", "rewind")
    assert unknown.code == 2
    assert "there is no verb 'rewind'" in unknown.err
    shown = await robot("bag", "--help")
    assert "record    record topics, services and actions" in shown.out
    assert ROOT.is_dir()
