"""MCAP files as ROS 2 writes them: profile `ros2`, messages in CDR, schemas as concatenated definitions, offered QoS for each channel.

The format is described at https://mcap.dev/spec, with its well-known profile `ros2`; the metadata of a channel are those of
rosbag2_storage_mcap. The `mcap` library is imported when a file is opened.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Final

from actors.interfaces.hashes import type_hash
from actors.interfaces.text import schema_text
from actors.qos import resolve_publisher

if TYPE_CHECKING:
    from actors.interfaces.message import Message
    from actors.qos.policies import QoS

__all__ = ["McapFile", "qos_profiles_text"]

FOREVER: Final = (9_223_372_036, 854_775_807)
"""The seconds and nanoseconds that stand for an unspecified duration (RMW_DURATION_INFINITE)."""


class McapFile:
    """An MCAP file, written as a context manager. The complete file appears at its path when the block ends without an error."""

    def __init__(self, path: str | os.PathLike[str]) -> None:
        from mcap.writer import Writer

        self.path = Path(path)
        self._part = self.path.with_name(f"{self.path.name}.part")
        self._stream = self._part.open("wb")
        self._writer = Writer(self._stream)
        self._writer.start(profile="ros2")
        self._schemas: dict[type[Message], int] = {}
        self._sequences: dict[int, int] = {}

    def channel(self, topic: str, type: type[Message], offered: Iterable[QoS]) -> int:
        """Add a channel for messages of this type and return its number."""
        schema = self._schemas.get(type)
        if schema is None:
            text = schema_text(type).encode()
            schema = self._schemas[type] = self._writer.register_schema(type.__ros_type__, "ros2msg", text)
        metadata = {"offered_qos_profiles": qos_profiles_text(offered), "topic_type_hash": type_hash(type)}
        return self._writer.register_channel(topic, "cdr", schema, metadata)

    def write(self, channel: int, data: bytes, *, received_ns: int, published_ns: int) -> None:
        """Add one message, encoded in CDR. Times are in nanoseconds."""
        sequence = self._sequences[channel] = self._sequences.get(channel, 0) + 1
        self._writer.add_message(channel, received_ns, data, published_ns, sequence)

    def metadata(self, name: str, values: Mapping[str, str]) -> None:
        """Add a record of text values about the file."""
        self._writer.add_metadata(name, dict(values))

    def __enter__(self) -> McapFile:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with self._stream:
            if error is None:
                self._writer.finish()  # type: ignore[no-untyped-call]  # mcap has types everywhere but here
        if error is None:
            self._part.replace(self.path)
        else:
            self._part.unlink()


def qos_profiles_text(offered: Iterable[QoS]) -> str:
    """The QoS offered by the publishers of a topic, as the YAML text of rosbag2's metadata, version 9."""
    return "".join(_profile_text(resolve_publisher(qos)) for qos in offered)


def _profile_text(qos: QoS) -> str:
    lines = [f"- history: {qos.history}", f"  depth: {qos.given_depth}"]
    lines += [f"  reliability: {qos.reliability}", f"  durability: {qos.durability}"]
    lines += [*_duration_lines("deadline", qos.deadline), *_duration_lines("lifespan", qos.lifespan)]
    lines += [f"  liveliness: {qos.liveliness}", *_duration_lines("liveliness_lease_duration", qos.liveliness_lease)]
    return "\n".join([*lines, "  avoid_ros_namespace_conventions: false\n"])


def _duration_lines(name: str, seconds: float | None) -> list[str]:
    sec, nsec = FOREVER if seconds is None else divmod(round(seconds * 1e9), 1_000_000_000)
    return [f"  {name}:", f"    sec: {sec}", f"    nsec: {nsec}"]
