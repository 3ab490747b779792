"""Bags that we write, as others read them: `rosbags` and `mcap`."""

from __future__ import annotations

import errno
from pathlib import Path

import pytest
import yaml
from mcap.reader import make_reader

from actors import qos
from actors.bag import BagError, BagReader, BagWriter, WriterOptions, topic_of
from actors.bag.mcap_stream import McapFile, McapStream
from actors.interfaces import encode
from actors.interfaces.geometry_msgs.msg import PoseStamped
from actors.interfaces.std_msgs.msg import Int32, String
from tests.actors.bag.bags import BEGIN, MS, NUMBERS, WORDS, by_mcap, by_rosbags, largest_file, text, words_of, write


@pytest.mark.parametrize("compression", ["none", "lz4", "zstd"])
def test_rosbags_and_mcap_read_what_we_write(tmp_path: Path, compression: str) -> None:
    words = [f"word {number}" for number in range(300)]
    bag = write(tmp_path / "walk", words, WriterOptions(compression=compression))
    expected = [("/words", BEGIN + 10 * MS * number, text(word)) for number, word in enumerate(words)]
    assert by_rosbags(bag) == expected
    assert by_mcap(bag / "walk_0.mcap") == [(topic, at, at - 3 * MS, data) for topic, at, data in expected]


def test_the_index_leads_to_every_message(tmp_path: Path) -> None:
    """Offsets, times and counts of the summary, as the `mcap` library finds single messages by them."""
    bag = write(tmp_path / "walk", [f"{number}" for number in range(1000)])
    with (bag / "walk_0.mcap").open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None
        assert summary.statistics is not None
        assert (summary.statistics.message_count, summary.statistics.chunk_count) == (1000, len(summary.chunk_indexes))
        assert len(summary.chunk_indexes) == 10, "10 s of messages, and a chunk each second"
        late = BEGIN + 9_000 * MS
        found = [one.data for _, _, one in reader.iter_messages(topics=["/words"], starting_at=late)]
    assert found == [text(f"{number}") for number in range(900, 1000)]


def test_every_channel_of_a_chunk_has_an_index_of_its_own(tmp_path: Path) -> None:
    with BagWriter(tmp_path / "walk") as bag:
        for number in range(10):
            bag.write(WORDS, text(f"{number}"), received_ns=BEGIN + number, published_ns=BEGIN)
            bag.write(NUMBERS, encode(Int32(data=number)), received_ns=BEGIN + number, published_ns=BEGIN)
    with (tmp_path / "walk" / "walk_0.mcap").open("rb") as stream:
        summary = make_reader(stream).get_summary()
        assert summary is not None
        (chunk,) = summary.chunk_indexes
        for channel, offset in chunk.message_index_offsets.items():
            stream.seek(offset)
            record = stream.read(11)
            assert (record[0], int.from_bytes(record[9:11], "little")) == (0x07, channel)
    assert len(chunk.message_index_offsets) == 2


def test_a_topic_carries_the_definition_the_hash_and_the_offered_quality_of_service(tmp_path: Path) -> None:
    poses = topic_of("/pose", PoseStamped, [qos.LATCHED])
    with BagWriter(tmp_path / "walk") as bag:
        bag.write(poses, encode(PoseStamped()), received_ns=BEGIN, published_ns=BEGIN)
        bag.add(NUMBERS)
    with (tmp_path / "walk" / "walk_0.mcap").open("rb") as stream:
        reader = make_reader(stream)
        assert reader.get_header().profile == "ros2"
        ((schema, channel, _),) = reader.iter_messages()
    assert schema is not None
    assert (schema.name, schema.encoding, channel.message_encoding) == (
        "geometry_msgs/msg/PoseStamped",
        "ros2msg",
        "cdr",
    )
    assert "MSG: geometry_msgs/Quaternion" in schema.data.decode()
    assert channel.metadata["topic_type_hash"].startswith("RIHS01_")
    told = yaml.safe_load((tmp_path / "walk" / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    assert [(one["topic_metadata"]["name"], one["message_count"]) for one in told["topics_with_message_count"]] == [
        ("/pose", 1),
        ("/numbers", 0),
    ]
    profiles = [one["topic_metadata"]["offered_qos_profiles"] for one in told["topics_with_message_count"]]
    assert [len(one) for one in profiles] == [1, 2]
    assert profiles[0][0]["durability"] == "transient_local"
    assert yaml.safe_load(channel.metadata["offered_qos_profiles"]) == profiles[0], "or rosbags yields nothing"


def test_a_bag_is_split_by_time_and_every_file_stands_by_itself(tmp_path: Path) -> None:
    words = [f"{number}" for number in range(100)]
    bag = write(tmp_path / "walk", words, WriterOptions(max_seconds=0.25))
    told = yaml.safe_load((bag / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    assert told["relative_file_paths"] == [f"walk_{number}.mcap" for number in range(4)]
    assert [file["message_count"] for file in told["files"]] == [25, 25, 25, 25]
    assert [file["starting_time"]["nanoseconds_since_epoch"] for file in told["files"]] == [
        BEGIN + 250 * MS * number for number in range(4)
    ]
    assert [file["duration"]["nanoseconds"] for file in told["files"]] == [240 * MS] * 4
    assert [data for _, _, data in by_rosbags(bag)] == [text(word) for word in words]
    assert [data for *_, data in by_mcap(bag / "walk_2.mcap")] == [text(word) for word in words[50:75]]


def test_a_bag_is_split_by_size(tmp_path: Path) -> None:
    bag = write(tmp_path / "walk", ["x" * 10_000] * 100, WriterOptions(max_bytes=200_000, compression="none"))
    sizes = [(bag / f"walk_{number}.mcap").stat().st_size for number in range(5)]
    assert all(200_000 <= size <= 215_000 for size in sizes), "one message more than the limit, and the index"
    assert len(words_of(bag)) == 100


def test_a_split_can_be_asked_for_and_names_both_files(tmp_path: Path) -> None:
    with BagWriter(tmp_path / "walk") as bag:
        bag.write(WORDS, text("one"), received_ns=BEGIN, published_ns=BEGIN)
        split = bag.split()
        assert (Path(split.closed).name, Path(split.opened).name) == ("walk_0.mcap", "walk_1.mcap")
        assert "being written: 1 messages of 1 topics" in repr(bag)
        bag.write(WORDS, text("two"), received_ns=BEGIN + MS, published_ns=BEGIN)
        assert bag.size > 0
        bag.flush()
    assert words_of(tmp_path / "walk") == ["one", "two"]


def test_large_messages_are_written_at_once(tmp_path: Path) -> None:
    path = tmp_path / "walk"
    with BagWriter(path, WriterOptions(compression="none")) as bag:
        bag.write(WORDS, text("x" * 2_000_000), received_ns=BEGIN, published_ns=BEGIN)
        assert (path / "walk_0.mcap").stat().st_size > 2_000_000
    assert bag.lost == 0


def test_texts_of_the_user_are_kept(tmp_path: Path) -> None:
    bag = write(tmp_path / "walk", ["a"], WriterOptions(custom_data={"robot": "äffchen", "run": "7"}))
    with BagReader(bag) as read:
        assert read.metadata.custom_data == {"robot": "äffchen", "run": "7"}


def test_a_folder_that_exists_is_not_touched(tmp_path: Path) -> None:
    (tmp_path / "walk").mkdir()
    with pytest.raises(BagError, match="walk exists already: give another name"):
        BagWriter(tmp_path / "walk")
    (tmp_path / "file").write_text("")
    with pytest.raises(BagError, match="cannot be made: Not a directory"):
        BagWriter(tmp_path / "file" / "walk")


def test_settings_without_a_meaning_are_refused() -> None:
    with pytest.raises(ValueError, match="'gzip' is no compression of a bag: use one of none, lz4, zstd"):
        WriterOptions(compression="gzip")
    with pytest.raises(ValueError, match="cannot be split at -1 bytes"):
        WriterOptions(max_bytes=-1)


def test_an_empty_bag_is_a_bag(tmp_path: Path) -> None:
    with BagWriter(tmp_path / "walk"):
        pass
    assert by_rosbags(tmp_path / "walk") == []
    with BagReader(tmp_path / "walk") as bag:
        assert (bag.metadata.message_count, bag.metadata.start_ns, bag.metadata.duration_ns, bag.cut) == (
            0,
            0,
            0,
            False,
        )


# -- a full disk ----------------------------------------------------------------------------------------------------------------


def test_when_the_disk_is_full_what_was_written_stays_readable(tmp_path: Path) -> None:
    path = tmp_path / "walk"
    with largest_file(600_000):
        bag = BagWriter(path, WriterOptions(compression="none"))
        with pytest.raises(OSError) as full:
            for number in range(1000):
                at = BEGIN + number * 50 * MS
                bag.write(WORDS, text(f"{number} {'x' * 1000}"), received_ns=at, published_ns=at)
        assert full.value.errno == errno.EFBIG
        bag.close()
    kept = words_of(path)
    assert kept == [f"{number} {'x' * 1000}" for number in range(len(kept))]
    assert 500 < len(kept) < 600
    assert bag.lost == bag.given - len(kept) > 0
    assert [data for _, _, data in by_rosbags(path)] == [text(word) for word in kept], "the index is there"
    with BagReader(path) as read:
        assert (read.metadata.message_count, read.cut) == (len(kept), False)


def test_writing_can_go_on_when_there_is_room_again(tmp_path: Path) -> None:
    path = tmp_path / "walk"
    bag = BagWriter(path, WriterOptions(compression="none"))
    with largest_file(1000), pytest.raises(OSError):
        bag.write(WORDS, text("x" * 2_000_000), received_ns=BEGIN, published_ns=BEGIN)
    bag.write(WORDS, text("later"), received_ns=BEGIN + MS, published_ns=BEGIN)
    bag.write(NUMBERS, encode(Int32(data=1)), received_ns=BEGIN + MS, published_ns=BEGIN)
    bag.close()
    assert words_of(path) == ["later"]
    assert bag.lost == 1
    assert len(by_rosbags(path)) == 2


def test_a_bag_without_room_for_its_index_is_read_from_front_to_back(tmp_path: Path) -> None:
    path = tmp_path / "walk"
    bag = BagWriter(path, WriterOptions(compression="none"))
    for number in range(100):
        at = BEGIN + number * 100 * MS
        bag.write(WORDS, text(f"{number}"), received_ns=at, published_ns=at)
    with largest_file((path / "walk_0.mcap").stat().st_size), pytest.raises(OSError):
        bag.close()
    with BagReader(path) as read:
        assert read.cut
    assert words_of(path) == [f"{number}" for number in range(99)], "the last chunk was not written"
    bag.close()
    assert bag.lost == 1


def test_an_open_file_is_closed_once_and_its_compression_is_known(tmp_path: Path) -> None:
    stream = McapStream(tmp_path / "alone.mcap")
    stream.close()
    size = (tmp_path / "alone.mcap").stat().st_size
    stream.close()
    assert (tmp_path / "alone.mcap").stat().st_size == size
    with pytest.raises(BagError, match="'gzip' is no compression of a bag"):
        McapStream(tmp_path / "other.mcap", compression="gzip")


def test_a_flight_record_that_finds_no_room_leaves_nothing_behind(tmp_path: Path) -> None:
    path = tmp_path / "flight.mcap"
    with largest_file(500), pytest.raises(OSError), McapFile(path) as file:
        channel = file.channel("/words", String, [])
        file.write(channel, text("x" * 1000), received_ns=BEGIN, published_ns=BEGIN)
    with largest_file(500), pytest.raises(ZeroDivisionError), McapFile(path) as file:
        channel = file.channel("/words", String, [])
        file.write(channel, text("x" * 1000), received_ns=BEGIN, published_ns=BEGIN)
        raise ZeroDivisionError
    assert list(tmp_path.iterdir()) == []


def test_a_disk_that_is_full_from_the_start_is_said(tmp_path: Path) -> None:
    with largest_file(1000), pytest.raises(BagError, match="walk cannot be written: File too large"):
        BagWriter(tmp_path / "walk")
    assert list((tmp_path / "walk").iterdir()) == []
    with largest_file(4), pytest.raises(OSError):
        McapStream(tmp_path / "alone.mcap")
