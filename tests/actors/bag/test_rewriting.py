"""Bags made from bags: converted, filtered, merged, indexed anew, recovered."""

from __future__ import annotations

from pathlib import Path

import pytest
from rosbags.rosbag2 import StoragePlugin

from actors.bag import BagError, BagReader, BagTopic, BagWriter, Selection, WriterOptions, recover, reindex, rewrite
from actors.interfaces import encode
from actors.interfaces.std_msgs.msg import Int32
from tests.actors.bag.bags import BEGIN, MS, NUMBERS, WORDS, by_mcap, by_rosbags, foreign_bag, text, words_of, write


def test_a_sqlite3_bag_becomes_one_in_mcap(tmp_path: Path) -> None:
    old = foreign_bag(tmp_path / "old", ["a", "b", "c"], StoragePlugin.SQLITE3)
    metadata = rewrite([old], tmp_path / "new")
    assert metadata.message_count == 3
    assert by_rosbags(tmp_path / "new") == by_rosbags(old)


def test_some_topics_and_some_time_are_kept_with_both_times_of_each_message(tmp_path: Path) -> None:
    with BagWriter(tmp_path / "all") as bag:
        for number in range(100):
            at = BEGIN + number * 10 * MS
            bag.write(NUMBERS, encode(Int32(data=number)), received_ns=at, published_ns=at - 1)
            bag.write(WORDS, text(f"{number}"), received_ns=at, published_ns=at - 2)
    rewrite(
        [tmp_path / "all"],
        tmp_path / "some",
        selection=Selection(topics=["words"]),
        start_ns=BEGIN + 200 * MS,
        end_ns=BEGIN + 500 * MS,
    )
    assert words_of(tmp_path / "some") == [f"{number}" for number in range(20, 50)]
    assert by_mcap(tmp_path / "some" / "some_0.mcap")[0] == (
        "/words", BEGIN + 200 * MS, BEGIN + 200 * MS - 2, text("20")
    )  # fmt: skip
    with BagReader(tmp_path / "some") as some:
        assert [topic.name for topic in some.topics] == ["/words"]
        assert some.topics[0] == WORDS


def test_of_a_topic_with_two_types_one_may_be_kept(tmp_path: Path) -> None:
    with BagWriter(tmp_path / "all") as bag:
        number = BagTopic("/words", "std_msgs/msg/Int32", NUMBERS.schema)
        bag.write(number, encode(Int32(data=1)), received_ns=BEGIN, published_ns=BEGIN)
        bag.write(WORDS, text("a"), received_ns=BEGIN + MS, published_ns=BEGIN)
    rewrite([tmp_path / "all"], tmp_path / "some", selection=Selection(types=["std_msgs/msg/String"]))
    assert words_of(tmp_path / "some") == ["a"]


def test_bags_are_merged_in_the_order_of_receipt(tmp_path: Path) -> None:
    a = write(tmp_path / "a", [f"a{number}" for number in range(4)])
    b = write(tmp_path / "b", [f"b{number}" for number in range(4)], step=15 * MS)
    seen: list[int] = []
    rewrite([a, b], tmp_path / "both", progress=seen.append)
    assert words_of(tmp_path / "both") == ["a0", "b0", "a1", "b1", "a2", "a3", "b2", "b3"]
    assert seen == []


def test_progress_is_told_now_and_then(tmp_path: Path) -> None:
    seen: list[int] = []
    rewrite([write(tmp_path / "long", ["w"] * 2500, step=MS)], tmp_path / "again", progress=seen.append)
    assert seen == [1000, 2000]


def test_a_definition_that_the_bag_lacks_is_that_of_this_process(tmp_path: Path) -> None:
    with BagWriter(tmp_path / "bare") as bag:
        bag.write(BagTopic("/words", "std_msgs/msg/String"), text("a"), received_ns=BEGIN, published_ns=BEGIN)
    rewrite([tmp_path / "bare"], tmp_path / "whole")
    with BagReader(tmp_path / "whole") as bag:
        assert (bag.topics[0].schema, bag.topics[0].type_hash) == (WORDS.schema, WORDS.type_hash)


def test_what_nobody_defines_is_copied_too(tmp_path: Path) -> None:
    """Bytes need no definition, in whatever encoding they are."""
    topics = [
        BagTopic("/wall", "garden_msgs/msg/Brick"),
        BagTopic("/json", "Pose", "{}", schema_encoding="jsonschema", serialization_format="json"),
        BagTopic("/bare", "", serialization_format="json"),
    ]
    with BagWriter(tmp_path / "strange") as strange:
        for topic in topics:
            strange.write(topic, b"\0\1\0\0\5\0\0\0", received_ns=BEGIN, published_ns=BEGIN)
    rewrite([tmp_path / "strange"], tmp_path / "copy")
    recover(tmp_path / "strange", tmp_path / "recovered")
    for path in (tmp_path / "copy", tmp_path / "recovered"):
        with BagReader(path) as bag:
            assert list(bag.topics) == topics
            assert [one.data for one in bag.messages()] == [b"\0\1\0\0\5\0\0\0"] * 3


def test_metadata_are_written_anew_from_the_files(tmp_path: Path) -> None:
    bag = write(tmp_path / "walk", [f"{number}" for number in range(100)], WriterOptions(max_seconds=0.5))
    before = (bag / "metadata.yaml").read_text()
    (bag / "metadata.yaml").unlink()
    assert reindex(bag).message_count == 100
    assert (bag / "metadata.yaml").read_text() == before
    assert len(by_rosbags(bag)) == 100
    (bag / "metadata.yaml").write_text("broken: {")
    reindex(bag)
    assert words_of(bag) == [f"{number}" for number in range(100)]


def test_reindexing_keeps_the_texts_that_somebody_has_added_to_the_metadata(tmp_path: Path) -> None:
    bag = write(tmp_path / "walk", ["a"], WriterOptions(custom_data={"robot": "dog"}))
    metadata = bag / "metadata.yaml"
    metadata.write_text(metadata.read_text().replace("robot: dog", "robot: dog\n    place: kitchen"))
    reindex(bag)
    with BagReader(bag) as read:
        assert read.metadata.custom_data == {"robot": "dog", "place": "kitchen"}


def test_reindexing_wants_the_folder_of_a_bag(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(BagError, match="is no folder: a bag is a folder with its files"):
        reindex(tmp_path / "file")
    (tmp_path / "metadata.yaml").write_text("")
    with pytest.raises(BagError, match="is no bag"):
        reindex(tmp_path)
    assert (tmp_path / "metadata.yaml").exists(), "nothing is removed from what is no bag"


def test_a_cut_bag_is_recovered_as_a_whole_one_and_is_itself_not_changed(tmp_path: Path) -> None:
    bag = write(tmp_path / "walk", [f"{number}" for number in range(1000)], WriterOptions(max_seconds=5))
    (bag / "metadata.yaml").unlink()
    last = bag / "walk_1.mcap"
    data = last.read_bytes()
    last.write_bytes(data[: len(data) // 2])
    found = recover(bag, tmp_path / "whole")
    count = found.metadata.message_count
    assert 600 < count < 1000
    assert found.damaged == 0
    assert 0 < found.lost_bytes < len(data) // 2
    assert [one for _, _, one in by_rosbags(tmp_path / "whole")] == [text(f"{number}") for number in range(count)]
    assert last.read_bytes() == data[: len(data) // 2]
    again = recover(last, tmp_path / "alone", options=WriterOptions(compression="lz4"))
    assert again.metadata.message_count == count - 500


def test_there_must_be_something_to_recover(tmp_path: Path) -> None:
    with pytest.raises(BagError, match="there is no bag"):
        recover(tmp_path / "nothing", tmp_path / "new")
    (tmp_path / "text.mcap").write_text("hello")
    with pytest.raises(BagError, match="is no MCAP file"):
        recover(tmp_path / "text.mcap", tmp_path / "new")
    assert not (tmp_path / "new").exists()
