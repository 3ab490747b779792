"""Options that several verbs of `bag` have in common."""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from pathlib import Path

from actors import QoS
from actors.bag import Selection, WriterOptions, qos_overrides
from cli.command import CommandFailed
from cli.parsing import add_interfaces, parsed
from cli.types import learn_folders

__all__ = [
    "add_selection", "add_writing", "not_negative", "positive", "profiles", "selection_of", "size", "with_types",
    "writing_of",
]  # fmt: skip

UNITS = ("B", "KiB", "MiB", "GiB", "TiB")
PRESETS = {"none": "none", "fastwrite": "none", "zstd_fast": "zstd", "zstd_small": "zstd"}


def with_types(parser: argparse.ArgumentParser, argv: Sequence[str]) -> argparse.Namespace:
    """The options of a verb that may have to know types which no bag defines: those of an installed ROS 2 and of ``--interfaces``."""
    add_interfaces(parser)
    options = parsed(parser, argv)
    learn_folders(options)
    return options


def positive(text: str) -> float:
    """A number above 0."""
    number = not_negative(text)
    if number == 0:
        raise argparse.ArgumentTypeError(f"{text!r} is not above 0")
    return number


def not_negative(text: str) -> float:
    """A number, 0 or more."""
    try:
        number = float(text)
    except ValueError:
        number = -1.0
    if not 0 <= number < math.inf:
        raise argparse.ArgumentTypeError(f"{text!r} is no number, 0 or more")
    return number


def size(count: int) -> str:
    """A number of bytes as `ros2 bag info` writes it."""
    value, unit = float(count), 0
    while value >= 1024 and unit < len(UNITS) - 1:
        value, unit = value / 1024, unit + 1
    return f"{value:.0f} B" if unit == 0 else f"{value:.1f} {UNITS[unit]}"


def add_selection(parser: argparse.ArgumentParser, verb: str, *, everything: bool) -> None:
    """What is meant by name, pattern or type. With `everything`, all is meant that is not excluded, if nothing is named."""
    group = parser.add_argument_group("what")

    def many(flag: str, metavar: str, text: str) -> None:
        group.add_argument(flag, nargs="+", default=[], metavar=metavar, help=text)

    many("--topics", "TOPIC", f"{verb} these topics")
    many("--services", "SERVICE", "these services")
    many("--actions", "ACTION", "these actions")
    many("--topic-types", "TYPE", "topics of these types")
    group.add_argument("-e", "--regex", default="", help="those whose name contains this pattern")
    if not everything:
        group.add_argument("-a", "--all", action="store_true", help="all topics, services and actions but hidden ones")
        group.add_argument("--all-topics", action="store_true", help="all topics but hidden ones")
        group.add_argument("--all-services", action="store_true", help="all services, by their introspection")
        group.add_argument("--all-actions", action="store_true", help="all actions: feedback, status, introspection")
        group.add_argument(
            "--include-hidden-topics", action="store_true", help="also those with a part that begins with _"
        )
    group.add_argument("-x", "--exclude-regex", default="", help="not those whose name contains this pattern")
    many("--exclude-topics", "TOPIC", "not these topics")
    many("--exclude-topic-types", "TYPE", "not topics of these types")
    many("--exclude-services", "SERVICE", "not these services")
    many("--exclude-actions", "ACTION", "not these actions")


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


def add_writing(parser: argparse.ArgumentParser) -> None:
    """How a bag is written."""
    group = parser.add_argument_group("the bag")
    group.add_argument("-s", "--storage", choices=("mcap",), default="mcap", help="bags are written in MCAP")
    group.add_argument(
        "-b", "--max-bag-size", type=int, default=0, metavar="BYTES", help="split files at this size (0: never)"
    )
    group.add_argument(
        "-d",
        "--max-bag-duration",
        type=not_negative,
        default=0.0,
        metavar="S",
        help="split them after S seconds (0: never)",
    )
    group.add_argument(
        "--compression-format", choices=("zstd", "lz4", "none"), help="how each chunk of a file is compressed (zstd)"
    )
    group.add_argument(
        "--compression-mode", choices=("none", "file", "message"), default=None,
        help="none: do not compress; otherwise chunks are compressed, which every reader of MCAP understands",
    )  # fmt: skip
    group.add_argument(
        "--storage-preset-profile", choices=PRESETS, metavar="NAME", help=f"the profiles of ros2: {', '.join(PRESETS)}"
    )
    group.add_argument(
        "--custom-data",
        nargs="*",
        action="extend",
        default=[],
        metavar="KEY=VALUE",
        help="texts to keep in metadata.yaml",
    )


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
