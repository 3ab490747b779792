"""Making bags from bags: convert, filter, merge; recover what was cut or damaged, and write `metadata.yaml` anew."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass, replace
from heapq import merge
from pathlib import Path

from actors.bag.contents import BagError, BagTopic, received
from actors.bag.mcap_reading import Salvage
from actors.bag.metadata import BagMetadata, noted, read_metadata, write_metadata
from actors.bag.qos_text import parse_qos_profiles
from actors.bag.reader import BagReader, Files, Unpack, files_of
from actors.bag.schemas import identity, type_of
from actors.bag.selection import EVERYTHING, Selection
from actors.bag.writer import BagWriter, WriterOptions
from actors.interfaces.hashes import type_hash
from actors.interfaces.text import schema_text
from actors.qos import InvalidQoS


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
    of get that of this process, if it knows them. `progress` gets the number of messages now and then. Raises `BagError` and `OSError`.
    """
    with ExitStack() as stack:
        bags = [stack.enter_context(BagReader(source)) for source in sources]
        writer = stack.enter_context(BagWriter(target, options))
        known: dict[tuple[str, ...], BagTopic] = {}
        into: dict[BagTopic, BagTopic] = {}
        for bag in bags:
            for topic in bag.topics:
                if selection.takes(topic.name, topic.type):
                    whole = _defined(topic)
                    key = topic.name, topic.type, topic.serialization_format, identity(whole)
                    into[topic] = known.setdefault(key, whole)
        for topic in known.values():
            writer.add(topic)
        names = {topic.name for topic in into}
        for message in merge(*(bag.messages(names, start_ns=start_ns) for bag in bags), key=received):
            if end_ns is not None and message.received_ns >= end_ns:
                break
            target_topic = into.get(message.topic)
            if target_topic is not None:
                writer.write(
                    target_topic, message.data, received_ns=message.received_ns, published_ns=message.published_ns
                )
                if progress is not None and writer.given % 1000 == 0:
                    progress(writer.given)
    return writer.close()


def _defined(topic: BagTopic) -> BagTopic:
    """The topic with the definition that this process knows, if the bag holds none."""
    if topic.schema.strip() or topic.serialization_format != "cdr":
        return topic
    try:
        type = type_of(topic)
    except BagError:
        return topic  # bytes are copied without one, too
    return replace(
        topic, schema=schema_text(type), schema_encoding="ros2msg", type_hash=topic.type_hash or type_hash(type)
    )


def reindex(folder: str | os.PathLike[str]) -> BagMetadata:
    """Write `metadata.yaml` of a bag from its files, and return it. Files are not changed. Raises `BagError` and `OSError`.

    What the files do not tell, such as custom data, is taken over from the present `metadata.yaml` if it can be read.
    """
    path = Path(folder)
    if not path.is_dir():
        raise BagError(f"{path} is no folder: a bag is a folder with its files")
    present: BagMetadata | None = None
    with suppress(BagError):
        present = read_metadata(path)
    with BagReader(path, by_files=True) as bag:
        metadata = bag.metadata
        if present is not None:
            metadata = replace(
                metadata,
                custom_data=present.custom_data or metadata.custom_data,
                ros_distro=present.ros_distro or metadata.ros_distro,
                compression_format=present.compression_format,
                compression_mode=present.compression_mode,
            )
        write_metadata(path, metadata)
        return metadata


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
    """Write everything that can be read of a bag or one of its files into a new bag, whatever became of index, end, or some of its data.

    Raises `BagError` if nothing is a file of a bag, and `OSError`. The source is not changed.
    """
    path = Path(source)
    if not path.exists():
        raise BagError(f"there is no bag {path}")
    paths = files_of(path) if path.is_dir() else [path]
    damaged = lost = 0
    files = Files(damaged=True)
    try:
        readings = [files.reading(each) for each in paths]
        present = noted(reading.told for reading in readings)
        with suppress(BagError):
            present = read_metadata(path if path.is_dir() else path.parent)
        unpack = Unpack(path, whole=present is not None and present.compression_mode == "message")
        with BagWriter(target, options) as writer:
            for reading in readings:
                salvage = Salvage()
                topics: dict[BagTopic, BagTopic] = {}
                for one in reading.salvage(salvage):
                    topic = topics.get(one.topic)
                    if topic is None:
                        topic = topics[one.topic] = _mended(_defined(one.topic))
                    try:
                        data = unpack(one).data
                    except BagError:
                        damaged += 1
                        continue
                    writer.write(topic, data, received_ns=one.received_ns, published_ns=one.published_ns)
                damaged += salvage.damaged
                lost += salvage.lost_bytes
    finally:
        files.close()
    return Recovered(writer.close(), damaged, lost)


def _mended(topic: BagTopic) -> BagTopic:
    """The topic without an offered quality of service that is damaged."""
    try:
        parse_qos_profiles(topic.offered_qos_profiles)
    except InvalidQoS:
        return replace(topic, offered_qos_profiles="")
    return topic
