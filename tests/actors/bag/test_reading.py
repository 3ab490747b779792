"""Bags that others have written, and bags of ours that were cut."""

from __future__ import annotations

import shutil
import sqlite3
from pathlib import Path
from typing import Any

import pytest
import yaml
from mcap.reader import make_reader
from mcap.writer import CompressionType, IndexType, Writer
from rosbags.rosbag2 import CompressionMode, StoragePlugin

from actors.bag import BagError, BagReader, BagTopic, type_of
from actors.bag.mcap_reading import McapReading, Salvage
from actors.bag.metadata import read_metadata
from actors.interfaces import decode, type_hash
from actors.interfaces.std_msgs.msg import String
from tests.actors.bag.bags import BEGIN, MS, foreign_bag, text, words_of, write

WORDS = [f"word {number}" for number in range(50)]


@pytest.mark.parametrize("version", [8, 9])
@pytest.mark.parametrize("compression", [CompressionMode.NONE, CompressionMode.FILE, CompressionMode.MESSAGE])
@pytest.mark.parametrize("plugin", StoragePlugin)
def test_bags_written_by_rosbags_are_read(
    tmp_path: Path, plugin: StoragePlugin, compression: CompressionMode, version: int
) -> None:
    path = foreign_bag(tmp_path / "walk", WORDS, plugin, version=version, compression=compression)
    with BagReader(path) as bag:
        messages = list(bag.messages())
        (topic,) = bag.topics
        told = bag.metadata
    assert [decode(String, one.data).data for one in messages] == WORDS
    assert [one.received_ns for one in messages] == [BEGIN + 10 * MS * number for number in range(50)]
    assert (topic.name, topic.type, topic.type_hash) == ("/words", "std_msgs/msg/String", type_hash(String))
    assert "string data" in topic.schema
    assert (told.message_count, told.start_ns, told.duration_ns) == (50, BEGIN, 490 * MS)
    assert (told.storage, told.version) == (plugin.name.lower(), version)
    assert not bag.cut


@pytest.mark.parametrize("plugin", StoragePlugin)
def test_reading_may_begin_later_and_be_limited_to_topics(tmp_path: Path, plugin: StoragePlugin) -> None:
    path = foreign_bag(tmp_path / "walk", WORDS, plugin)
    with BagReader(path) as bag:
        late = list(bag.messages(start_ns=BEGIN + 480 * MS))
        assert [decode(String, one.data).data for one in late] == ["word 48", "word 49"]
        assert list(bag.messages({"/other"})) == []
        assert len(list(bag.messages({"/other", "/words"}))) == 50
        assert repr(bag) == f"<bag {path}: 50 messages of 1 topics>"


def test_a_file_alone_is_a_bag_too(tmp_path: Path) -> None:
    path = write(tmp_path / "walk", WORDS)
    assert words_of(path / "walk_0.mcap") == WORDS
    with BagReader(path / "walk_0.mcap") as bag:
        assert [file.path for file in bag.metadata.files] == ["walk_0.mcap"]
        assert bag.size == (path / "walk_0.mcap").stat().st_size


def test_a_folder_without_metadata_is_read_by_its_files_in_the_order_of_their_numbers(tmp_path: Path) -> None:
    from actors.bag import WriterOptions

    path = write(tmp_path / "walk", [f"{number}" for number in range(120)], WriterOptions(max_seconds=0.1))
    (path / "metadata.yaml").unlink()
    with BagReader(path) as bag:
        assert [file.path for file in bag.metadata.files] == [f"walk_{number}.mcap" for number in range(12)]
        assert bag.metadata.message_count == 120
    assert words_of(path) == [f"{number}" for number in range(120)]


def test_messages_of_several_files_come_in_the_order_of_their_receipt(tmp_path: Path) -> None:
    folder = tmp_path / "both"
    folder.mkdir()
    shutil.copy(write(tmp_path / "a", ["a0", "a1", "a2"]) / "a_0.mcap", folder / "x_1.mcap")
    shutil.copy(write(tmp_path / "b", ["b0", "b1", "b2"], step=4 * MS) / "b_0.mcap", folder / "x_0.mcap")
    assert words_of(folder) == ["b0", "a0", "b1", "b2", "a1", "a2"]


def unchunked(path: Path) -> Path:
    """A file as rosbag2's profile `fastwrite` has it: no chunks, so no index; its messages are not in order."""
    with path.open("wb") as stream:
        writer = Writer(stream, use_chunking=False, index_types=IndexType.NONE, compression=CompressionType.NONE)
        writer.start("ros2")
        schema = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data")
        channel = writer.register_channel("/words", "cdr", schema)
        for number in (1, 0, 2):
            writer.add_message(channel, BEGIN + number, text(f"{number}"), BEGIN)
        writer.finish()  # type: ignore[no-untyped-call]
    return path


def test_a_file_without_chunks_is_read_in_order(tmp_path: Path) -> None:
    path = unchunked(tmp_path / "fast.mcap")
    assert words_of(path) == ["0", "1", "2"]
    path.write_bytes(path.read_bytes()[:-200])
    assert words_of(path) == ["0", "1", "2"], "its end is lost, its messages are not"


def test_a_file_without_statistics_is_counted(tmp_path: Path) -> None:
    path = tmp_path / "bare.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream, use_statistics=False)
        writer.start("ros2")
        schema = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data")
        channel = writer.register_channel("/words", "cdr", schema)
        writer.register_channel("/without", "cdr", 0)
        writer.add_message(channel, BEGIN, text("one"), BEGIN)
        writer.finish()  # type: ignore[no-untyped-call]
    with BagReader(path) as bag:
        assert {topic.name: (topic.type, count) for topic, count in bag.metadata.topics.items()} == {
            "/words": ("std_msgs/msg/String", 1),
            "/without": ("", 0),
        }


# -- what was cut ---------------------------------------------------------------------------------------------------------------


def test_of_a_cut_file_everything_up_to_its_last_whole_chunk_is_read(tmp_path: Path) -> None:
    """For every place where it may have been cut."""
    whole = write(tmp_path / "walk", [f"{number}" for number in range(1000)], step=25 * MS) / "walk_0.mcap"
    data = whole.read_bytes()
    with whole.open("rb") as stream:
        from mcap.reader import make_reader

        reader = make_reader(stream)
        summary = reader.get_summary()
        assert summary is not None
        ends = [one.chunk_start_offset + one.chunk_length for one in summary.chunk_indexes]
        sizes = [len(list(reader.iter_messages(ending_at=one.message_end_time))) for one in summary.chunk_indexes]
    cut = tmp_path / "cut.mcap"
    for length in [*range(8, len(data), 997), *ends, *(end - 1 for end in ends)]:
        cut.write_bytes(data[:length])
        found = Salvage()
        assert sum(1 for _ in McapReading(cut).salvage(found)) == found.messages
        assert found.damaged == 0, f"cut at {length}"
        whole_chunks = sum(1 for end in ends if end <= length)
        expected = sizes[whole_chunks - 1] if whole_chunks else 0
        assert words_of(cut) == [f"{number}" for number in range(expected)], f"cut at {length}"
    assert max(sizes) == 1000


def chunks_of(path: Path) -> list[Any]:
    with path.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    return summary.chunk_indexes


def test_a_damaged_chunk_is_left_out_and_counted(tmp_path: Path) -> None:
    whole = write(tmp_path / "walk", [f"{number}" for number in range(1000)]) / "walk_0.mcap"
    data = bytearray(whole.read_bytes())
    third = chunks_of(whole)[2]
    middle = third.chunk_start_offset + third.chunk_length // 2
    data[middle : middle + 20] = bytes(20)
    whole.write_bytes(data)
    found = Salvage()
    words = [decode(String, one.data).data for one in McapReading(whole).salvage(found)]
    assert words == [f"{number}" for number in range(1000) if not 202 <= number <= 302]
    assert (found.damaged, found.messages, found.complete) == (1, len(words), True)


def test_messages_whose_channel_was_in_a_damaged_chunk_are_counted(tmp_path: Path) -> None:
    whole = write(tmp_path / "walk", [f"{number}" for number in range(300)]) / "walk_0.mcap"
    data = bytearray(whole.read_bytes())
    first, *_, last = chunks_of(whole)
    data[first.chunk_start_offset + 60 : first.chunk_start_offset + 90] = bytes(30)
    whole.write_bytes(data)
    found = Salvage()
    words = [decode(String, one.data).data for one in McapReading(whole).salvage(found)]
    assert (words, found.damaged) == ([f"{number}" for number in range(101, 300)], 1), (
        "the summary knows the channel, too"
    )
    whole.write_bytes(data[: last.chunk_start_offset + last.chunk_length])
    found = Salvage()
    assert list(McapReading(whole).salvage(found)) == []
    assert found.damaged == 1 + 300 - 101
    with (
        BagReader(whole) as bag,
        pytest.raises(BagError, match=r"is damaged at byte \d+: .*; `bag recover .*walk_0.mcap -o NEW` writes"),
    ):
        list(bag.messages())


# -- what is no bag -------------------------------------------------------------------------------------------------------------


def test_what_is_no_bag_is_said_in_a_line(tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    (tmp_path / "notes.txt").write_text("hello")
    (tmp_path / "text.mcap").write_text("hello")
    (tmp_path / "text.db3").write_text("hello, this is no data base")
    (tmp_path / "text.mcap.zstd").write_text("hello")
    for name, said in (
        ("nowhere", "there is no bag"),
        ("empty", "is no bag: there is neither metadata.yaml nor a file of .mcap or .db3"),
        ("notes.txt", "is no file of a bag"),
        ("text.mcap", "is no MCAP file: it begins with b'hello'"),
        ("text.db3", "is no sqlite3 file of a bag"),
        ("text.mcap.zstd", "cannot be unpacked"),
    ):
        with pytest.raises(BagError) as caught:
            BagReader(tmp_path / name)
        assert said in str(caught.value)
        assert "\n" not in str(caught.value)


def test_metadata_that_are_none_are_said_with_the_way_out(tmp_path: Path) -> None:
    path = write(tmp_path / "walk", WORDS)
    for broken in ("{", "version: 9", "rosbag2_bagfile_information: {version: 9}", "[]"):
        (path / "metadata.yaml").write_text(broken)
        with pytest.raises(BagError, match=r"is no metadata of a bag .*; `bag reindex .*walk` writes it anew"):
            BagReader(path)
    with pytest.raises(BagError, match=r"metadata.yaml: No such file or directory; `bag reindex"):
        read_metadata(tmp_path)
    other = write(tmp_path / "other", WORDS)
    (other / "other_0.mcap").unlink()
    with pytest.raises(BagError, match=r"other_0\.mcap: No such file or directory"):
        BagReader(other)
    gone = foreign_bag(tmp_path / "gone", WORDS, StoragePlugin.SQLITE3)
    (gone / "gone.db3").unlink()
    with pytest.raises(BagError, match=r"gone\.db3: No such file or directory"):
        BagReader(gone)


# -- old versions ---------------------------------------------------------------------------------------------------------------


def test_a_bag_of_the_first_versions_is_read(tmp_path: Path) -> None:
    """Neither definitions, nor hashes, nor quality of service, nor a list of files."""
    path = tmp_path / "dashing"
    path.mkdir()
    database = sqlite3.connect(path / "dashing.db3")
    database.executescript(
        "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, serialization_format TEXT NOT NULL);"
        "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, data BLOB NOT NULL);"
        "INSERT INTO topics VALUES(1, '/words', 'std_msgs/msg/String', 'cdr');"
    )
    database.execute("INSERT INTO messages VALUES(1, 1, ?, ?)", (BEGIN, text("old")))
    database.commit()
    database.close()
    told = {
        "version": 1,
        "storage_identifier": "sqlite3",
        "relative_file_paths": ["dashing.db3"],
        "duration": {"nanoseconds": 0},
        "starting_time": {"nanoseconds_since_epoch": BEGIN},
        "message_count": 1,
        "topics_with_message_count": [
            {
                "topic_metadata": {"name": "/words", "type": "std_msgs/msg/String", "serialization_format": "cdr"},
                "message_count": 1,
            }
        ],
    }
    (path / "metadata.yaml").write_text(yaml.safe_dump({"rosbag2_bagfile_information": told}))
    assert words_of(path) == ["old"]
    with BagReader(path) as bag:
        assert (bag.topics[0].schema, bag.metadata.version, bag.metadata.ros_distro) == ("", 1, "")
        assert type_of(bag.topics[0]) is String


def test_quality_of_service_that_only_the_metadata_tell_is_taken_from_there(tmp_path: Path) -> None:
    path = unchunked(tmp_path / "fast_0.mcap").parent
    told = {
        "version": 5,
        "storage_identifier": "mcap",
        "relative_file_paths": ["fast_0.mcap"],
        "duration": {"nanoseconds": 2},
        "starting_time": {"nanoseconds_since_epoch": BEGIN},
        "message_count": 3,
        "topics_with_message_count": [
            {
                "topic_metadata": {
                    "name": "/words",
                    "type": "std_msgs/msg/String",
                    "serialization_format": "cdr",
                    "offered_qos_profiles": "- {history: 1, depth: 4}",
                },
                "message_count": 3,
            }
        ],
    }
    (path / "metadata.yaml").write_text(yaml.safe_dump({"rosbag2_bagfile_information": told}))
    with BagReader(path) as bag:
        assert bag.topics[0].offered_qos_profiles == "- {history: 1, depth: 4}"
    told["topics_with_message_count"] = []
    (path / "metadata.yaml").write_text(yaml.safe_dump({"rosbag2_bagfile_information": told}))
    with BagReader(path) as bag:
        assert [(topic.name, count) for topic, count in bag.metadata.topics.items()] == [("/words", 3)]


# -- types ----------------------------------------------------------------------------------------------------------------------


def test_a_type_that_is_known_here_only_by_the_bag_is_made_from_its_definition() -> None:
    line = "=" * 80
    schema = (
        f"Spot here\nSpot[] there\nstd_msgs/Header header\n{line}\nMSG: garden_msgs/Spot\nfloat64 x 0.5\n# Shade s\n"
    )
    schema += f"Shade shade\n{line}\nMSG: garden_msgs/Shade\nuint8 value\n"
    schema += f"{line}\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n"
    kind = type_of(BagTopic("/garden", "garden_msgs/msg/Garden", schema))
    assert [field.name for field in kind.__ros_fields__] == ["here", "there", "header"]
    assert kind().here.shade.value == 0
    assert type_of(BagTopic("/garden", "garden_msgs/msg/Garden", "")) is kind


def test_a_type_without_a_definition_is_named() -> None:
    with pytest.raises(BagError, match="/garden: unknown message 'garden_msgs/msg/Wall'"):
        type_of(BagTopic("/garden", "garden_msgs/msg/Wall"))
    with pytest.raises(BagError, match="/garden: the definition of garden_msgs/msg/Wall is not in its schema"):
        type_of(BagTopic("/garden", "garden_msgs/msg/Wall", "module garden_msgs {};", schema_encoding="ros2idl"))
    line = "=" * 80
    turning = f"Left left\n{line}\nMSG: turn_msgs/Left\nRight right\n{line}\nMSG: turn_msgs/Right\nLeft left\n"
    with pytest.raises(BagError, match="turn_msgs"):
        type_of(BagTopic("/turn", "turn_msgs/msg/Turn", turning))
