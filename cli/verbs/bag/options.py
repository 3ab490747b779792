"""Options that several verbs of `bag` have in common."""

from __future__ import annotations

import argparse
from pathlib import Path

from actors import QoS
from actors.bag import BagReader, Selection, WriterOptions, qos_overrides
from cli.command import CommandFailed
from cli.parsing import complain
from cli.verbs.bag import PRESETS

UNITS = ("B", "KiB", "MiB", "GiB", "TiB")


def size(count: int) -> str:
    """A number of bytes as `ros2 bag info` writes it."""
    value, unit = float(count), 0
    while value >= 1024 and unit < len(UNITS) - 1:
        value, unit = value / 1024, unit + 1
    return f"{value:.0f} B" if unit == 0 else f"{value:.1f} {UNITS[unit]}"


def selection_of(options: argparse.Namespace) -> Selection:
    """What the options of `add_selection` mean. Raises `CommandFailed` for a pattern that is none."""
    named = options.topics or options.services or options.actions or options.topic_types or options.regex
    recording = hasattr(options, "all_topics")
    everything = options.all if recording else not named
    try:
        return Selection(
            topics=options.topics,
            types=options.topic_types,
            services=options.services,
            actions=options.actions,
            regex=options.regex,
            all_topics=everything or (recording and options.all_topics),
            all_services=everything or (recording and options.all_services),
            all_actions=everything or (recording and options.all_actions),
            hidden=options.include_hidden_topics if recording else not named,
            exclude_regex=options.exclude_regex,
            exclude_topics=options.exclude_topics,
            exclude_types=options.exclude_topic_types,
            exclude_services=options.exclude_services,
            exclude_actions=options.exclude_actions,
        )
    except ValueError as error:
        raise CommandFailed(str(error)) from error


def complain_of_absent(selection: Selection, bag: BagReader) -> None:
    """A line for each topic, service and action that was named and is not in the bag."""
    for one in selection.absent(topic.name for topic in bag.topics):
        complain(f"{bag.path} has no {one}")


def writing_of(options: argparse.Namespace) -> WriterOptions:
    """What the options of `add_writing` mean. Raises `CommandFailed` if they contradict each other."""
    if options.compression_format not in (None, "none") and options.compression_mode == "none":
        raise CommandFailed(
            "--compression-format asks for compression, and --compression-mode none for none: leave one out"
        )
    compression = options.compression_format or PRESETS.get(options.storage_preset_profile or "", "zstd")
    custom: dict[str, str] = {}
    for pair in options.custom_data:
        key, found, value = pair.partition("=")
        if not found:
            raise CommandFailed(f"--custom-data {pair!r}: write it as KEY=VALUE")
        custom[key] = value
    try:
        return WriterOptions(
            compression="none" if options.compression_mode == "none" else compression,
            max_bytes=options.max_bag_size,
            max_seconds=options.max_bag_duration,
            custom_data=custom,
        )
    except ValueError as error:
        raise CommandFailed(str(error)) from error


def profiles(path: Path | None) -> dict[str, QoS]:
    """The file of `--qos-profile-overrides-path`."""
    return {} if path is None else qos_overrides(path)
