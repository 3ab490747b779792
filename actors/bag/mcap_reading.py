"""Reading MCAP files: by their index as far as there is one, and otherwise from front to back."""

from __future__ import annotations

import struct
import zlib
from bisect import bisect_left
from collections import Counter
from collections.abc import Callable, Container, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import zip_longest
from pathlib import Path
from typing import BinaryIO, Final, NamedTuple

from actors.bag import mcap_records as record
from actors.bag.contents import BagError, BagMessage, BagTopic, Newest, received
from actors.bag.foreign import named
from actors.bag.mcap_records import Damaged
from actors.bag.mcap_stream import MAGIC
from actors.bag.metadata import BagFile, BagMetadata

FOOTER: Final = struct.Struct("<BQQQI")
"""The last record: opcode, length, where the summary and its offsets begin, checksum of the summary."""

ENDINGS: Final = {record.DATA_END: 4, record.FOOTER: FOOTER.size - record.HEAD.size}
"""The lengths of the records at the end of the data and of the file."""

RUN_BYTES: Final = 1024 * 1024
"""How much of what is outside of chunks is read at once."""


class _Lacking(Damaged):
    """The index at the end of a file is whole, and does not tell all that is needed."""


class Part(NamedTuple):
    """A chunk of a file, or some records outside of chunks: where it begins and ends, and the receive times of its messages."""

    start: int
    end: int
    first_ns: int
    last_ns: int
    channels: frozenset[int] | None = None
    """Those in it; None if the file does not tell."""

    damage: str = ""
    """Why it cannot be read, if that is seen from outside."""


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


@dataclass
class _Contents:
    """What a file holds. Invariant: `parts` are in the order of the file, and hold all of its messages."""

    schemas: dict[int, record.SchemaRecord] = field(default_factory=dict[int, record.SchemaRecord])
    channels: dict[int, record.ChannelRecord] = field(default_factory=dict[int, record.ChannelRecord])
    counts: Counter[int] = field(default_factory=Counter[int])
    parts: list[Part] = field(default_factory=list[Part])
    start_ns: int = 0
    end_ns: int = 0
    chunks: int = 0
    statistics: record.Statistics | None = None
    complete: bool = True
    lost_bytes: int = 0
    told: dict[str, str] = field(default_factory=dict[str, str])
    """What rosbag2 has noted in the file."""


class McapReading:
    """One MCAP file. It is opened anew for each pass over its messages.

    The index at its end may lack anything: what it does not tell is found in the file itself. What a checksum of the file covers is checked.
    """

    def __init__(self, path: Path, shown: Path | None = None) -> None:
        self.path = path
        self._shown = shown or path
        """What the file is called in errors."""
        try:
            with path.open("rb") as stream:
                begin = stream.read(len(MAGIC))
                if begin != MAGIC:
                    raise BagError(named(self._shown) or f"{self._shown} is no MCAP file: it begins with {begin!r}")
                self._size = path.stat().st_size
                self._statistics: record.Statistics | None = None
                stream.seek(-len(MAGIC), 2)
                self._closed = stream.read() == MAGIC
                try:
                    self._contents = self._indexed(stream)
                except Damaged as why:
                    self._contents = self._scanned(stream, "" if isinstance(why, _Lacking) else str(why))
        except OSError as error:
            raise BagError(f"{self._shown}: {error.strerror}") from error
        contents = self._contents
        self._topics = {
            number: _topic(each, contents.schemas.get(each.schema_id)) for number, each in contents.channels.items()
        }

    @property
    def cut(self) -> bool:
        """Whether the file was not closed."""
        return not (self._contents.complete and self._closed)

    @property
    def told(self) -> dict[str, str]:
        """What rosbag2 has noted in the file, such as its metadata as YAML."""
        return self._contents.told

    def complete(self, completed: Callable[[BagTopic], BagTopic]) -> None:
        """Let topics be called from now on as others know them better."""
        self._topics = {number: completed(topic) for number, topic in self._topics.items()}

    def metadata(self) -> BagMetadata:
        """What the file holds."""
        contents, topics = self._contents, dict[BagTopic, int]()
        for number, topic in self._topics.items():
            topics[topic] = topics.get(topic, 0) + contents.counts[number]
        file = BagFile(self.path.name, contents.start_ns, contents.end_ns - contents.start_ns, sum(topics.values()))
        return BagMetadata(topics=topics, files=(file,), ros_distro="")

    def messages(self, start_ns: int, topics: Container[str] | None) -> Iterator[BagMessage]:
        """The messages received from `start_ns` on, in order of receipt, of these topics or all. Raises `BagError` for what is damaged."""
        wanted = self._wanted(topics)
        parts = [part for part in self._contents.parts if part.damage or part.last_ns >= start_ns]
        parts.sort(key=lambda part: part.first_ns)
        waiting: list[BagMessage] = []
        with self.path.open("rb") as stream:
            for part, following in zip_longest(parts, parts[1:]):
                waiting += [one for one in self._strictly(stream, part, wanted) if one.received_ns >= start_ns]
                waiting.sort(key=received)
                # What is damaged comes after all that was received until then.
                until = None if following is None else following.first_ns + bool(following.damage)
                ready = len(waiting) if until is None else bisect_left(waiting, until, key=received)
                yield from waiting[:ready]
                del waiting[:ready]

    def before(self, end_ns: int, newest: Newest, file: int) -> None:
        """Add the messages received before `end_ns` that may be the newest of their topics. Only the parts that may hold them are read."""
        wanted = self._wanted(newest.counts)
        with self.path.open("rb") as stream:
            for part in sorted(self._contents.parts, key=lambda part: part.last_ns, reverse=True):
                last_ns = min(part.last_ns, end_ns)
                within = newest.counts if part.channels is None else {self._topics[one].name for one in part.channels}
                if part.first_ns >= end_ns or not any(newest.wants(topic, last_ns) for topic in within):
                    continue
                for number, message in enumerate(self._strictly(stream, part, wanted)):
                    if message.received_ns < end_ns:
                        newest.add(message, (file, part.start, number))

    def salvage(self, found: Salvage) -> Iterator[BagMessage]:
        """Every message that can be read, in the order of the file; `found` tells afterwards what could not."""
        contents = self._contents
        found.complete, found.lost_bytes = contents.complete, contents.lost_bytes
        with self.path.open("rb") as stream:
            for part in contents.parts:
                lost: list[str] = []
                try:
                    messages = self._read(stream, part, self._topics, lost)
                except Damaged:
                    found.damaged += 1
                    continue
                found.damaged += len(lost)
                found.messages += len(messages)
                yield from messages

    # -- messages -----------------------------------------------------------------------------------------------------------

    def _wanted(self, topics: Container[str] | None) -> dict[int, BagTopic | None]:
        """The topics by their channels, None for those that are not asked for."""
        return {
            number: topic if topics is None or topic.name in topics else None for number, topic in self._topics.items()
        }

    def _strictly(self, stream: BinaryIO, part: Part, wanted: dict[int, BagTopic | None]) -> list[BagMessage]:
        try:
            return self._read(stream, part, wanted, None)
        except Damaged as error:
            raise BagError(
                f"{self._shown} is damaged at byte {part.start}: {error}; `bag recover {self._shown} -o NEW` writes what can be read"
            ) from None

    def _read(
        self,
        stream: BinaryIO,
        part: Part,
        wanted: dict[int, BagTopic | None] | dict[int, BagTopic],
        lost: list[str] | None,
    ) -> list[BagMessage]:
        """The messages of a part, in the order of the file. Raises `Damaged`; with `lost`, single messages are left out and noted there."""
        if part.damage:
            raise Damaged(part.damage)
        stream.seek(part.start)
        data = stream.read(part.end - part.start)
        if len(data) != part.end - part.start:
            raise Damaged("the file has become shorter")
        if data[0] == record.CHUNK:
            _, begin, end = next(record.records(data))
            data = record.unpacked(data[begin:end])
        messages: list[BagMessage] = []
        try:
            for opcode, begin, end in record.records(data):
                if opcode == record.MESSAGE:
                    self._message(data, begin, end, wanted, messages, lost)
        except Damaged as error:
            if lost is None:
                raise
            lost.append(str(error))
        return messages

    def _message(
        self,
        data: bytes,
        begin: int,
        end: int,
        wanted: dict[int, BagTopic | None] | dict[int, BagTopic],
        messages: list[BagMessage],
        lost: list[str] | None,
    ) -> None:
        # Runs for every message of a file.
        fixed = record.MESSAGE_HEAD.size
        if end - begin < fixed:
            raise Damaged("a message ends too early")
        number, _, received_ns, published_ns = record.MESSAGE_HEAD.unpack_from(data, begin)
        topic = wanted.get(number, MISSING)
        if isinstance(topic, _Missing):
            why = f"the channel {number} of a message is not described"
            if lost is None:
                raise Damaged(why)
            lost.append(why)
        elif topic is not None:
            messages.append(BagMessage(topic, data[begin + fixed : end], received_ns, published_ns))

    # -- what the file holds ------------------------------------------------------------------------------------------------

    def _scanned(self, stream: BinaryIO, damage: str) -> _Contents:
        """What the file holds, read from front to back; `damage` is that of its index.

        Where that is damaged, a record of another kind may have been a chunk: all is known to be there only by the statistics.
        """
        contents = _Contents(complete=False, statistics=self._statistics)
        self._walk(stream, contents, len(MAGIC), self._size, opened=True)
        if contents.statistics is not None:
            _compare(contents, self._size, contents.statistics)
        elif damage and self._closed:
            why = f"{damage}, and no statistics tell whether messages are missing"
            contents.parts.append(Part(self._size, self._size, contents.end_ns, contents.end_ns, damage=why))
        return contents

    def _indexed(self, stream: BinaryIO) -> _Contents:
        """What the file holds by its summary, and by the heads of the records that are in no chunk. Raises `Damaged` if that is not enough."""
        end = self._size - len(MAGIC) - FOOTER.size
        stream.seek(max(0, end))
        tail = stream.read()
        if end < len(MAGIC) or not tail.endswith(MAGIC):
            raise _Lacking("the end is missing")
        opcode, _, start, _, crc = FOOTER.unpack_from(tail)
        if opcode == record.FOOTER and not start:
            raise _Lacking("there is no summary")
        if opcode != record.FOOTER or not len(MAGIC) <= start <= end:
            raise Damaged("the summary is not where its file says")
        stream.seek(start)
        summary = stream.read(end - start)
        if crc and zlib.crc32(tail[: FOOTER.size - 4], zlib.crc32(summary)) != crc:
            raise Damaged("the checksum of the summary does not agree with it")
        contents = _Contents()
        chunks: list[record.ChunkIndex] = []
        told: record.Statistics | None = None
        for opcode, begin, ended in record.records(summary):
            if opcode == record.STATISTICS:
                told = record.statistics(summary[begin:ended])
            elif opcode == record.CHUNK_INDEX:
                chunks.append(record.chunk_index(summary[begin:ended]))
            else:
                _note(contents, opcode, summary[begin:ended])
        self._statistics = told
        if told is None or sum(told.counts.values()) != told.message_count or len(chunks) > told.chunk_count:
            raise _Lacking("there are no statistics")
        self._between(stream, contents, chunks, start)
        known = contents.channels
        if len(known) < told.channel_count or not all(number in known for number in told.counts):
            raise _Lacking("there are channels that the summary does not describe")
        if any(each.schema_id and each.schema_id not in contents.schemas for each in known.values()):
            raise _Lacking("there are schemas that the summary does not describe")
        if not told.chunk_count or contents.chunks < told.chunk_count:
            _compare(contents, start, told)
        contents.counts = Counter(told.counts)
        contents.start_ns, contents.end_ns = told.start_ns, told.end_ns
        return contents

    def _between(self, stream: BinaryIO, contents: _Contents, chunks: list[record.ChunkIndex], end: int) -> None:
        """Note the chunks of an index, and what is between them."""
        at = len(MAGIC)
        for chunk in sorted(chunks, key=lambda one: one.offset):
            if chunk.offset < at or chunk.offset + chunk.length > end:
                raise Damaged("a chunk is not where the summary says")
            self._walk(stream, contents, at, chunk.offset, opened=False)
            at = chunk.offset + chunk.length
            stream.seek(chunk.offset)
            head = record.HEAD.unpack(stream.read(record.HEAD.size))
            damage = "" if head == (record.CHUNK, chunk.length - record.HEAD.size) else "no chunk begins here"
            channels = chunk.channels if chunk.channels and chunk.channels <= contents.channels.keys() else None
            contents.parts.append(Part(chunk.offset, at, chunk.start_ns, chunk.end_ns, channels, damage))
            contents.chunks += 1
        self._walk(stream, contents, at, end, opened=False)

    def _walk(self, stream: BinaryIO, contents: _Contents, at: int, end: int, *, opened: bool) -> None:
        """Note the records from `at` until `end`; what is in chunks only if they are to be `opened`."""
        run = _Run(contents)
        while at + record.HEAD.size <= end:
            stream.seek(at)
            opcode, length = record.HEAD.unpack(stream.read(record.HEAD.size))
            following = at + record.HEAD.size + length
            if following > end or opcode == 0:
                break
            try:
                if opcode in (record.DATA_END, record.FOOTER):
                    if length != ENDINGS[opcode]:
                        raise Damaged("a record of the end has a wrong length")
                    contents.complete = True
                elif opcode == record.CHUNK:
                    run.close()
                    contents.chunks += 1
                    contents.parts.append(self._chunk(stream, contents, at, following, opened=opened))
                elif opcode == record.MESSAGE:
                    run.add(at, following, stream.read(record.MESSAGE_HEAD.size))
                elif opcode in (record.SCHEMA, record.CHANNEL, record.METADATA):
                    _note(contents, opcode, stream.read(length))
                elif opcode == record.STATISTICS and contents.statistics is None:
                    contents.statistics = record.statistics(stream.read(length))
            except Damaged as error:
                run.close()
                contents.parts.append(Part(at, following, contents.end_ns, contents.end_ns, damage=str(error)))
            at = following
        run.close()
        if at < end and not (opened and contents.complete):
            contents.lost_bytes = end - at
            if not opened or self._closed:  # it was closed, so a record has a wrong length
                why = "no record begins here that fits into what is left"
                contents.parts.append(Part(at, end, contents.end_ns, contents.end_ns, damage=why))

    def _chunk(self, stream: BinaryIO, contents: _Contents, at: int, end: int, *, opened: bool) -> Part:
        """A chunk that no index tells of."""
        stream.seek(at + record.HEAD.size)
        if not opened:
            return Part(at, end, *record.chunk_times(stream.read(16)))
        data = record.unpacked(stream.read(end - at - record.HEAD.size))
        times: list[int] = []
        channels = Counter[int]()
        for opcode, begin, ended in record.records(data):
            if opcode == record.MESSAGE and ended - begin >= record.MESSAGE_HEAD.size:
                number, _, received_ns, _ = record.MESSAGE_HEAD.unpack_from(data, begin)
                channels[number] += 1
                times.append(received_ns)
            else:
                _note(contents, opcode, data[begin:ended])
        if times:
            _count(contents, channels, min(times), max(times))
        return Part(at, end, min(times, default=contents.end_ns), max(times, default=contents.end_ns))


class _Run:
    """Messages outside of chunks that follow each other. They become parts of the contents, none of them much larger than `RUN_BYTES`."""

    def __init__(self, contents: _Contents) -> None:
        self._contents = contents
        self._start = self._end = 0
        self._times: list[int] = []
        self._channels = Counter[int]()

    def add(self, at: int, end: int, head: bytes) -> None:
        if len(head) < record.MESSAGE_HEAD.size or end - at < record.HEAD.size + record.MESSAGE_HEAD.size:
            raise Damaged("a message ends too early")
        if self._times and (at != self._end or end - self._start > RUN_BYTES):
            self.close()
        if not self._times:
            self._start = at
        number, _, received_ns, _ = record.MESSAGE_HEAD.unpack(head)
        self._end = end
        self._times.append(received_ns)
        self._channels[number] += 1

    def close(self) -> None:
        if not self._times:
            return
        first, last = min(self._times), max(self._times)
        _count(self._contents, self._channels, first, last)
        self._contents.parts.append(Part(self._start, self._end, first, last))
        self._times, self._channels = [], Counter[int]()


class _Missing:
    """No topic, not even one that is not asked for."""


MISSING: Final = _Missing()


def _compare(contents: _Contents, at: int, told: record.Statistics) -> None:
    """Note it if there are not as many messages as the statistics tell."""
    found = contents.counts.total()
    if found != told.message_count:
        why = f"it holds {found} messages, and its statistics tell of {told.message_count}"
        contents.parts.append(Part(at, at, contents.end_ns, contents.end_ns, damage=why))


def _count(contents: _Contents, channels: Counter[int], first_ns: int, last_ns: int) -> None:
    contents.start_ns = min(contents.start_ns, first_ns) if contents.counts else first_ns
    contents.end_ns = max(contents.end_ns, last_ns)
    contents.counts += channels


def _note(contents: _Contents, opcode: int, data: bytes) -> None:
    """Note what a record tells of the messages. The first one of a number counts."""
    if opcode == record.SCHEMA:
        schema = record.schema(data)
        contents.schemas.setdefault(schema.id, schema)
    elif opcode == record.CHANNEL:
        channel = record.channel(data)
        contents.channels.setdefault(channel.id, channel)
    elif opcode == record.METADATA:
        with suppress(Damaged):  # no message depends on it
            name, values = record.mapping(data)
            if name == "rosbag2":
                contents.told |= values


def _topic(channel: record.ChannelRecord, schema: record.SchemaRecord | None) -> BagTopic:
    return BagTopic(
        channel.topic,
        "" if schema is None else schema.name,
        "" if schema is None else schema.text,
        channel.metadata.get("offered_qos_profiles", ""),
        channel.metadata.get("topic_type_hash", ""),
        "" if schema is None else schema.encoding,
        channel.message_encoding,
    )
