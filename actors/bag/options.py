"""What a recorder and a player are told."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final, Literal

from actors.bag.qos_text import qos_from_mapping
from actors.bag.selection import EVERYTHING, Selection
from actors.bag.writer import WriterOptions
from actors.bag.yaml_text import load_yaml
from actors.qos import InvalidQoS
from actors.qos.policies import QoS

CACHE_BYTES: Final = 100 * 1024 * 1024


@dataclass(frozen=True, kw_only=True)
class RecordOptions:
    """What a `Recorder` records, and how."""

    selection: Selection = field(default_factory=lambda: Selection(all_topics=True))
    writer: WriterOptions = field(default_factory=WriterOptions)
    qos: Mapping[str, QoS] = field(default_factory=dict[str, "QoS"])
    """What to request of a topic, by its name, instead of what fits its publishers."""

    max_cache_bytes: int = CACHE_BYTES
    """How much may wait to be written. Messages beyond that are lost, and counted."""

    snapshot: bool = False
    """Keep the newest messages in memory, at most `max_cache_bytes`, and write them when `Recorder.snapshot` is called."""

    snapshot_seconds: float = math.inf
    """With `snapshot`: how long they are kept."""

    paused: bool = False
    """Record nothing until `Recorder.unpause` is called."""

    discovery: bool = True
    """Also record topics that appear later."""

    unpublished: bool = False
    """Also subscribe to topics that nobody publishes yet."""

    leaf_topics: bool = True
    """Also record topics that nobody else subscribes to."""

    def __post_init__(self) -> None:
        if self.max_cache_bytes <= 0 or not self.snapshot_seconds > 0:
            raise ValueError("a recorder needs a cache of more than 0 bytes, and a snapshot of more than 0 seconds")


@dataclass(frozen=True, kw_only=True)
class PlayOptions:
    """What a `Player` plays, and how. Times are in seconds."""

    selection: Selection = EVERYTHING
    rate: float = 1.0
    loop: bool = False
    delay: float = 0.0
    """Wait this long before playing begins, and time on /clock with it."""

    start_offset: float = 0.0
    """Begin this long after the first message of the bag, with what latched topics held then."""

    duration: float = math.inf
    """Play this long, in the time of the bag."""

    until_ns: int | None = None
    """Play until this time of the bag, in nanoseconds since 1970."""

    paused: bool = False
    remap: Mapping[str, str] = field(default_factory=dict[str, str])
    """Topics, services and actions that are played under another name."""

    qos: Mapping[str, QoS] = field(default_factory=dict[str, "QoS"])
    """What to offer on a topic, by its name in the bag, instead of what was recorded."""

    clock_hz: float = 0.0
    """Publish the time of the bag on /clock so often in a second; 0: do not. What the bag has on /clock is then left out."""

    clock_topics: frozenset[str] | None = frozenset()
    """Also publish it before each message of these topics; None: of all."""

    service_requests: Literal["", "service", "client"] = ""
    """Send the recorded requests and goals, as the server or the client has recorded them, instead of playing the events of services."""

    read_ahead: int = 1000
    """How many messages are read at once."""

    scrub: bool = False
    """For those who look at a recording: a seek also plays what each topic showed at that time, its last message, or as many as its publishers
    kept (of transforms, log lines and diagnostics the last hundred), and the player waits at the end of the bag for the next seek."""

    def __post_init__(self) -> None:
        if not 0 < self.rate < math.inf:
            raise ValueError(f"a bag cannot be played at the rate {self.rate:g}: it must be above 0")
        if min(self.delay, self.start_offset, self.duration, self.clock_hz) < 0 or self.read_ahead < 1:
            raise ValueError("durations, offsets and rates of a player cannot be negative")
        if self.scrub and self.service_requests:
            raise ValueError("a bag that is scrubbed through sends no requests: they would be sent again and again")

    @property
    def clock(self) -> bool:
        """Whether /clock is published."""
        return self.clock_hz > 0 or self.clock_topics is None or bool(self.clock_topics)


def qos_overrides(path: str | os.PathLike[str]) -> dict[str, QoS]:
    """The profiles of a YAML file by topic, as `ros2 bag --qos-profile-overrides-path` takes it. Raises `InvalidQoS` and `OSError`."""
    try:
        profiles: object = load_yaml(Path(path).read_text(encoding="utf-8"))
    except ValueError as error:
        raise InvalidQoS(f"{path} cannot be read: {error}") from None
    if not isinstance(profiles, dict):
        raise InvalidQoS(f"{path} holds no topics with their profiles")
    return {str(topic): qos_from_mapping(profile) for topic, profile in profiles.items()}  # pyright: ignore[reportUnknownVariableType, reportUnknownArgumentType]
