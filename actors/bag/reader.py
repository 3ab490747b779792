"""Reading bags: a folder of rosbag2 in MCAP or sqlite3, or one of its files alone."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import replace
from heapq import merge
from pathlib import Path
from types import TracebackType
from typing import Final

from actors.bag.contents import BagError, BagMessage, BagTopic, Newest, received
from actors.bag.foreign import SQLITE, ZSTD, begin_of, named
from actors.bag.mcap_reading import McapReading
from actors.bag.mcap_records import LARGEST
from actors.bag.mcap_stream import MAGIC
from actors.bag.metadata import METADATA, BagMetadata, merged, noted, read_metadata
from actors.bag.sqlite_reading import SqliteReading

Reading = McapReading | SqliteReading

READINGS: Final[dict[str, tuple[bytes, Callable[[Path, Path], Reading]]]] = {
    ".mcap": (MAGIC, McapReading),
    ".db3": (SQLITE, SqliteReading),
}
"""How files are read, by the end of their names and by their first bytes."""

PACKED: Final = ".zstd"


class BagReader:
    """A bag that is open for reading: ``with BagReader("walk") as bag: ...``.

    `path` is the folder of a bag, or one file. A file that was cut is read up to its last whole chunk; a folder without `metadata.yaml`, or
    one that is to be read `by_files`, is read by its files. Bags that rosbag2 has compressed by file or by message are read, too.

    Raises `BagError`, with file, place and the way out, for what is no bag, and while it is read for what is damaged.

    Attributes: `metadata`, what is known without reading messages; `topics`, with the definitions of their types.
    """

    # Invariant: `_readings` are the files in the order of the bag.

    def __init__(self, path: str | os.PathLike[str], *, by_files: bool = False) -> None:
        self.path = Path(path)
        self._files = Files()
        told: BagMetadata | None = None
        folder = self.path
        if self.path.is_dir():
            if (self.path / METADATA).is_file() and not by_files:
                told = read_metadata(self.path)
            paths = files_of(self.path) if told is None else [self.path / Path(file.path).name for file in told.files]
        elif self.path.is_file():
            folder, paths = self.path.parent, [self.path]
        else:
            raise BagError(f"there is no bag {self.path}")
        try:
            self._readings = [self._files.reading(path) for path in paths]
        except BaseException:
            self.close()
            raise
        if told is not None:
            said = {(topic.name, topic.type): topic for topic in told.topics}
            for reading in self._readings:
                reading.complete(lambda topic: _completed(topic, said))
        found = merged(reading.metadata() for reading in self._readings)
        noticed = noted(reading.told for reading in self._readings)
        self._unpack = Unpack(
            self.path, whole="message" in [one.compression_mode for one in (told, noticed) if one is not None]
        )
        self.folder = folder
        self.metadata = _joined(told, noticed, found, [path.name for path in paths])
        self.topics = tuple(self.metadata.topics)

    def __repr__(self) -> str:
        return f"<bag {self.path}: {self.metadata.message_count} messages of {len(self.topics)} topics>"

    @property
    def cut(self) -> bool:
        """Whether a file of the bag was not closed, because the recorder was killed or the disk was full."""
        return any(reading.cut for reading in self._readings)

    @property
    def size(self) -> int:
        """The size of the files of the bag."""
        return sum((self.folder / file.path).stat().st_size for file in self.metadata.files)

    def messages(self, topics: Collection[str] | None = None, *, start_ns: int = 0) -> Iterator[BagMessage]:
        """The messages received from `start_ns` on, in order of receipt; of `topics`, or of all."""
        if start_ns <= self.metadata.start_ns:
            start_ns = 0  # rosbag2 tells of a later start where a message was received at 0
        passes = [reading.messages(start_ns, topics) for reading in self._readings]
        for message in passes[0] if len(passes) == 1 else merge(*passes, key=received):
            yield self._unpack(message)

    def before(self, end_ns: int, counts: Mapping[str, int]) -> list[BagMessage]:
        """The newest messages received before `end_ns`, of each topic at most as many as `counts` tells, in order of receipt.

        With the index of an MCAP file only the chunks that hold them are read, however long ago they were recorded.
        """
        newest = Newest(counts)
        for file in reversed(range(len(self._readings))):
            self._readings[file].before(end_ns, newest, file)
        return [self._unpack(one) for one in newest.messages()]

    def close(self) -> None:
        """Remove what had to be unpacked. Closing twice is harmless."""
        self._files.close()

    def __enter__(self) -> BagReader:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


class Files:
    """The files of a bag. Invariant: `_temporary` holds the unpacked ones, until `close`. With `damaged`, one is unpacked as far as that is possible."""

    def __init__(self, *, damaged: bool = False) -> None:
        self._temporary: list[tempfile.TemporaryDirectory[str]] = []
        self._damaged = damaged

    def reading(self, path: Path) -> Reading:
        """A file as it is read: by its first bytes, or by its name if they tell nothing. Raises `BagError`."""
        try:
            begin = begin_of(path)
            other = named(path)
        except OSError as error:
            raise BagError(f"{path}: {error.strerror}") from error
        inner = path
        if begin.startswith(ZSTD) or path.suffix == PACKED:
            inner = self._unpacked(path)
            begin = begin_of(inner)
        for first, opened in READINGS.values():
            if begin.startswith(first):
                return opened(inner, path)
        if other:
            raise BagError(other)
        if inner.suffix not in READINGS:
            raise BagError(f"{path} is no file of a bag: its name ends in none of {', '.join(READINGS)}")
        return READINGS[inner.suffix][1](inner, path)

    def close(self) -> None:
        while self._temporary:
            self._temporary.pop().cleanup()

    def _unpacked(self, path: Path) -> Path:
        import zstandard

        folder = tempfile.TemporaryDirectory(prefix="robactor_bag_")
        self._temporary.append(folder)
        plain = Path(folder.name) / path.stem
        try:
            with path.open("rb") as packed, plain.open("wb") as out:
                shutil.copyfileobj(zstandard.ZstdDecompressor().stream_reader(packed), out)
        except (OSError, zstandard.ZstdError) as error:
            if self._damaged and isinstance(error, zstandard.ZstdError) and plain.stat().st_size:
                return plain
            raise BagError(
                f"{path} cannot be unpacked: {error}; `bag recover {path} -o NEW` writes what can be read"
            ) from error
        return plain


class Unpack:
    """Unpacks the messages that rosbag2 has compressed one by one: all if that is told, and otherwise those that cannot be CDR, but zstd."""

    def __init__(self, path: Path, *, whole: bool = False) -> None:
        self._path = path
        self._whole = whole
        self._decompress: Callable[[bytes], bytes] | None = None

    def __call__(self, message: BagMessage) -> BagMessage:
        """The message as it was before. Raises `BagError` for what cannot be unpacked."""
        if not (self._whole or (message.data[:4] == ZSTD and message.topic.serialization_format == "cdr")):
            return message
        import zstandard

        if self._decompress is None:
            self._decompress = zstandard.ZstdDecompressor().decompress
        try:
            if zstandard.frame_content_size(message.data) > LARGEST:
                raise zstandard.ZstdError(f"it says that it holds more than {LARGEST} bytes")
            return message._replace(data=self._decompress(message.data))
        except zstandard.ZstdError as error:
            raise BagError(
                f"{self._path}: a message of {message.topic.name}, received at {message.received_ns}, is damaged: {error}; "
                f"`bag recover {self._path} -o NEW` writes what can be read"
            ) from error


def files_of(folder: Path) -> list[Path]:
    """The files of a bag by their names, in the order of their numbers. Raises `BagError` if there is none."""
    found = [path for path in folder.iterdir() if Path(path.name.removesuffix(PACKED)).suffix in READINGS]
    if not found:
        raise BagError(f"{folder} is no bag: there is neither {METADATA} nor a file of {' or '.join(READINGS)}")
    return sorted(found, key=_number)


def _number(path: Path) -> tuple[int, str]:
    digits = path.name.partition(".")[0].rpartition("_")[2]
    return int(digits) if digits.isdigit() else 0, path.name


def _joined(told: BagMetadata | None, noticed: BagMetadata | None, found: BagMetadata, paths: list[str]) -> BagMetadata:
    """What the files hold, with what only `metadata.yaml` tells, or what was noted in the files."""
    files = tuple(replace(file, path=path) for file, path in zip(found.files, paths, strict=True))
    if told is None and noticed is not None:
        found = replace(found, custom_data=noticed.custom_data, ros_distro=noticed.ros_distro)
    if told is None:
        return replace(found, files=files)
    return replace(told, files=files, topics=found.topics)


def _completed(topic: BagTopic, said: dict[tuple[str, str], BagTopic]) -> BagTopic:
    known = said.get((topic.name, topic.type))
    if known is None:
        return topic
    return replace(
        topic,
        offered_qos_profiles=topic.offered_qos_profiles or known.offered_qos_profiles,
        type_hash=topic.type_hash or known.type_hash,
    )
