"""One MCAP file that appears when it is complete: profile `ros2`, messages in CDR, schemas as concatenated definitions, offered QoS."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING

from actors.bag.contents import topic_of
from actors.bag.mcap_stream import McapStream

if TYPE_CHECKING:
    from actors.interfaces.message import Message
    from actors.qos.policies import QoS


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
