"""Making bags from bags: convert, filter, merge; recover what was cut, and write `metadata.yaml` anew."""

from __future__ import annotations

import os
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from heapq import merge
from pathlib import Path
from typing import TYPE_CHECKING

from actors.bag.contents import BagError, BagTopic
from actors.bag.mcap_reading import McapReading, Salvage
from actors.bag.metadata import METADATA, BagMetadata, write_metadata
from actors.bag.reader import BagReader, files_of
from actors.bag.selection import EVERYTHING, Selection
from actors.bag.writer import BagWriter, WriterOptions

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.bag.contents import BagMessage

__all__ = ["Recovered", "recover", "reindex", "rewrite"]


def rewrite(
    sources: Sequence[str | os.PathLike[str]],
    target: str | os.PathLike[str],
    *,
    selection: Selection = EVERYTHING,
    start_ns: int = 0,
    end_ns: int | None = None,
    options: WriterOptions | None = None,
    progress: Callable[[int], None] | None = None,
) -> BagMetadata:
    """Write the messages of one or several bags into a new one, in order of receipt; the result is its metadata.

    Only topics of `selection` are taken, and messages received from `start_ns` until before `end_ns`. Types that a bag holds no definition
    of get that of this process. `progress` is told the number of messages now and then. Raises `BagError` and `OSError`.
    """
    with ExitStack() as stack:
        bags = [stack.enter_context(BagReader(source)) for source in sources]
        writer = stack.enter_context(BagWriter(target, options))
        known: dict[tuple[str, str], BagTopic] = {}
        for bag in bags:
            for topic in bag.topics:
                if selection.takes(topic.name, topic.type) and (topic.name, topic.type) not in known:
                    known[topic.name, topic.type] = _defined(topic)
        for topic in known.values():
            writer.add(topic)
        names = {name for name, _ in known}
        for message in merge(*(bag.messages(names, start_ns=start_ns) for bag in bags), key=_received):
            if end_ns is not None and message.received_ns >= end_ns:
                break
            into = known.get((message.topic.name, message.topic.type))
            if into is not None:
                writer.write(into, message.data, received_ns=message.received_ns, published_ns=message.published_ns)
                if progress is not None and writer.given % 1000 == 0:
                    progress(writer.given)
    return writer.close()


def _received(message: BagMessage) -> int:
    return message.received_ns


def _defined(topic: BagTopic) -> BagTopic:
    """The topic with the definition that this process knows, if the bag holds none."""
    if topic.schema:
        return topic
    from actors.interfaces.errors import UnknownInterface
    from actors.interfaces.hashes import type_hash
    from actors.interfaces.registry import get_message
    from actors.interfaces.text import schema_text

    try:
        type = get_message(topic.type)
    except UnknownInterface as error:
        raise BagError(f"the bag holds no definition of {topic.type} of {topic.name}, and {error}") from error
    return replace(
        topic, schema=schema_text(type), schema_encoding="ros2msg", type_hash=topic.type_hash or type_hash(type)
    )


def reindex(folder: str | os.PathLike[str]) -> BagMetadata:
    """Write `metadata.yaml` of a bag from its files, and return it. Files are not changed. Raises `BagError` and `OSError`."""
    path = Path(folder)
    if not path.is_dir():
        raise BagError(f"{path} is no folder: a bag is a folder with its files")
    files_of(path)
    (path / METADATA).unlink(missing_ok=True)
    with BagReader(path) as bag:
        write_metadata(path, bag.metadata)
        return bag.metadata


@dataclass(frozen=True, slots=True)
class Recovered:
    """What was recovered of a bag."""

    metadata: BagMetadata
    damaged: int
    """The chunks and records that could not be read."""

    lost_bytes: int
    """The bytes at the ends of files that are no whole chunk."""


def recover(
    source: str | os.PathLike[str], target: str | os.PathLike[str], *, options: WriterOptions | None = None
) -> Recovered:
    """Write everything that can be read of a bag or a file in MCAP into a new bag: all whole chunks, whatever became of index and end.

    Raises `BagError` if nothing is an MCAP file, and `OSError`. The source is not changed.
    """
    path = Path(source)
    if not path.exists():
        raise BagError(f"there is no bag {path}")
    paths = files_of(path) if path.is_dir() else [path]
    damaged = lost = 0
    readings = [McapReading(each) for each in paths]
    with BagWriter(target, options) as writer:
        for reading in readings:
            salvage = Salvage()
            for one in reading.salvage(salvage):
                writer.write(one.topic, one.data, received_ns=one.received_ns, published_ns=one.published_ns)
            damaged += salvage.damaged
            lost += salvage.lost_bytes
    return Recovered(writer.close(), damaged, lost)
