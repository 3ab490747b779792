"""`metadata.yaml`: what rosbag2 writes beside the files of a bag, version 9."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

from actors.bag.contents import BagError, BagTopic
from actors.bag.yaml_text import dump_yaml, load_yaml

METADATA: Final = "metadata.yaml"
VERSION: Final = 9
ROOT: Final = "rosbag2_bagfile_information"
NOTE: Final = "serialized_metadata"
"""Under which key rosbag2 notes the metadata in a file."""

UNREADABLE: Final = (KeyError, TypeError, AttributeError, ValueError, OverflowError)
"""What is raised for metadata that are none."""

DISTRO: Final = "robactor"
"""What our bags give as their distribution of ROS."""


@dataclass(frozen=True, slots=True)
class BagFile:
    """One file of a bag. Times are in nanoseconds, those of its first message and from there to its last one."""

    path: str
    """Relative to the folder of the bag."""

    start_ns: int = 0
    duration_ns: int = 0
    message_count: int = 0


@dataclass(frozen=True, slots=True)
class BagMetadata:
    """What is known of a bag without reading its messages."""

    storage: str = "mcap"
    topics: Mapping[BagTopic, int] = field(default_factory=dict[BagTopic, int])
    """The topics with their numbers of messages, in order of recording."""

    files: tuple[BagFile, ...] = ()
    compression_format: str = ""
    compression_mode: str = ""
    """`file` or `message` for bags that rosbag2 compressed as such; empty for compression within the storage, and for none."""

    custom_data: Mapping[str, str] = field(default_factory=dict[str, str])
    ros_distro: str = DISTRO
    version: int = VERSION

    @property
    def message_count(self) -> int:
        return sum(self.topics.values())

    @property
    def start_ns(self) -> int:
        """When the first message was received; 0 in an empty bag."""
        return min((file.start_ns for file in self.files if file.message_count), default=0)

    @property
    def end_ns(self) -> int:
        """When the last message was received; 0 in an empty bag."""
        return max((file.start_ns + file.duration_ns for file in self.files if file.message_count), default=0)

    @property
    def duration_ns(self) -> int:
        return self.end_ns - self.start_ns


def merged(parts: Iterable[BagMetadata]) -> BagMetadata:
    """The metadata of a bag that consists of these parts, in order. Settings are those of the first one."""
    whole: BagMetadata | None = None
    counts: dict[BagTopic, int] = {}
    files: tuple[BagFile, ...] = ()
    for part in parts:
        whole = whole or part
        files += part.files
        for topic, count in part.topics.items():
            counts[topic] = counts.get(topic, 0) + count
    return replace(whole or BagMetadata(), topics=counts, files=files)


def write_metadata(folder: Path, metadata: BagMetadata) -> None:
    """Write `metadata.yaml`; the complete file replaces an older one. Raises `OSError`."""
    part = folder / f"{METADATA}.part"
    part.write_text(dump_yaml({ROOT: _mapping(metadata)}), encoding="utf-8")
    part.replace(folder / METADATA)


def read_metadata(folder: Path) -> BagMetadata:
    """Read `metadata.yaml` of any version of rosbag2. Schemas are not in it. Raises `BagError`."""
    path = folder / METADATA
    try:
        return _metadata(load_yaml(path.read_text(encoding="utf-8"))[ROOT])
    except OSError as error:
        raise BagError(f"{path}: {error.strerror}; `bag reindex {folder}` writes it anew") from error
    except UNREADABLE as error:
        why = f"{type(error).__name__}: {error}".splitlines()[0]
        raise BagError(f"{path} is no metadata of a bag ({why}); `bag reindex {folder}` writes it anew") from error


def note_of(metadata: BagMetadata) -> dict[str, str]:
    """What rosbag2 notes of a bag in each of its files."""
    return {NOTE: dump_yaml(_mapping(metadata))}


def noted(notes: Iterable[Mapping[str, str]]) -> BagMetadata | None:
    """The metadata of a bag by the notes in its files, the last of which counts; None if there are none that can be read."""
    found: BagMetadata | None = None
    for note in notes:
        with suppress(*UNREADABLE):
            values = load_yaml(note[NOTE])
            found = _metadata(values.get(ROOT, values))
    return found


def _mapping(bag: BagMetadata) -> dict[str, object]:
    return {
        "version": bag.version,
        "storage_identifier": bag.storage,
        "duration": {"nanoseconds": bag.duration_ns},
        "starting_time": {"nanoseconds_since_epoch": bag.start_ns},
        "message_count": bag.message_count,
        "topics_with_message_count": [_topic_mapping(*each) for each in bag.topics.items()],
        "compression_format": bag.compression_format,
        "compression_mode": bag.compression_mode,
        "relative_file_paths": [file.path for file in bag.files],
        "files": [
            {
                "path": file.path,
                "starting_time": {"nanoseconds_since_epoch": file.start_ns},
                "duration": {"nanoseconds": file.duration_ns},
                "message_count": file.message_count,
            }
            for file in bag.files
        ],
        "custom_data": dict(bag.custom_data) or None,
        "ros_distro": bag.ros_distro,
    }


def _topic_mapping(topic: BagTopic, count: int) -> dict[str, object]:
    return {
        "topic_metadata": {
            "name": topic.name,
            "type": topic.type,
            "serialization_format": topic.serialization_format,
            "offered_qos_profiles": _profiles(topic.offered_qos_profiles),
            "type_description_hash": topic.type_hash,
        },
        "message_count": count,
    }


def _profiles(text: str) -> list[object]:
    """The offered quality of service as plain values; none of a text that is damaged."""
    try:
        found: object = load_yaml(text)
    except ValueError:
        return []
    return found if isinstance(found, list) else []  # pyright: ignore[reportUnknownVariableType]


def _metadata(values: Mapping[str, Any]) -> BagMetadata:
    files = tuple(
        BagFile(
            str(one["path"]),
            int(one["starting_time"]["nanoseconds_since_epoch"]),
            int(one["duration"]["nanoseconds"]),
            int(one["message_count"]),
        )
        for one in values.get("files") or ()
    )
    if not files:  # older than version 5
        start, duration = values["starting_time"]["nanoseconds_since_epoch"], values["duration"]["nanoseconds"]
        count = int(values["message_count"])
        files = tuple(BagFile(str(path), int(start), int(duration), count) for path in values["relative_file_paths"])
    return BagMetadata(
        storage=str(values["storage_identifier"]),
        topics=dict(_topic(one) for one in values["topics_with_message_count"]),
        files=files,
        compression_format=values.get("compression_format") or "",
        compression_mode=(values.get("compression_mode") or "").lower().replace("none", ""),
        custom_data=_texts(values.get("custom_data") or {}),
        ros_distro=str(values.get("ros_distro") or ""),
        version=int(values["version"]),
    )


def _texts(values: Mapping[Any, object]) -> dict[str, str]:
    return {str(name): str(value) for name, value in values.items()}


def _topic(values: Mapping[str, Any]) -> tuple[BagTopic, int]:
    told = values["topic_metadata"]
    profiles = told.get("offered_qos_profiles") or ""
    topic = BagTopic(
        str(told["name"]),
        str(told["type"]),
        offered_qos_profiles=profiles if isinstance(profiles, str) else dump_yaml(profiles),
        type_hash=str(told.get("type_description_hash") or ""),
        serialization_format=str(told["serialization_format"]),
    )
    return topic, int(values["message_count"])
