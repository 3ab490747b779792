"""Reading MCAP files: by their index where there is one, and from front to back where the file was cut."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Container, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, Final

from actors.bag.contents import BagError, BagMessage, BagTopic
from actors.bag.mcap_stream import MAGIC
from actors.bag.metadata import BagFile, BagMetadata

if TYPE_CHECKING:
    from mcap.records import Channel, ChunkIndex, Schema
    from mcap.summary import Summary

    from actors.bag.newest import Newest

__all__ = ["McapReading", "Salvage"]

RECORD: Final = struct.Struct("<BQ")
"""The head of a record: opcode and length."""

CHUNK_OPCODE: Final = 0x06
DATA_END_OPCODE: Final = 0x0F


@dataclass
class Salvage:
    """What was met while a file was read from front to back."""

    messages: int = 0
    damaged: int = 0
    """The chunks and records that could not be read."""

    lost_bytes: int = 0
    """The bytes at the end of the file that are no whole record."""

    complete: bool = False
    """Whether the end of the data was reached."""

    topics: dict[int, BagTopic] = field(default_factory=dict[int, BagTopic])
    counts: dict[BagTopic, int] = field(default_factory=dict[BagTopic, int])
    start_ns: int = 0
    end_ns: int = 0


class McapReading:
    """One MCAP file. It is opened anew for each pass over its messages.

    Invariant: `summary` is None for a file without an index, which is then read from front to back.
    """

    def __init__(self, path: Path) -> None:
        from mcap.exceptions import McapError
        from mcap.reader import SeekingReader

        self.path = path
        self.summary: Summary | None = None
        try:
            stream = path.open("rb")
        except OSError as error:
            raise BagError(f"{path}: {error.strerror}") from error
        with stream:
            begin = stream.read(len(MAGIC))
            if begin != MAGIC:
                raise BagError(f"{path} is no MCAP file: it begins with {begin!r}")
            stream.seek(0)
            try:
                summary = SeekingReader(stream).get_summary()
            except (McapError, OSError, struct.error, ValueError):
                return  # it was cut
        if summary is not None and summary.statistics is not None:
            self.summary = summary

    @property
    def cut(self) -> bool:
        """Whether the file has no index."""
        return self.summary is None

    def metadata(self) -> BagMetadata:
        """What the file says of itself; a file without an index is read for it."""
        summary = self.summary
        if summary is None:
            salvage = Salvage()
            for _ in self.salvage(salvage):
                pass
            topics = {topic: salvage.counts.get(topic, 0) for topic in salvage.topics.values()}
            return self._metadata(topics, salvage.start_ns, salvage.end_ns)
        counted = summary.statistics
        assert counted is not None
        topics = dict[BagTopic, int]()
        for number, channel in summary.channels.items():
            topic = _topic(channel, summary.schemas.get(channel.schema_id))
            topics[topic] = topics.get(topic, 0) + counted.channel_message_counts.get(number, 0)
        return self._metadata(topics, counted.message_start_time, counted.message_end_time)

    def _metadata(self, topics: dict[BagTopic, int], start_ns: int, end_ns: int) -> BagMetadata:
        file = BagFile(self.path.name, start_ns, end_ns - start_ns, sum(topics.values()))
        return BagMetadata(topics=topics, files=(file,), ros_distro="")

    def messages(self, start_ns: int, topics: Container[str] | None) -> Iterator[BagMessage]:
        """The messages received from `start_ns` on, in order of receipt, of these topics or all."""
        if self.summary is None:
            found = self.salvage(Salvage())
            chosen = (one for one in found if one.received_ns >= start_ns)
            yield from sorted(
                (one for one in chosen if topics is None or one.topic.name in topics), key=lambda one: one.received_ns
            )
            return
        from mcap.reader import SeekingReader

        known: dict[int, BagTopic] = {}
        with self.path.open("rb") as stream:
            reader: Any = SeekingReader(stream)
            for schema, channel, message in reader.iter_messages(starting_at=start_ns):
                topic = known.get(channel.id)
                if topic is None:
                    topic = known[channel.id] = _topic(channel, schema)
                if topics is None or topic.name in topics:
                    yield BagMessage(topic, message.data, message.log_time, message.publish_time)

    def before(self, end_ns: int, newest: Newest, file: int) -> None:
        """Add the messages received before `end_ns` that may be the newest of their topics. With an index, only their chunks are read."""
        summary = self.summary
        if summary is None or not summary.chunk_indexes:
            for number, message in enumerate(self.messages(0, newest.counts)):
                if message.received_ns < end_ns:
                    newest.add(message, (file, 0, number))
            return
        with self.path.open("rb") as stream:
            for chunk in sorted(summary.chunk_indexes, key=lambda one: one.message_end_time, reverse=True):
                last_ns = min(chunk.message_end_time, end_ns)
                within = {summary.channels[number].topic for number in chunk.message_index_offsets} or newest.counts
                if chunk.message_start_time >= end_ns or not any(newest.wants(topic, last_ns) for topic in within):
                    continue
                for number, message in enumerate(_chunk(stream, chunk, summary)):
                    if message.received_ns < end_ns:
                        newest.add(message, (file, chunk.chunk_start_offset, number))

    def salvage(self, found: Salvage) -> Iterator[BagMessage]:
        """Every message that can be read, in the order of the file; `found` tells afterwards what could not."""
        schemas: dict[int, Schema] = {}
        for record in self._records(found):
            kind = type(record).__name__
            if kind == "Schema":
                schemas[record.id] = record
            elif kind == "Channel":
                found.topics[record.id] = _topic(record, schemas.get(record.schema_id))
            else:
                topic = found.topics.get(record.channel_id)
                if topic is None:  # its chunk is damaged
                    found.damaged += 1
                    continue
                time = record.log_time
                found.start_ns = min(found.start_ns, time) if found.messages else time
                found.end_ns = max(found.end_ns, time)
                found.messages += 1
                found.counts[topic] = found.counts.get(topic, 0) + 1
                yield BagMessage(topic, record.data, time, record.publish_time)

    def _records(self, found: Salvage) -> Iterator[Any]:
        """The schemas, channels and messages of the file, and nothing else, up to its last whole record."""
        size = self.path.stat().st_size
        with self.path.open("rb") as stream:
            stream.seek(len(MAGIC))
            while True:
                at = stream.tell()
                head = stream.read(RECORD.size)
                opcode, length = RECORD.unpack(head) if len(head) == RECORD.size else (0, size)
                if opcode == DATA_END_OPCODE:
                    found.complete = True
                    return
                if at + RECORD.size + length > size:
                    found.lost_bytes = size - at
                    return
                yield from _inside(opcode, stream.read(length), found)


def _inside(opcode: int, data: bytes, found: Salvage) -> Iterator[Any]:
    """The record, or those of the chunk that it is. What cannot be read is counted."""
    from io import BytesIO

    from mcap.data_stream import ReadDataStream
    from mcap.records import Channel, Chunk, Message, Schema
    from mcap.stream_reader import breakup_chunk

    stream = ReadDataStream(BytesIO(data))
    try:
        if opcode == CHUNK_OPCODE:
            yield from breakup_chunk(Chunk.read(stream), validate_crc=True)
        elif opcode == 0x03:
            yield Schema.read(stream)
        elif opcode == 0x04:
            yield Channel.read(stream)
        elif opcode == 0x05:
            yield Message.read(stream, len(data))
    except (Exception, zlib.error):  # a damaged chunk makes its decompressor raise whatever it has
        found.damaged += 1


def _chunk(stream: BinaryIO, index: ChunkIndex, summary: Summary) -> Iterator[BagMessage]:
    """The messages of a chunk, in the order of the file."""
    from mcap.data_stream import ReadDataStream
    from mcap.records import Chunk, Message
    from mcap.stream_reader import breakup_chunk

    topics = {
        number: _topic(summary.channels[number], summary.schemas.get(summary.channels[number].schema_id))
        for number in summary.channels
    }
    stream.seek(index.chunk_start_offset + RECORD.size)
    for record in breakup_chunk(Chunk.read(ReadDataStream(stream))):
        if isinstance(record, Message):
            yield BagMessage(topics[record.channel_id], record.data, record.log_time, record.publish_time)


def _topic(channel: Channel, schema: Schema | None) -> BagTopic:
    return BagTopic(
        channel.topic,
        "" if schema is None else schema.name,
        "" if schema is None else schema.data.decode("utf-8", "replace"),
        channel.metadata.get("offered_qos_profiles", ""),
        channel.metadata.get("topic_type_hash", ""),
        "ros2msg" if schema is None else schema.encoding,
        channel.message_encoding,
    )
