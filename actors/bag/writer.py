"""Writing bags: a folder of rosbag2 with MCAP files and `metadata.yaml`."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Final

from actors.bag.contents import BagError, BagTopic
from actors.bag.mcap_stream import COMPRESSIONS, McapStream
from actors.bag.metadata import BagFile, BagMetadata, note_of, write_metadata

FLUSH_NS: Final = 1_000_000_000
"""A chunk is written when it spans this time, in nanoseconds, so that a killed recorder loses no more."""

RESERVE: Final = ".reserve"
RESERVE_BYTES: Final = 256 * 1024
"""What a file in the folder holds back until the disk is full: room for the index and `metadata.yaml`."""


@dataclass(frozen=True, kw_only=True, slots=True)
class WriterOptions:
    """How a bag is written."""

    compression: str = "zstd"
    """`none`, `lz4` or `zstd`, of each chunk of a file."""

    max_bytes: int = 0
    """Begin the next file when the present one is this large; 0: never."""

    max_seconds: float = 0.0
    """Begin the next file when the present one spans this time; 0: never."""

    custom_data: Mapping[str, str] = field(default_factory=dict[str, str])
    """Texts that are kept in `metadata.yaml`."""

    def __post_init__(self) -> None:
        if self.compression not in COMPRESSIONS:
            raise ValueError(f"{self.compression!r} is no compression of a bag: use one of {', '.join(COMPRESSIONS)}")
        if self.max_bytes < 0 or not self.max_seconds >= 0:
            raise ValueError(
                f"a bag cannot be split at {self.max_bytes} bytes and {self.max_seconds:g} s: use 0 or more"
            )


@dataclass(frozen=True, slots=True)
class Split:
    """One file was closed, and the next one opened. Both are full paths."""

    closed: str
    opened: str


class BagWriter:
    """A bag that is being written. It may be used by one thread at a time, and must be closed.

    Raises `BagError` if the folder exists already or cannot be made. When a file cannot be written further, `write` and the others raise
    `OSError` with its path: what has been written before stays readable, and only `close` is of use then.
    """

    # Invariants:
    # * `_stream` is the present file, and `_channels` its channels. `_files` describes the files that are closed.
    # * `given` is the number of messages passed to `write`; those that are not in a file after `close` are `lost`.

    def __init__(self, path: str | os.PathLike[str], options: WriterOptions | None = None) -> None:
        self.path = Path(path)
        self.options = options or WriterOptions()
        self.given = 0
        self._files: list[BagFile] = []
        self._counts: dict[BagTopic, int] = {}
        self._channels: dict[BagTopic, int] = {}
        self._closed = False
        try:
            self.path.mkdir(parents=True)
        except FileExistsError:
            raise BagError(f"{self.path} exists already: give another name, or remove it") from None
        except OSError as error:
            raise BagError(f"{self.path} cannot be made: {error.strerror}") from error
        try:
            (self.path / RESERVE).write_bytes(bytes(RESERVE_BYTES))
            self._stream = self._open()
        except OSError as error:
            (self.path / RESERVE).unlink(missing_ok=True)
            raise BagError(f"{self.path} cannot be written: {error.strerror}") from error

    def __repr__(self) -> str:
        return f"<bag {self.path}, being written: {self.given} messages of {len(self._counts)} topics>"

    @property
    def lost(self) -> int:
        """The messages that were given and are in no file, after `close`."""
        return self.given - sum(self._counts.values()) if self._closed else 0

    @property
    def size(self) -> int:
        """The size of the bag so far, with what waits to be written."""
        return (0 if self._closed else self._stream.size) + sum(
            (self.path / file.path).stat().st_size for file in self._files
        )

    def add(self, topic: BagTopic) -> None:
        """Note a topic, so that the bag tells of it even if it has no message."""
        self._counts.setdefault(topic, 0)
        if topic not in self._channels:
            self._channels[topic] = self._stream.channel(topic)

    def write(self, topic: BagTopic, data: bytes, *, received_ns: int, published_ns: int) -> Split | None:
        """Add one message, encoded in CDR; times are in nanoseconds since 1970. Returns the split that it caused, if any."""
        split = self.split() if self._full(received_ns) else None
        stream = self._stream
        channel = self._channels.get(topic)
        if channel is None:
            self.add(topic)
            channel = self._channels[topic]
        self.given += 1
        first = stream.first_waiting_ns
        stream.write(channel, data, received_ns=received_ns, published_ns=published_ns)
        if first is not None and received_ns - first >= FLUSH_NS:
            stream.flush()
        return split

    def split(self) -> Split:
        """Close the present file and begin the next one."""
        before = self._stream
        self._end(before)
        self._stream = self._open()
        topics, self._channels = list(self._channels), {}
        for topic in topics:
            self.add(topic)
        self._write_metadata()
        return Split(str(before.path), str(self._stream.path))

    def flush(self) -> None:
        """Write what waits to the file."""
        self._stream.flush()

    def close(self) -> BagMetadata:
        """Close the bag and write `metadata.yaml`; returns what it tells. Closing twice is harmless.

        Raises `OSError` if what waited could not be written. The bag is complete nevertheless if there was room for its index.
        """
        if not self._closed:
            self._closed = True
            (self.path / RESERVE).unlink(missing_ok=True)
            try:
                self._end(self._stream)
            finally:
                self._write_metadata()
        return self._metadata()

    def __enter__(self) -> BagWriter:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _full(self, now_ns: int) -> bool:
        options, stream = self.options, self._stream
        if not (stream.written or stream.waiting):
            return False
        if options.max_bytes and stream.size >= options.max_bytes:
            return True
        return bool(options.max_seconds) and now_ns - stream.first_ns >= options.max_seconds * 1e9

    def _open(self) -> McapStream:
        path = self.path / f"{self.path.name}_{len(self._files)}.mcap"
        return McapStream(path, compression=self.options.compression)

    def _end(self, stream: McapStream) -> None:
        """Close a file and take over its counts, whatever became of its last chunk."""
        try:
            try:
                stream.flush()
                stream.metadata("rosbag2", note_of(self._metadata(stream)))
            finally:
                stream.close()
        finally:
            self._files.append(_file_of(stream))
            self._counts = self._counted(stream)

    def _counted(self, stream: McapStream) -> dict[BagTopic, int]:
        """The numbers of messages in the closed files and in this one."""
        here = {topic: stream.counts.get(channel, 0) for topic, channel in self._channels.items()}
        return {topic: count + here.get(topic, 0) for topic, count in self._counts.items()}

    def _metadata(self, stream: McapStream | None = None) -> BagMetadata:
        """What the bag holds, with a file that is not closed yet."""
        topics = dict(self._counts) if stream is None else self._counted(stream)
        files = self._files if stream is None else [*self._files, _file_of(stream)]
        return BagMetadata(topics=topics, files=tuple(files), custom_data=self.options.custom_data)

    def _write_metadata(self) -> None:
        write_metadata(self.path, self._metadata())


def _file_of(stream: McapStream) -> BagFile:
    return BagFile(stream.path.name, stream.start_ns, stream.end_ns - stream.start_ns, stream.written)
