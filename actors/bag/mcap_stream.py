"""An MCAP file as it grows: messages are collected into chunks, and each chunk is written as a whole or not at all.

The format is described at https://mcap.dev/spec. A file that was not closed lacks only its index: what has been written can be read, up to
the last whole chunk.
"""

from __future__ import annotations

import os
import struct
import zlib
from collections.abc import Callable, Iterable, Mapping
from itertools import chain
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Final

from actors.bag.contents import BagError, BagTopic, topic_of

if TYPE_CHECKING:
    from mcap.records import Channel, ChunkIndex, McapRecord, MetadataIndex, Schema

    from actors.interfaces.message import Message
    from actors.qos.policies import QoS

MAGIC: Final = b"\x89MCAP0\r\n"
CHUNK_BYTES: Final = 1024 * 1024
"""A chunk is written when it is this large, before compression."""

COMPRESSIONS: Final = ("none", "lz4", "zstd")
ZSTD_LEVEL: Final = 1
"""Fast: about a tenth larger than the default, for a third of its time."""

MESSAGE: Final = struct.Struct("<BQHIQQ").pack
"""The head of a message: opcode, length, channel, sequence, receive time, publish time."""

MESSAGE_OPCODE: Final = 0x05
MESSAGE_FIXED: Final = 22
"""The bytes of a message record without its data."""

INDEX_HEAD: Final = struct.Struct("<BQHI").pack
"""The head of a message index: opcode, length, channel, length of the entries."""

INDEX_OPCODE: Final = 0x07


class McapStream:
    """An MCAP file that is open for writing. It may be used by one thread at a time.

    Invariants:

    * The file ends at `_end`, with a whole record. When a write fails, the file is cut there, and stays readable.
    * `written` is the number of messages in the file, and `waiting` that of messages in the chunk that has not been written.
    * A schema or channel is in a chunk of the file, in the chunk that waits, or in `_new`.
    """

    def __init__(self, path: str | os.PathLike[str], *, compression: str = "zstd") -> None:
        from mcap.records import Header

        self._compress = _compressor(compression)
        self._compression = "" if compression == "none" else compression
        self.path = Path(path)
        self._schemas: dict[tuple[str, str, str], Schema] = {}
        self._channels: list[Channel] = []
        self._chunks: list[ChunkIndex] = []
        self._metadata: list[MetadataIndex] = []
        self._counts: dict[int, int] = {}
        self._chunk_counts: dict[int, int] = {}
        self._new: list[McapRecord] = []
        """Schemas and channels that are in no chunk yet."""
        self._parts: list[bytes] = []
        self._pending = 0
        """The bytes in `_parts`."""
        self._index: dict[int, list[tuple[int, int]]] = {}
        self._first_ns = 0
        self.start_ns = 0
        self.end_ns = 0
        self.written = 0
        self.waiting = 0
        self._end = 0
        self._file = open(self.path, "xb", buffering=0)  # noqa: SIM115  # until `close`
        try:
            self._put(MAGIC + _bytes([Header("ros2", "robactor")]))
        except OSError:
            self._file.close()
            raise

    @property
    def size(self) -> int:
        """The size of the file with what waits, before its compression."""
        return self._end + self._pending

    @property
    def first_waiting_ns(self) -> int | None:
        """The receive time of the first message in the chunk that waits; None if none waits."""
        return self._first_ns if self.waiting else None

    @property
    def first_ns(self) -> int:
        """The receive time of the first message of the file; 0 if there is none."""
        return self.start_ns if self.written else self.first_waiting_ns or 0

    @property
    def counts(self) -> Mapping[int, int]:
        """The number of messages in the file by channel."""
        return self._counts

    def channel(self, topic: BagTopic) -> int:
        """Add a channel and return its number."""
        from mcap.records import Channel, Schema

        key = topic.type, topic.schema_encoding, topic.schema
        schema = self._schemas.get(key)
        if schema is None and any(key):
            number = len(self._schemas) + 1
            schema = Schema(number, topic.schema.encode(), topic.schema_encoding, topic.type)
            self._schemas[key] = schema
            self._new.append(schema)
        facts = {"offered_qos_profiles": topic.offered_qos_profiles, "topic_type_hash": topic.type_hash}
        channel = Channel(
            len(self._channels) + 1, topic.name, topic.serialization_format, facts, schema.id if schema else 0
        )
        self._channels.append(channel)
        self._new.append(channel)
        return channel.id

    def write(self, channel: int, data: bytes, *, received_ns: int, published_ns: int) -> None:
        """Add one message, encoded in CDR, and write the chunk if it is large enough. Raises `OSError`, as `flush` does."""
        if self._new:
            for record in self._new:
                self._add(_bytes([record]))
            self._new.clear()
        # Runs for every message of a recording.
        if not self.waiting:
            self._first_ns = received_ns
        chunk_counts = self._chunk_counts
        sequence = self._counts.get(channel, 0) + chunk_counts.get(channel, 0) + 1
        chunk_counts[channel] = chunk_counts.get(channel, 0) + 1
        index = self._index.get(channel)
        if index is None:
            index = self._index[channel] = []
        index.append((received_ns, self._pending))
        head = MESSAGE(MESSAGE_OPCODE, MESSAGE_FIXED + len(data), channel, sequence, received_ns, published_ns)
        self._parts.append(head)
        self._parts.append(data)
        self._pending += len(head) + len(data)
        self.waiting += 1
        if self._pending >= CHUNK_BYTES:
            self.flush()

    def flush(self) -> None:
        """Write what waits as a chunk. Raises `OSError`: then the messages of the chunk are lost, and the file is as before."""
        if not self.waiting:
            return
        from mcap.records import Chunk, ChunkIndex

        plain = b"".join(self._parts)
        data = self._compress(plain)
        times = [time for index in self._index.values() for time, _ in index]
        start, end = min(times), max(times)
        chunk = _bytes([Chunk(self._compression, data, end, start, zlib.crc32(plain), len(plain))])
        offsets, indexes = dict[int, int](), b""
        for channel, index in self._index.items():
            offsets[channel] = self._end + len(chunk) + len(indexes)
            indexes += INDEX_HEAD(INDEX_OPCODE, 6 + 16 * len(index), channel, 16 * len(index))
            indexes += struct.pack(f"<{2 * len(index)}Q", *chain.from_iterable(index))
        entry = ChunkIndex(
            len(chunk), self._end, self._compression, len(data), end, len(indexes), offsets, start, len(plain)
        )
        counts, waiting = self._chunk_counts, self.waiting
        self._parts, self._pending, self._index, self._chunk_counts, self.waiting = [], 0, {}, {}, 0
        try:
            self._put(chunk + indexes)
        except OSError:
            self._new = [*self._schemas.values(), *self._channels]  # the lost chunk may have held some of them
            raise
        self._chunks.append(entry)
        for channel, count in counts.items():
            self._counts[channel] = self._counts.get(channel, 0) + count
        self.start_ns = min(self.start_ns, start) if self.written else start
        self.end_ns = max(self.end_ns, end)
        self.written += waiting

    def metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Add a record of text values about the file. Raises `OSError`."""
        from mcap.records import Metadata, MetadataIndex

        self.flush()
        record = _bytes([Metadata(name, dict(values))])
        index = MetadataIndex(self._end, len(record), name)
        self._put(record)
        self._metadata.append(index)

    def close(self) -> None:
        """Write what waits and the index, and close the file. Closing twice is harmless.

        Raises `OSError` if that is not possible: the file is closed, and what has been written before can be read.
        """
        if self._file.closed:
            return
        try:
            try:
                self.flush()
            finally:
                self._put(self._ending())
        finally:
            self._file.close()

    def _add(self, record: bytes) -> None:
        self._parts.append(record)
        self._pending += len(record)

    def _put(self, data: bytes) -> None:
        """Write all of `data`, or nothing."""
        left = memoryview(data)
        try:
            while left:
                left = left[self._file.write(left) :]
        except OSError:
            self._file.seek(self._end)
            self._file.truncate()
            raise
        self._end += len(data)

    def _ending(self) -> bytes:
        """The end of the data and the summary, from which readers find everything else."""
        from mcap.opcode import Opcode
        from mcap.records import DataEnd, Footer, Statistics, SummaryOffset

        end = _bytes([DataEnd(0)])
        start = self._end + len(end)
        statistics = Statistics(
            0,
            len(self._channels),
            dict(self._counts),
            len(self._chunks),
            self.written,
            self.end_ns,
            self.start_ns,
            len(self._metadata),
            len(self._schemas),
        )
        groups: list[tuple[int, Iterable[McapRecord]]] = [
            (Opcode.SCHEMA, self._schemas.values()),
            (Opcode.CHANNEL, self._channels),
            (Opcode.STATISTICS, [statistics]),
            (Opcode.CHUNK_INDEX, self._chunks),
            (Opcode.METADATA_INDEX, self._metadata),
        ]
        summary, offsets = b"", list[SummaryOffset]()
        for opcode, records in groups:
            data = _bytes(records)
            offsets.append(SummaryOffset(opcode, start + len(summary), len(data)))
            summary += data
        offset_start = start + len(summary)
        summary += _bytes(offsets)
        crc = zlib.crc32(summary + struct.pack("<BQQQ", Opcode.FOOTER, 8 + 8 + 4, start, offset_start))
        return end + summary + _bytes([Footer(start, offset_start, crc)]) + MAGIC


def _bytes(records: Iterable[McapRecord]) -> bytes:
    from mcap.data_stream import RecordBuilder

    builder = RecordBuilder()
    for record in records:
        record.write(builder)
    end: Callable[[], bytes] = builder.end  # pyright: ignore[reportUnknownVariableType]
    return end()


def _compressor(name: str) -> Callable[[bytes], bytes]:
    if name == "none":
        return bytes
    if name == "zstd":
        import zstandard

        return zstandard.ZstdCompressor(ZSTD_LEVEL).compress
    if name == "lz4":
        import lz4.frame

        frames: Any = lz4.frame  # it has no types
        lz4_compress: Callable[[bytes], bytes] = frames.compress
        return lz4_compress
    raise BagError(f"{name!r} is no compression of a bag: use one of {', '.join(COMPRESSIONS)}")


class McapFile:
    """An MCAP file, written as a context manager. The complete file appears at its path when the block ends without an error."""

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = Path(path)
        part = self.path.with_name(f"{self.path.name}.part")
        part.unlink(missing_ok=True)
        self._stream = McapStream(part)

    def channel(self, topic: str, type: type[Message], offered: Iterable[QoS]) -> int:
        """Add a channel for messages of this type and return its number."""
        return self._stream.channel(topic_of(topic, type, offered))

    def write(self, channel: int, data: bytes, *, received_ns: int, published_ns: int) -> None:
        """Add one message, encoded in CDR. Times are in nanoseconds."""
        self._stream.write(channel, data, received_ns=received_ns, published_ns=published_ns)

    def metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Add a record of text values about the file."""
        self._stream.metadata(name, values)

    def __enter__(self) -> McapFile:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            self._stream.close()
        except OSError:
            self._stream.path.unlink()
            if error is None:
                raise
            return
        if error is None:
            self._stream.path.replace(self.path)
        else:
            self._stream.path.unlink()
