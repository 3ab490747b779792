"""Bags for tests, and other people's readers of them."""

from __future__ import annotations

import resource
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from mcap.reader import make_reader
from rosbags import rosbag2
from rosbags.typesys import Stores, get_typestore

from actors import qos
from actors.bag import BagReader, BagWriter, WriterOptions, topic_of
from actors.interfaces import encode
from actors.interfaces.std_msgs.msg import Int32, String

BEGIN = 1_700_000_000_000_000_000
"""A time of day, in nanoseconds since 1970."""

MS = 1_000_000
WORDS = topic_of("/words", String, [qos.DEFAULT])
NUMBERS = topic_of("/numbers", Int32, [qos.LATCHED, qos.SENSOR_DATA])


def text(word: str) -> bytes:
    return encode(String(data=word))


def write(path: Path, words: Sequence[str], options: WriterOptions | None = None, *, step: int = 10 * MS) -> Path:
    """A bag with these words, one every `step` nanoseconds, each sent 3 ms before it was received."""
    with BagWriter(path, options) as bag:
        for number, word in enumerate(words):
            at = BEGIN + number * step
            bag.write(WORDS, text(word), received_ns=at, published_ns=at - 3 * MS)
    return path


def words_of(path: Path) -> list[str]:
    """The words of a bag, by our reader."""
    from actors.interfaces import decode

    with BagReader(path) as bag:
        return [decode(String, message.data).data for message in bag.messages({"/words"})]


def by_rosbags(path: Path) -> list[tuple[str, int, bytes]]:
    """Topic, receive time and bytes of each message, as `rosbags` reads the bag."""
    with rosbag2.Reader(path) as bag:
        return [(connection.topic, at, bytes(data)) for connection, at, data in bag.messages()]


def by_mcap(path: Path) -> list[tuple[str, int, int, bytes]]:
    """Topic, both times and bytes of each message of a file, as `mcap` reads it."""
    with path.open("rb") as stream:
        found = make_reader(stream, validate_crcs=True).iter_messages()
        return [(channel.topic, one.log_time, one.publish_time, one.data) for _, channel, one in found]


def foreign_bag(
    path: Path,
    words: Sequence[str],
    plugin: rosbag2.StoragePlugin = rosbag2.StoragePlugin.MCAP,
    *,
    version: int = 9,
    compression: rosbag2.CompressionMode = rosbag2.CompressionMode.NONE,
) -> Path:
    """A bag with these words that `rosbags` has written."""
    store = get_typestore(Stores.ROS2_JAZZY)
    kind = store.types["std_msgs/msg/String"]
    writer = rosbag2.Writer(path, version=version, storage_plugin=plugin)  # type: ignore[arg-type]
    if compression is not rosbag2.CompressionMode.NONE:
        writer.set_compression(compression, rosbag2.CompressionFormat.ZSTD)
    with writer:
        connection = writer.add_connection("/words", "std_msgs/msg/String", typestore=store)
        for number, word in enumerate(words):
            data = store.serialize_cdr(kind(word), "std_msgs/msg/String")  # type: ignore[call-arg]
            writer.write(connection, BEGIN + number * 10 * MS, data)
    return path


@contextmanager
def largest_file(size: int) -> Iterator[None]:
    """No file may become larger than this, as on a full disk."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
