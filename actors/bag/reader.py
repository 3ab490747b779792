"""Reading bags: a folder of rosbag2 in MCAP or sqlite3, or one of its files alone."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import replace
from heapq import merge
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from actors.bag.contents import BagError, BagMessage, BagTopic
from actors.bag.mcap_reading import McapReading
from actors.bag.metadata import METADATA, BagMetadata, merged, read_metadata
from actors.bag.newest import Newest
from actors.bag.sqlite_reading import SqliteReading

if TYPE_CHECKING:
    from types import TracebackType

__all__ = ["BagReader", "files_of"]

READINGS: Final[dict[str, Callable[[Path], McapReading | SqliteReading]]] = {
    ".mcap": McapReading,
    ".db3": SqliteReading,
}
PACKED: Final = ".zstd"


class BagReader:
    """A bag that is open for reading: ``with BagReader("walk") as bag: ...``.

    `path` is the folder of a bag, or one file. A file that was cut is read up to its last whole chunk; a folder without `metadata.yaml` is
    read by its files. Bags that rosbag2 has compressed by file or by message are read, too. Raises `BagError`.

    Attributes: `metadata`, what is known without reading messages; `topics`, with the definitions of their types.
    """

    # Invariants: `_readings` are the files in the order of the bag. `_temporary` holds the unpacked ones, until `close`.

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = Path(path)
        self._temporary: list[tempfile.TemporaryDirectory[str]] = []
        self._unpack: Callable[[bytes], bytes] = bytes
        told: BagMetadata | None = None
        folder = self.path
        if self.path.is_dir():
            if (self.path / METADATA).is_file():
                told = read_metadata(self.path)
            paths = files_of(self.path) if told is None else [self.path / Path(file.path).name for file in told.files]
        elif self.path.is_file():
            folder, paths = self.path.parent, [self.path]
        else:
            raise BagError(f"there is no bag {self.path}")
        try:
            self._readings = [self._reading(path) for path in paths]
        except BaseException:
            self.close()
            raise
        found = merged(reading.metadata() for reading in self._readings)
        if told is not None and told.compression_mode == "message":
            self._unpack = _unpacker()
        self.folder = folder
        self.metadata = _joined(told, found, [path.name for path in paths])
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
        passes = [reading.messages(start_ns, topics) for reading in self._readings]
        for message in passes[0] if len(passes) == 1 else merge(*passes, key=_received):
            yield message if self._unpack is bytes else message._replace(data=self._unpack(message.data))

    def before(self, end_ns: int, counts: Mapping[str, int]) -> list[BagMessage]:
        """The newest messages received before `end_ns`, of each topic at most as many as `counts` tells, in order of receipt.

        With the index of an MCAP file only the chunks that hold them are read, however long ago they were recorded.
        """
        newest = Newest(counts)
        for file in reversed(range(len(self._readings))):
            self._readings[file].before(end_ns, newest, file)
        found = newest.messages()
        return found if self._unpack is bytes else [one._replace(data=self._unpack(one.data)) for one in found]

    def close(self) -> None:
        """Remove what had to be unpacked. Closing twice is harmless."""
        while self._temporary:
            self._temporary.pop().cleanup()

    def __enter__(self) -> BagReader:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _reading(self, path: Path) -> McapReading | SqliteReading:
        if path.suffix == PACKED:
            path = self._unpacked(path)
        opened = READINGS.get(path.suffix)
        if opened is None:
            raise BagError(f"{path} is no file of a bag: its name ends in none of {', '.join(READINGS)}")
        return opened(path)

    def _unpacked(self, path: Path) -> Path:
        import zstandard

        folder = tempfile.TemporaryDirectory(prefix="robactor_bag_")
        self._temporary.append(folder)
        plain = Path(folder.name) / path.stem
        try:
            with path.open("rb") as packed, plain.open("wb") as out:
                shutil.copyfileobj(zstandard.ZstdDecompressor().stream_reader(packed), out)
        except (OSError, zstandard.ZstdError) as error:
            raise BagError(f"{path} cannot be unpacked: {error}") from error
        return plain


def files_of(folder: Path) -> list[Path]:
    """The files of a bag by their names, in the order of their numbers. Raises `BagError` if there is none."""
    found = [path for path in folder.iterdir() if Path(path.name.removesuffix(PACKED)).suffix in READINGS]
    if not found:
        raise BagError(f"{folder} is no bag: there is neither {METADATA} nor a file of {' or '.join(READINGS)}")
    return sorted(found, key=_number)


def _number(path: Path) -> tuple[int, str]:
    digits = path.name.partition(".")[0].rpartition("_")[2]
    return int(digits) if digits.isdigit() else 0, path.name


def _received(message: BagMessage) -> int:
    return message.received_ns


def _joined(told: BagMetadata | None, found: BagMetadata, paths: list[str]) -> BagMetadata:
    """What the files hold, with what only `metadata.yaml` tells."""
    files = tuple(replace(file, path=path) for file, path in zip(found.files, paths, strict=True))
    if told is None:
        return replace(found, files=files)
    said = {(topic.name, topic.type): topic for topic in told.topics}
    return replace(told, files=files, topics={_completed(topic, said): count for topic, count in found.topics.items()})


def _completed(topic: BagTopic, said: dict[tuple[str, str], BagTopic]) -> BagTopic:
    known = said.get((topic.name, topic.type))
    if known is None:
        return topic
    return replace(
        topic,
        offered_qos_profiles=topic.offered_qos_profiles or known.offered_qos_profiles,
        type_hash=topic.type_hash or known.type_hash,
    )


def _unpacker() -> Callable[[bytes], bytes]:
    import zstandard

    unpack: Any = zstandard.ZstdDecompressor().decompress
    return lambda data: bytes(unpack(data))
