"""Every optional part of an MCAP file may be absent: the 416 files of the format's own conformance tests, and 154 such of ROS 2."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import pytest

from actors import Child, Topic
from actors.bag import BagError, BagReader, Player, PlayOptions, recover, reindex, rewrite
from actors.bag.mcap_reading import McapReading, Salvage
from actors.interfaces.std_msgs.msg import String
from actors.testing import Rig
from cli.verbs.bag import COMMAND
from tests.actors.bag.bags import text
from tests.actors.bag.mcap_variants import CONTENTS, TIMES, variants

ROS = {
    "Ros": [
        ("schema", 1, "std_msgs/msg/String", "ros2msg", b"string data\n"),
        ("channel", 1, 1, "/words", "cdr", {}),
        *(("message", 1, number, at, at, text(f"{number}")) for number, at in enumerate(TIMES)),
    ]
}
HEARD = ["0", "2", "1", "3", "4", "6", "5", "7", "8", "9"]
"""In order of receipt."""


def test_all_files_are_read_counted_and_copied(tmp_path: Path) -> None:
    count = 0
    for content, name, data in variants():
        path = tmp_path / f"{name}.mcap"
        path.write_bytes(data)
        messages = sorted((one for one in CONTENTS[content] if one[0] == "message"), key=lambda one: one[3])
        expected = [(one[3], one[4], one[5]) for one in messages]
        with BagReader(path) as bag:
            read = list(bag.messages())
            assert [(one.received_ns, one.published_ns, one.data) for one in read] == expected, name
            assert (bag.metadata.message_count, bag.cut) == (len(expected), False), name
            assert all(one.topic in bag.topics and one.topic.name == "example" for one in read), name
            assert bag.before(4, {"example": 2}) == [one for one in read if one.received_ns < 4][-2:], name
            if expected:
                assert (bag.metadata.start_ns, bag.metadata.end_ns) == (expected[0][0], expected[-1][0]), name
        found = Salvage()
        assert len(list(McapReading(path).salvage(found))) == len(expected), name
        assert (found.damaged, found.lost_bytes, found.complete) == (0, 0, True), name
        if content == "TenMessages":
            assert rewrite([path], tmp_path / name).message_count == 10, name
            with BagReader(tmp_path / name) as copy:
                assert [one.data for one in copy.messages()] == [b"\1\2\3"] * 10
                assert [(topic.name, topic.type, topic.schema_encoding) for topic in copy.topics] == [
                    ("example", "Example", "c")
                ]
        count += 1
    assert count == 416


def test_all_such_files_of_ros_2_are_echoed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for _, name, data in variants(ROS):
        path = tmp_path / f"{name}.mcap"
        path.write_bytes(data)
        assert COMMAND.main(["echo", str(path), "--field", "data"]) == 0, name
        assert capsys.readouterr().out.split() == [part for word in HEARD for part in (word, "---")], name


async def test_all_such_files_of_ros_2_are_played(rig: Rig, tmp_path: Path) -> None:
    files = list(variants(ROS))
    assert len(files) == 154
    players: list[Child] = []
    for number, (_, name, data) in enumerate(files):
        path = tmp_path / f"{name}.mcap"
        path.write_bytes(data)
        options = PlayOptions(paused=True, remap={"/words": f"/words_{number}"})
        players.append(Child(Player, name=f"player_{number}", args=(path, options)))
    await rig.start(*players)
    heard = [rig.probe(Topic(String, f"/words_{number}", 10)) for number in range(len(files))]
    for number in range(len(files)):
        player = rig.node(f"player_{number}")
        assert isinstance(player, Player)
        player.unpause()
        await player.wait()
    for (_, name, _), probe in zip(files, heard, strict=True):
        assert [message.data for message in probe] == HEARD, name


def what_is_read(path: Path) -> tuple[list[bytes], str]:
    """The messages of a file, and what is said of it if those are not all."""
    read: list[bytes] = []
    try:
        with BagReader(path) as bag:
            for one in bag.messages():
                read.append(one.data)
            return read, "it was cut" if bag.cut else ""
    except BagError as error:
        return read, str(error)


def test_flipped_bytes_are_seen_or_harmless(tmp_path: Path) -> None:
    """What a checksum covers is right, or `BagError` says what to do; `recover` writes the rest."""
    from random import Random

    random = Random(7)
    files = [data for _, name, data in variants(ROS) if "-ch-" in name and "chx" in name and "st" in name]
    path = tmp_path / "flipped.mcap"
    outcomes = {"right": 0, "said": 0}
    for number in range(400):
        data = bytearray(random.choice(files))
        for _ in range(random.choice((1, 1, 2, 8))):
            data[random.randrange(len(data))] ^= 1 << random.randrange(8)
        path.write_bytes(data)
        read, said = what_is_read(path)
        assert said or read == [text(word) for word in HEARD], number
        assert "\n" not in said
        outcomes["said" if said else "right"] += 1
        if said and data.startswith(b"\x89MCAP0\r\n"):
            recover(path, tmp_path / f"recovered_{number}")
    assert min(outcomes.values()) > 50, outcomes


@pytest.mark.parametrize(
    ("places", "kept"),
    [
        ({9: 2}, 0),  # the header becomes longer, and all that follows is something else
        ({25: 6 ^ 2}, 0),  # the chunk becomes a footer
        ({25: 6 ^ 15}, 0),  # the chunk becomes the end of the data
        ({25: 0x80}, 0),  # the chunk becomes a private record
        ({}, 10),
    ],
)
def test_a_chunk_that_became_another_record_is_missed_where_the_index_is_damaged_too(
    tmp_path: Path, places: dict[int, int], kept: int
) -> None:
    data = bytearray(next(data for _, name, data in variants(ROS) if name == "Ros-ch-chx-rch-rsh-st"))
    (start,) = struct.unpack("<Q", data[-8 - 20 : -8 - 12])
    data[data.index(struct.pack("<BQ", 11, 46 + 10), start)] ^= 0x80  # the statistics
    for at, flipped in places.items():
        data[at] ^= flipped
    path = tmp_path / "flipped.mcap"
    path.write_bytes(data)
    read, said = what_is_read(path)
    assert len(read) == kept
    assert "`bag recover" in said
    assert recover(path, tmp_path / "recovered").metadata.message_count == kept


def test_a_message_received_at_0_is_read_though_the_statistics_tell_of_a_later_start(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """As in rosbag2's own test data: its writer takes a time of 0 for none."""
    data = next(data for _, name, data in variants(ROS) if name == "Ros-ch-chx-rch-rsh-st")
    (start,) = struct.unpack("<Q", data[-8 - 20 : -8 - 12])
    summary = bytearray(data[start : -8 - 29])
    at = summary.index(struct.pack("<BQ", 11, 46 + 10)) + 9 + 8 + 2 + 4 * 4
    assert summary[at : at + 8] == bytes(8), "the first message was received at 0"
    summary[at : at + 8] = struct.pack("<Q", 1)
    footer = data[-8 - 29 : -8 - 4]
    path = tmp_path / "zero.mcap"
    crc = zlib.crc32(summary + footer) if struct.unpack("<I", data[-12:-8])[0] else 0
    path.write_bytes(data[:start] + summary + footer + struct.pack("<I", crc) + data[-8:])
    with BagReader(path) as bag:
        assert bag.metadata.start_ns == 1
        assert len(list(bag.messages(start_ns=1))) == 10
    assert COMMAND.main(["echo", str(path), "--field", "data"]) == 0
    assert len(capsys.readouterr().out.split()) == 20


def test_statistics_that_do_not_agree_with_the_file_are_said(tmp_path: Path) -> None:
    """The opcode of a message is damaged, so that it is none: that there are fewer than there should be is seen."""
    data = next(data for _, name, data in variants(ROS) if name == "Ros-rch-rsh-st")
    at = data.index(struct.pack("<BQH", 5, 22 + len(text("4")), 1) + struct.pack("<I", 4))
    path = tmp_path / "less.mcap"
    path.write_bytes(data[:at] + b"\x80" + data[at + 1 :])
    with (
        BagReader(path) as bag,
        pytest.raises(BagError, match="it holds 9 messages, and its statistics tell of 10; `bag recover"),
    ):
        list(bag.messages())
    assert recover(path, tmp_path / "recovered").damaged == 1


def test_a_summary_that_does_not_fit_its_file_is_not_believed(tmp_path: Path) -> None:
    """The index says that a chunk begins elsewhere, in statistics with a right checksum: the file itself is read."""
    data = next(data for _, name, data in variants(ROS) if name == "Ros-ch-chx-rch-rsh-st")
    start = struct.unpack("<Q", data[-8 - 20 : -8 - 12])[0]
    summary, chunk = bytearray(data[start : -8 - 29]), data.index(b"\6", 8 + 9 + 8)
    at = summary.rindex(struct.pack("<Q", chunk))
    for offset in (chunk + 1, 1, len(data)):
        summary[at : at + 8] = struct.pack("<Q", offset)
        footer = data[-8 - 29 : -8 - 4]
        path = tmp_path / f"moved_{offset}.mcap"
        path.write_bytes(
            data[:start] + summary + footer + struct.pack("<I", zlib.crc32(bytes(summary) + footer)) + data[-8:]
        )
        read, said = what_is_read(path)
        assert len(read) == 10 or "is damaged at byte" in said


def test_reindexing_keeps_what_only_the_note_of_rosbag2_in_a_file_tells(tmp_path: Path) -> None:
    from actors.bag import BagWriter, WriterOptions
    from tests.actors.bag.bags import BEGIN, WORDS

    with BagWriter(tmp_path / "walk", WriterOptions(custom_data={"robot": "dog"})) as bag:
        bag.write(WORDS, text("a"), received_ns=BEGIN, published_ns=BEGIN)
    before = (tmp_path / "walk" / "metadata.yaml").read_text()
    for broken in (None, "{", before):
        (tmp_path / "walk" / "metadata.yaml").unlink()
        if broken is not None:
            (tmp_path / "walk" / "metadata.yaml").write_text(broken)
        reindex(tmp_path / "walk")
        assert (tmp_path / "walk" / "metadata.yaml").read_text() == before
