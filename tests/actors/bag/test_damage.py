"""Bags that are damaged, or are none of ours: what is said, and what is recovered."""

from __future__ import annotations

import sqlite3
import struct
import zlib
from pathlib import Path

import lz4.frame
import pytest
import zstandard
from mcap.writer import Writer
from rosbags.rosbag2 import CompressionMode, StoragePlugin

from actors import Child, Topic
from actors.bag import BagError, BagReader, BagTopic, BagWriter, Player, PlayOptions, WriterOptions, recover, reindex
from actors.bag import mcap_records as record
from actors.bag.mcap_reading import McapReading, Salvage
from actors.bag.metadata import noted
from actors.bag.sqlite_reading import SqliteReading
from actors.bag.yaml_text import load_yaml
from actors.interfaces.std_msgs.msg import String
from actors.testing import Rig
from tests.actors.bag.bags import BEGIN, MS, foreign_bag, text, words_of, write
from tests.actors.bag.mcap_variants import variants

WORDS = [f"word {number}" for number in range(50)]


@pytest.mark.parametrize(
    ("begin", "said"),
    [
        (b"#ROSBAG V2.0\n", r"is a bag of ROS 1: convert it by .*`rosbags-convert --src .*other --dst NEW`"),
        (
            b"version https://git-lfs.github.com/spec/v1\n",
            "is a pointer of Git LFS, not the file itself: run `git lfs pull`",
        ),
        (b"PK\3\4", "is a ZIP archive"),
        (b"\x1f\x8b", "is compressed by gzip"),
        (b"", "is empty"),
    ],
)
def test_what_is_of_another_format_is_named_with_the_way_out(tmp_path: Path, begin: bytes, said: str) -> None:
    path = tmp_path / "other"
    path.write_bytes(begin)
    for use in (BagReader, lambda path: recover(path, tmp_path / "new")):
        with pytest.raises(BagError, match=said):
            use(path)
    with pytest.raises(BagError, match=said):
        McapReading(path)


def test_a_file_of_a_bag_that_has_gone_is_named(tmp_path: Path) -> None:
    for reading in (McapReading, SqliteReading):
        with pytest.raises(BagError, match=r"gone\.bag: (No such file|there is no such file)"):
            reading(tmp_path / "gone.bag")


def test_files_are_known_by_their_contents_not_by_their_names(tmp_path: Path) -> None:
    ours = write(tmp_path / "walk", WORDS) / "walk_0.mcap"
    theirs = foreign_bag(tmp_path / "old", WORDS, StoragePlugin.SQLITE3) / "old.db3"
    for number, path in enumerate((ours, theirs)):
        renamed = tmp_path / f"renamed_{number}.bag"
        renamed.write_bytes(path.read_bytes())
        assert words_of(renamed) == WORDS


async def test_a_player_plays_up_to_the_damage_and_ends_with_the_reason(rig: Rig, tmp_path: Path) -> None:
    path = (
        write(tmp_path / "walk", [f"{number}" for number in range(300)], WriterOptions(compression="none"))
        / "walk_0.mcap"
    )
    data = bytearray(path.read_bytes())
    at = data.index(text("150"))
    data[at + 8] ^= 1
    path.write_bytes(data)
    await rig.start(Child(Player, args=(path, PlayOptions(paused=True))))
    heard, play = rig.probe(Topic(String, "/words", 1000)), rig.node(Player)
    rig.expect_failure(BagError)
    play.unpause()
    await play.wait()
    assert [message.data for message in heard] == [f"{number}" for number in range(101)]
    assert (play.over, play.played) == (True, 101)
    assert "the checksum of a chunk does not agree with its data; `bag recover" in str(play.failure)


def test_a_message_that_was_compressed_alone_and_is_damaged_is_said_and_left_out_by_recover(tmp_path: Path) -> None:
    bag = foreign_bag(tmp_path / "walk", WORDS, StoragePlugin.SQLITE3, compression=CompressionMode.MESSAGE)
    (bag / "metadata.yaml").unlink()
    assert words_of(bag) == WORDS, "it is seen that they are compressed"
    database = sqlite3.connect(bag / "walk.db3")
    (data,) = database.execute("SELECT data FROM messages WHERE id = 7").fetchone()
    database.execute("UPDATE messages SET data = ? WHERE id = 7", (data[:-6],))
    database.execute(
        "UPDATE messages SET data = ? WHERE id = 8", (b"\x28\xb5\x2f\xfd\xe0" + struct.pack("<Q", 1 << 40) + bytes(8),)
    )
    database.commit()
    database.close()
    with pytest.raises(BagError, match=r"a message of /words, received at \d+, is damaged: .*`bag recover"):
        words_of(bag)
    assert recover(bag, tmp_path / "new").damaged == 2
    assert words_of(tmp_path / "new") == [word for number, word in enumerate(WORDS, 1) if number not in (7, 8)]


def test_a_damaged_page_of_sqlite3_is_said_and_the_rest_is_recovered(tmp_path: Path) -> None:
    words = [f"{number:04d}" * 50 for number in range(400)]
    bag = foreign_bag(tmp_path / "walk", words, StoragePlugin.SQLITE3)
    path = bag / "walk.db3"
    whole = path.read_bytes()
    assert recover(bag, tmp_path / "whole").metadata.message_count == 400
    at = whole.index(words[200].encode()) // 4096 * 4096
    path.write_bytes(whole[:at] + bytes(4096) + whole[at + 4096 :])
    with (
        pytest.raises(BagError, match=r"walk\.db3 is damaged: .*; `bag recover .* -o NEW` writes what can be read"),
        BagReader(bag) as read,
    ):
        list(read.messages())
    found = recover(bag, tmp_path / "new")
    kept = words_of(tmp_path / "new")
    assert found.damaged >= 1
    assert 300 < len(kept) < 400
    assert [word for word in words if word in set(kept)] == kept
    path.write_bytes(whole)
    database = sqlite3.connect(path)
    database.execute("UPDATE messages SET data = 5 WHERE id = 3")
    database.commit()
    database.close()
    with pytest.raises(BagError, match="a message has no topic, no time or no data"):
        words_of(bag)
    assert recover(bag, tmp_path / "odd").damaged == 1


def test_a_chunk_of_mcap_without_messages_hinders_nothing_in_a_file_that_was_cut_off(tmp_path: Path) -> None:
    path = tmp_path / "walk.mcap"
    with path.open("wb") as stream:
        writer = Writer(stream, chunk_size=1)
        writer.start("ros2", "another recorder")
        schema = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data\n")
        channel = writer.register_channel("/words", "cdr", schema)
        header = stream.tell()
        writer.add_message(channel, BEGIN, text("a"), BEGIN)
        first = stream.tell()
        writer.finish()
    data = path.read_bytes()
    empty = struct.pack("<QQQIIQ", 0, 0, 0, 0, 0, 0)
    chunk = struct.pack("<BQ", 6, len(empty)) + empty
    path.write_bytes(data[:header] + chunk + data[header:first])
    with BagReader(path) as read:
        assert [(message.topic.name, message.received_ns) for message in read.messages()] == [("/words", BEGIN)]
        assert read.metadata.message_count == 1


def test_of_a_sqlite3_file_whose_last_page_is_damaged_all_before_it_is_recovered(tmp_path: Path) -> None:
    words = [f"{number:04d}" * 50 for number in range(400)]
    bag = foreign_bag(tmp_path / "walk", words, StoragePlugin.SQLITE3)
    path = bag / "walk.db3"
    whole = path.read_bytes()
    at = whole.index(words[-1].encode()) // 4096 * 4096
    path.write_bytes(whole[:at] + bytes(4096) + whole[at + 4096 :])
    assert recover(bag, tmp_path / "new").damaged >= 1
    kept = words_of(tmp_path / "new")
    assert 300 < len(kept) < 400 and kept == words[: len(kept)]


def test_a_damaged_text_time_or_index_of_sqlite3_is_said(tmp_path: Path) -> None:
    bag = foreign_bag(tmp_path / "walk", WORDS, StoragePlugin.SQLITE3)
    path = bag / "walk.db3"
    whole = path.read_bytes()

    def changed(*statements: str) -> None:
        path.write_bytes(whole)
        database = sqlite3.connect(path)
        for statement in statements:
            database.execute(statement)
        database.commit()
        database.close()

    path.write_bytes(whole.replace(b"data BLOB", b"data B\xcc\xcfB").replace(b"CREATE TABLE", b"CREAT\xc5 TABLE"))
    with pytest.raises(BagError, match=r"walk\.db3 is no sqlite3 file of a bag: "):
        BagReader(bag)
    changed("UPDATE messages SET timestamp = x'00' WHERE id = 3")
    with pytest.raises(BagError, match=r"walk\.db3 is damaged: a message has no time; `bag recover"):
        BagReader(bag)
    assert recover(bag, tmp_path / "timeless").damaged == 1
    changed()
    database = sqlite3.connect(path)
    database.execute("PRAGMA writable_schema = ON")
    (index,) = database.execute("SELECT * FROM sqlite_master WHERE name = 'timestamp_idx'").fetchall()
    database.execute("DELETE FROM sqlite_master WHERE name = 'timestamp_idx'")
    database.commit()
    database.close()
    database = sqlite3.connect(path)  # which knows of no index
    database.execute("INSERT INTO messages(topic_id, timestamp, data) SELECT topic_id, timestamp, data FROM messages")
    database.execute("PRAGMA writable_schema = ON")
    database.execute("INSERT INTO sqlite_master VALUES (?, ?, ?, ?, ?)", index)
    database.commit()
    database.close()
    with (
        BagReader(bag) as read,
        pytest.raises(BagError, match="it holds 100 messages, and 50 are found by their times; `bag recover"),
    ):
        list(read.messages())
    assert recover(bag, tmp_path / "lacking").metadata.message_count == 100


def test_a_packed_file_is_recovered_as_far_as_it_can_be_unpacked(tmp_path: Path) -> None:
    bag = foreign_bag(tmp_path / "walk", [word * 400 for word in WORDS] * 20, compression=CompressionMode.FILE)
    assert recover(bag, tmp_path / "whole").metadata.message_count == 1000
    (packed,) = bag.glob("*.zstd")
    plain = zstandard.ZstdDecompressor().stream_reader(packed.read_bytes()).read()
    data = bytearray(zstandard.compress(plain))
    data[-1] ^= 1  # of the checksum
    packed.write_bytes(data)
    with pytest.raises(BagError, match="cannot be unpacked"):
        BagReader(bag)
    assert 500 < recover(bag, tmp_path / "most").metadata.message_count < 1000
    packed.write_bytes(b"\x28\xb5\x2f\xfd" + b"\xff" * 10)
    for use in (BagReader, lambda bag: recover(bag, tmp_path / "nothing")):
        with pytest.raises(BagError, match=r"walk\.mcap\.zstd (cannot be unpacked: .*`bag recover|is no MCAP file)"):
            use(bag)


def test_a_damaged_quality_of_service_hinders_nothing(tmp_path: Path) -> None:
    topic = BagTopic("/words", "std_msgs/msg/String", "string data\n", "- history: keep_last\n  \x01[depth: 5: -")
    with BagWriter(tmp_path / "walk") as bag:
        bag.write(topic, text("a"), received_ns=BEGIN, published_ns=BEGIN)
    assert reindex(tmp_path / "walk").message_count == 1
    recover(tmp_path / "walk", tmp_path / "new")
    with BagReader(tmp_path / "new") as read:
        assert read.topics[0].offered_qos_profiles == ""
    assert words_of(tmp_path / "new") == ["a"]


# -- records --------------------------------------------------------------------------------------------------------------------


def chunk(compression: bytes, packed: bytes, size: int, crc: int = 0) -> bytes:
    return (
        struct.pack("<QQQI", 0, 0, size, crc)
        + struct.pack("<I", len(compression))
        + compression
        + struct.pack("<Q", len(packed))
        + packed
    )


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (chunk(b"", b"abc", 3, 1), "the checksum of a chunk does not agree"),
        (chunk(b"", b"abc", 4), "a chunk holds 3 bytes, not 4"),
        (chunk(b"", b"abc", 1 << 40), "a chunk says that it holds"),
        (chunk(b"lzma", b"abc", 3), "compressed by 'lzma'"),
        (chunk(b"\xff", b"abc", 3), "a text is not in UTF-8"),
        (chunk(b"zstd", b"abc", 3), "unable|error|frame|header"),
        (chunk(b"zstd", zstandard.compress(b"abc"), 5), "do not have the size that their chunk tells"),
        (chunk(b"lz4", bytes(40), 3), "ERROR|frame|failed"),
        (chunk(b"", b"abc", 3)[:-1], "a record ends too early"),
        (b"", "a record ends too early"),
    ],
)
def test_a_damaged_chunk_says_why(data: bytes, said: str) -> None:
    with pytest.raises(record.Damaged, match=said):
        record.unpacked(data)


def test_whole_chunks_are_unpacked() -> None:
    for compression, packed in (
        (b"", b"abc"),
        (b"zstd", zstandard.compress(b"abc")),
        (b"lz4", lz4.frame.compress(b"abc")),
    ):
        assert record.unpacked(chunk(compression, packed, 3, zlib.crc32(b"abc"))) == b"abc"
        assert record.unpacked(chunk(compression, b"", 0)) == b""


def test_records_that_do_not_fit_say_so() -> None:
    for data in (b"\5\1", struct.pack("<BQ", 5, 9)):
        with pytest.raises(record.Damaged):
            list(record.records(data))
    with pytest.raises(record.Damaged, match="too early"):
        record.statistics(struct.pack("<QHIIIIQQ", 0, 0, 0, 0, 0, 0, 0, 0) + struct.pack("<I", 3) + b"abc")
    with pytest.raises(record.Damaged, match="too early"):
        record.channel(struct.pack("<HHI", 1, 1, 200) + b"abc")


def test_a_message_or_channel_that_is_damaged_is_the_only_one_lost(tmp_path: Path) -> None:
    """In a file without chunks, and in one whose chunk has no checksum."""
    ros = {"Ros": [("schema", 1, "std_msgs/msg/String", "ros2msg", b""), ("channel", 1, 1, "/words", "cdr", {}),
                   *(("message", 1, number, number, 0, text("x" * 20)) for number in range(4))]}  # fmt: skip
    bare = next(data for _, name, data in variants(ros) if name == "Ros")
    at = bare.index(struct.pack("<BQHI", 5, 22 + len(text("x" * 20)), 1, 2))
    path = tmp_path / "bare.mcap"
    short = struct.pack("<BQ", 5, 3) + b"abc"
    path.write_bytes(bare[:at] + short + bare[at:])
    found = Salvage()
    assert len(list(McapReading(path).salvage(found))) == 4
    assert found.damaged == 1
    with pytest.raises(BagError, match="a message ends too early"), BagReader(path) as bag:
        list(bag.messages())
    records = b"".join(bare[at + 0 : at + 9 + 22 + len(text("x" * 20))] for _ in range(2)) + short
    start = bare.index(struct.pack("<BQHI", 5, 22 + len(text("x" * 20)), 1, 0))
    end = bare.index(struct.pack("<BQ", 15, 4))
    body = (
        struct.pack("<QQQI", 2, 2, len(records), 0) + struct.pack("<I", 0) + struct.pack("<Q", len(records)) + records
    )
    path.write_bytes(bare[:start] + struct.pack("<BQ", 6, len(body)) + body + bare[end:])
    found = Salvage()
    assert len(list(McapReading(path).salvage(found))) == 2
    assert found.damaged == 1
    unknown = bare.replace(
        struct.pack("<BQHI", 5, 22 + len(text("x" * 20)), 1, 3), struct.pack("<BQHI", 5, 22 + len(text("x" * 20)), 9, 3)
    )
    path.write_bytes(unknown)
    with pytest.raises(BagError, match="the channel 9 of a message is not described"), BagReader(path) as bag:
        list(bag.messages())
    reading = McapReading(path)
    path.write_bytes(b"")
    with pytest.raises(BagError, match="the file has become shorter"):
        list(reading.messages(0, None))


def test_large_files_without_chunks_are_read_in_pieces(tmp_path: Path) -> None:
    words = [f"{number}" * 20_000 for number in range(30)]
    ros = {"Ros": [("schema", 1, "std_msgs/msg/String", "ros2msg", b"string data"), ("channel", 1, 1, "/words", "cdr", {}),
                   *(("message", 1, number, BEGIN + (29 - number) * MS, 0, text(word)) for number, word in enumerate(words))]}  # fmt: skip
    path = tmp_path / "bare.mcap"
    path.write_bytes(next(data for _, name, data in variants(ros) if name == "Ros"))
    assert words_of(path) == list(reversed(words))


def test_metadata_that_are_no_text_of_ours_are_said(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="levels deep"):
        load_yaml("[" * 20_000)
    assert noted([{}, {"serialized_metadata": "["}, {"serialized_metadata": "1"}]) is None
    bag = write(tmp_path / "walk", WORDS)
    told = (bag / "metadata.yaml").read_text()
    (bag / "metadata.yaml").write_text(told.replace("message_count: 50", "message_count: .inf"))
    with pytest.raises(BagError, match="is no metadata of a bag"):
        BagReader(bag)
