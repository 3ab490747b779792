"""The records of an MCAP file, as https://mcap.dev/spec describes them: read from bytes that may be damaged or hostile."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

HEAD: Final = struct.Struct("<BQ")
"""The head of a record: opcode and length."""

MESSAGE_HEAD: Final = struct.Struct("<HIQQ")
"""The head of a message: channel, sequence, receive time, publish time."""

FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, CHUNK_INDEX, STATISTICS, METADATA, DATA_END = 2, 3, 4, 5, 6, 8, 11, 12, 15
"""The opcodes of the records that are read; all others are passed over."""

LARGEST: Final = 1 << 30
"""How many bytes a chunk may hold."""


class Damaged(Exception):
    """Bytes that are not what they should be; the text says why."""


@dataclass(frozen=True, slots=True)
class SchemaRecord:
    id: int
    name: str
    encoding: str
    text: str


@dataclass(frozen=True, slots=True)
class ChannelRecord:
    id: int
    schema_id: int
    topic: str
    message_encoding: str
    metadata: dict[str, str]


@dataclass(frozen=True, slots=True)
class Statistics:
    message_count: int
    channel_count: int
    chunk_count: int
    start_ns: int
    end_ns: int
    counts: dict[int, int]


@dataclass(frozen=True, slots=True)
class ChunkIndex:
    start_ns: int
    end_ns: int
    offset: int
    length: int
    channels: frozenset[int]
    """Empty if the file does not tell which channels are in the chunk."""


def records(data: bytes) -> Iterator[tuple[int, int, int]]:
    """The opcode, the begin and the end of each record within `data`. Raises `Damaged` where there is none."""
    at, size = 0, len(data)
    while at < size:
        if at + HEAD.size > size:
            raise Damaged("a record ends too early")
        opcode, length = HEAD.unpack_from(data, at)
        begin = at + HEAD.size
        at = begin + length
        if at > size:
            raise Damaged(f"a record of {length} bytes does not fit into what is left")
        yield opcode, begin, at


class _Fields:
    """The fields of a record, in order."""

    def __init__(self, data: bytes) -> None:
        self._data = data
        self._at = 0

    def numbers(self, layout: str) -> tuple[int, ...]:
        size = struct.calcsize(layout)
        if self._at + size > len(self._data):
            raise Damaged("a record ends too early")
        values = struct.unpack_from(layout, self._data, self._at)
        self._at += size
        return values

    def octets(self, layout: str = "<I") -> bytes:
        (size,) = self.numbers(layout)
        if self._at + size > len(self._data):
            raise Damaged("a record ends too early")
        self._at += size
        return self._data[self._at - size : self._at]

    def text(self, errors: str = "strict") -> str:
        try:
            return self.octets().decode("utf-8", errors)
        except UnicodeDecodeError:
            raise Damaged("a text is not in UTF-8") from None

    def texts(self) -> dict[str, str]:
        inner = _Fields(self.octets())
        found: dict[str, str] = {}
        while inner._at < len(inner._data):
            key = inner.text("replace")
            found[key] = inner.text("replace")
        return found

    def pairs(self, layout: str) -> dict[int, int]:
        data = self.octets()
        if len(data) % struct.calcsize(layout):
            raise Damaged("a record ends too early")
        return dict(struct.iter_unpack(layout, data))


def schema(data: bytes) -> SchemaRecord:
    fields = _Fields(data)
    (number,) = fields.numbers("<H")
    return SchemaRecord(number, fields.text(), fields.text(), fields.text("replace"))


def channel(data: bytes) -> ChannelRecord:
    fields = _Fields(data)
    number, schema_id = fields.numbers("<HH")
    return ChannelRecord(number, schema_id, fields.text(), fields.text(), fields.texts())


def statistics(data: bytes) -> Statistics:
    fields = _Fields(data)
    messages, _, channels, _, _, chunks, start, end = fields.numbers("<QHIIIIQQ")
    return Statistics(messages, channels, chunks, start, end, fields.pairs("<HQ"))


def chunk_index(data: bytes) -> ChunkIndex:
    fields = _Fields(data)
    start, end, offset, length = fields.numbers("<QQQQ")
    return ChunkIndex(start, end, offset, length, frozenset(fields.pairs("<HQ")))


def mapping(data: bytes) -> tuple[str, dict[str, str]]:
    """A metadata record: its name and its texts."""
    fields = _Fields(data)
    return fields.text("replace"), fields.texts()


def chunk_times(data: bytes) -> tuple[int, int]:
    """The receive times of the first and the last message of a chunk, as its head tells them."""
    start, end = _Fields(data).numbers("<QQ")
    return start, end


def unpacked(data: bytes) -> bytes:
    """The records of a chunk, unpacked and checked."""
    fields = _Fields(data)
    _, _, size, crc = fields.numbers("<QQQI")
    compression, packed = fields.text(), fields.octets("<Q")
    if size > LARGEST:
        raise Damaged(f"a chunk says that it holds {size} bytes")
    plain = _plain(compression, packed, size)
    if len(plain) != size:
        raise Damaged(f"a chunk holds {len(plain)} bytes, not {size}")
    if crc and zlib.crc32(plain) != crc:
        raise Damaged("the checksum of a chunk does not agree with its data")
    return plain


def _plain(compression: str, packed: bytes, size: int) -> bytes:
    if compression == "" or not packed:
        return packed
    if compression == "zstd":
        import zstandard

        try:
            if zstandard.frame_content_size(packed) not in (-1, size):
                raise Damaged("the compressed data do not have the size that their chunk tells")
            return zstandard.ZstdDecompressor().decompress(packed, max_output_size=size)
        except zstandard.ZstdError as error:
            raise Damaged(str(error)) from None
    if compression == "lz4":
        import lz4.frame

        frames: Any = lz4.frame  # it has no types
        try:
            plain: bytes = frames.LZ4FrameDecompressor().decompress(packed, max_length=size + 1)
        except (RuntimeError, EOFError) as error:
            raise Damaged(str(error)) from None
        return plain
    raise Damaged(f"a chunk is compressed by {compression!r}, which is neither zstd nor lz4")
