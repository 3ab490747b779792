"""`bag VERB`: recordings, in the format and with the flags of `ros2 bag`."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import Any, Final

from cli.parsing import Parser, add_graph_options, add_interfaces, nonnegative_float, positive_float
from cli.verb import Group, Verb

PRESETS = {"none": "none", "fastwrite": "none", "zstd_fast": "zstd", "zstd_small": "zstd"}
"""The storage profiles of ros2, each with the compression of its chunks."""

PLUGINS: Final = {
    "storage": ("mcap", "sqlite3 (read only)"),
    "converter": ("cdr",),
    "compressor": ("zstd", "lz4"),
    "decompressor": ("zstd", "lz4"),
}
"""What `bag list` lists."""


def add_selection(parser: Parser, verb: str, *, everything: bool) -> None:
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


def add_writing(parser: Parser) -> None:
    """How a bag is written."""
    group = parser.add_argument_group("the bag")
    group.add_argument("-s", "--storage", choices=("mcap",), default="mcap", help="bags are written in MCAP")
    group.add_argument(
        "-b", "--max-bag-size", type=int, default=0, metavar="BYTES", help="split files at this size (0: never)"
    )
    group.add_argument(
        "-d",
        "--max-bag-duration",
        type=nonnegative_float,
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


def _subtree(text: str) -> str:
    from actors.replay.recording import is_subtree

    path = text.strip("/")
    if not is_subtree(path):
        raise argparse.ArgumentTypeError(
            f"{text!r} is no path of a supervisor below the root, such as robot/navigation"
        )
    return path


def _record(parser: Parser) -> None:
    parser.add_argument("positional", nargs="*", metavar="TOPIC", help="the same as --topics")
    parser.add_argument("-o", "--output", type=Path, help="the folder to make (rosbag2_YYYY_mm_dd-HH_MM_SS)")
    add_selection(parser, "record", everything=False)
    add_writing(parser)
    group = parser.add_argument_group("recording")
    group.add_argument(
        "--replay",
        action="append",
        nargs="?",
        default=[],
        metavar="NODE",
        help="also the journal of NODE, for `bag replay`, from its start on if its program keeps one, else with --restart",
    )
    group.add_argument(
        "--subtree",
        action="append",
        default=[],
        type=_subtree,
        metavar="PATH",
        help="the journal of all nodes below this supervisor together, such as robot/navigation: of what crosses their border",
    )
    group.add_argument(
        "--restart", action="store_true", help="have these nodes restarted, so that their journals begin there"
    )
    group.add_argument(
        "--start-paused", action="store_true", help="record nothing until the service ~/resume is called"
    )
    group.add_argument("--use-sim-time", action="store_true", help="times are those of /clock")
    group.add_argument("--node-name", default="rosbag2_recorder", metavar="NAME")
    group.add_argument("--no-discovery", action="store_true", help="only what there is at the start")
    group.add_argument("--include-unpublished-topics", action="store_true", help="also topics without publishers")
    group.add_argument("--ignore-leaf-topics", action="store_true", help="not topics without subscribers")
    group.add_argument(
        "--qos-profile-overrides-path", type=Path, metavar="FILE", help="what to request, by topic, in YAML"
    )
    group.add_argument(
        "--max-cache-size", type=int, default=100 * 1024 * 1024, metavar="BYTES", help="how much may wait to be written"
    )
    group.add_argument("--snapshot-mode", action="store_true", help="keep the newest messages; ~/snapshot writes them")
    group.add_argument(
        "--snapshot-duration",
        type=positive_float,
        default=math.inf,
        metavar="S",
        help="keep those of the last S seconds",
    )
    group.add_argument("--duration", type=nonnegative_float, metavar="S", help="end after S seconds")
    group.add_argument("-p", "--polling-interval", help="accepted for ros2's sake: what appears is seen at once")
    group.add_argument("--disable-keyboard-controls", action="store_true", help="accepted for ros2's sake")
    add_interfaces(parser)
    add_graph_options(parser)


def _play(parser: Parser) -> None:
    _add_play(parser, _playing(parser))
    add_graph_options(parser)


def _burst(parser: Parser) -> None:
    _playing(parser).add_argument("-n", "--num-messages", type=int, default=0, metavar="N", help="how many; 0: all")
    add_graph_options(parser)


def _or_none(text: str) -> float:
    """A finite number; a negative one, as ros2 has it, stands for no limit."""
    return -1.0 if text.startswith("-") and nonnegative_float(text[1:]) else nonnegative_float(text)


def _playing(parser: Parser) -> Any:
    parser.add_argument("bag_path", type=Path, help="the folder of a bag, or one of its files")
    parser.add_argument("-s", "--storage", choices=("mcap", "sqlite3"), help="accepted for ros2's sake: it is seen")
    add_selection(parser, "play", everything=True)
    group = parser.add_argument_group("playing")
    group.add_argument(
        "--start-offset", type=nonnegative_float, default=0.0, metavar="S", help="begin S seconds into the bag"
    )
    group.add_argument("-m", "--remap", nargs="+", default=[], metavar="RULE", help="OLD:=NEW: play under another name")
    group.add_argument(
        "--qos-profile-overrides-path", type=Path, metavar="FILE", help="what to offer, by topic, in YAML"
    )
    group.add_argument(
        "--read-ahead-queue-size", type=int, default=1000, metavar="N", help="messages read at once (1000)"
    )
    group.add_argument("--disable-keyboard-controls", action="store_true", help="do not listen to keys")
    add_interfaces(parser)
    return group


def _add_play(parser: Parser, group: Any) -> None:
    group.add_argument("-r", "--rate", type=positive_float, default=1.0, help="how much faster than recorded (1.0)")
    group.add_argument("-l", "--loop", action="store_true", help="start again at the end")
    group.add_argument(
        "-d",
        "--delay",
        type=nonnegative_float,
        default=0.0,
        metavar="S",
        help="wait S seconds before playing, and /clock with it",
    )
    group.add_argument("-p", "--start-paused", action="store_true", help="begin paused")
    group.add_argument(
        "--playback-duration", type=_or_none, default=-1.0, metavar="S", help="play S seconds of the bag"
    )
    until = parser.add_mutually_exclusive_group()
    until.add_argument("--playback-until-sec", type=_or_none, default=-1.0, metavar="S", help="play until this time")
    until.add_argument("--playback-until-nsec", type=int, default=-1, metavar="NS", help="the same in nanoseconds")
    clock = parser.add_mutually_exclusive_group()
    clock.add_argument(
        "--clock",
        type=positive_float,
        nargs="?",
        const=40.0,
        default=0.0,
        metavar="HZ",
        help="publish /clock, at HZ (40)",
    )
    clock.add_argument(
        "--clock-topics", nargs="+", default=[], metavar="TOPIC", help="publish it before messages of these"
    )
    clock.add_argument("--clock-topics-all", action="store_true", help="publish it before every message")
    group.add_argument(
        "--wait-for-all-acked",
        type=nonnegative_float,
        metavar="MS",
        help="accepted for ros2's sake: all is sent before the end",
    )
    group.add_argument(
        "--publish-service-requests",
        action="store_true",
        help="send requests and goals, instead of the events of services",
    )
    group.add_argument(
        "--service-requests-source", choices=("service_introspection", "client_introspection"),
        default="service_introspection", metavar="SOURCE",
        help="whose record of them: service_introspection (that of the server), or client_introspection",
    )  # fmt: skip
    group.add_argument("--disable-loan-message", action="store_true", help="accepted for ros2's sake")


def _replay(parser: Parser) -> None:
    parser.add_argument("path", type=Path, metavar="FILE", help="a bag with a journal, or the file of a journal")
    parser.add_argument(
        "--node",
        metavar="NODE",
        help="which node, by its name; needed with a bag. With --subtree: the node that --set and --with change",
    )
    parser.add_argument(
        "--subtree", type=_subtree, metavar="PATH", help="the nodes of this subtree together, such as robot/navigation"
    )
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="PARAM=VALUE",
        help="start the node with this value, and go on behind differences",
    )
    parser.add_argument(
        "--with",
        dest="node_class",
        metavar="MODULE:NODE",
        help="play to this class instead, and go on behind differences",
    )
    parser.add_argument(
        "--break", dest="pause", metavar="TOPIC[N]", help="stop in a debugger where message N (from 0) is sent on TOPIC"
    )
    parser.add_argument(
        "--trust",
        action="store_true",
        help="let the journal call code of classes that it names; see docs/howto/replay.md",
    )
    parser.add_argument("--all", action="store_true", help="go on behind the first difference")
    parser.add_argument("--cost", action="store_true", help="only print what the journal holds and costs")
    parser.add_argument("--json", action="store_true", help="as JSON")
    add_interfaces(parser)


def _info(parser: Parser) -> None:
    parser.add_argument("bag_path", type=Path, help="the folder of a bag, or one of its files")
    parser.add_argument("-s", "--storage", choices=("mcap", "sqlite3"), help="accepted for ros2's sake: it is seen")
    parser.add_argument("-t", "--topic-name", action="store_true", help="only the names of the topics")
    parser.add_argument("-v", "--verbose", action="store_true", help="also how much each topic contributes to the size")
    parser.add_argument("--sort", choices=("name", "type", "count"), default="name", help="the order of the topics")
    parser.add_argument("--json", action="store_true", help="as JSON")
    add_interfaces(parser)


def _list(parser: Parser) -> None:
    parser.add_argument("plugin_type", choices=PLUGINS)
    parser.add_argument("-v", "--verbose", action="store_true", help="accepted for ros2's sake")


def _echo(parser: Parser) -> None:
    parser.add_argument("bag_path", type=Path, help="the folder of a bag, or one of its files")
    parser.add_argument("positional", nargs="*", metavar="TOPIC", help="the same as --topics")
    add_selection(parser, "print", everything=True)
    group = parser.add_argument_group("output")
    group.add_argument("--json", action="store_true", help="an object a line: topic, times, message")
    group.add_argument("--field", metavar="A.B", help="only this field of each message")
    group.add_argument("-f", "--full-length", action="store_true", help="long arrays and texts whole")
    group.add_argument("-n", "--num-messages", type=int, metavar="N", help="end after N messages")
    group.add_argument(
        "--start-offset", type=nonnegative_float, default=0.0, metavar="S", help="begin S seconds into the bag"
    )
    add_interfaces(parser)


def _convert(parser: Parser) -> None:
    parser.add_argument(
        "-i",
        "--input",
        required=True,
        action="append",
        nargs="+",
        metavar="BAG",
        help="a bag (and its storage, which is seen)",
    )
    target = parser.add_mutually_exclusive_group(required=True)
    target.add_argument("-o", "--output-options", type=Path, metavar="FILE", help="YAML with output_bags, as for ros2")
    target.add_argument("--output", type=Path, metavar="BAG", help="the folder to make")
    add_writing(parser)
    add_interfaces(parser)


def _filter(parser: Parser) -> None:
    parser.add_argument("bag_path", type=Path, help="the folder of a bag, or one of its files")
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="BAG", help="the folder to make")
    add_selection(parser, "keep", everything=True)
    group = parser.add_argument_group("when")
    group.add_argument(
        "--start-offset", type=nonnegative_float, default=0.0, metavar="S", help="begin S seconds into the bag"
    )
    group.add_argument("--duration", type=nonnegative_float, metavar="S", help="keep S seconds from there")
    add_writing(parser)
    add_interfaces(parser)


def _merge(parser: Parser) -> None:
    parser.add_argument("bags", nargs="+", type=Path, metavar="BAG", help="the bags")
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="BAG", help="the folder to make")
    add_writing(parser)
    add_interfaces(parser)


def _reindex(parser: Parser) -> None:
    parser.add_argument("bag_path", type=Path, help="the folder of the bag")
    parser.add_argument("-s", "--storage", choices=("mcap", "sqlite3"), help="accepted for ros2's sake: it is seen")
    add_interfaces(parser)


def _recover(parser: Parser) -> None:
    parser.add_argument("bag_path", type=Path, help="the folder of the bag, or one of its files")
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="BAG", help="the folder to make")
    add_writing(parser)
    add_interfaces(parser)


REPLAY = """\
Play the journal of one node to that node alone, on virtual time, and compare what it sends with the recording; or that of a subtree to its
nodes together, and compare what they send to others."""

COMMAND = Group(
    "bag",
    "Recordings, as those of ros2 bag.",
    Verb(
        "record",
        "record topics, services and actions",
        _record,
        "cli.verbs.bag.record:record",
        description="Record topics, services and actions until Ctrl-C.",
    ),
    Verb(
        "play", "publish what was recorded", _play, "cli.verbs.bag.play:play", description="Publish what was recorded."
    ),
    Verb(
        "burst",
        "publish some messages at once, then wait",
        _burst,
        "cli.verbs.bag.play:play",
        description="Publish what was recorded.",
    ),
    Verb(
        "replay",
        "play the journal of one node to that node alone",
        _replay,
        "cli.verbs.bag.replay:run",
        description=REPLAY,
    ),
    Verb("info", "what a bag holds", _info, "cli.verbs.bag.info:info", description="What a bag holds."),
    Verb(
        "echo",
        "print the messages of a bag, as YAML or JSON",
        _echo,
        "cli.verbs.bag.echo:echo",
        description="Print the messages of a bag.",
    ),
    Verb(
        "convert",
        "rewrite a bag with other settings",
        _convert,
        "cli.verbs.bag.rewrite:convert",
        description="Rewrite bags; with -O as ros2 bag convert, by a YAML file.",
    ),
    Verb(
        "filter",
        "write some of a bag: by topic, by time",
        _filter,
        "cli.verbs.bag.rewrite:filter_bag",
        description="Write some of a bag.",
    ),
    Verb(
        "merge",
        "write several bags into one",
        _merge,
        "cli.verbs.bag.rewrite:merge",
        description="Write several bags into one, in order of time.",
    ),
    Verb(
        "reindex",
        "rewrite metadata.yaml",
        _reindex,
        "cli.verbs.bag.rewrite:reindex_bag",
        description="Rewrite metadata.yaml of a bag from its files.",
    ),
    Verb(
        "recover",
        "write what can be read of a bag that was cut",
        _recover,
        "cli.verbs.bag.rewrite:recover_bag",
        description="Write all that can be read of a bag that was cut or damaged into a new one.",
    ),
    Verb(
        "list",
        "the storages and compressions there are",
        _list,
        "cli.verbs.bag.info:list_plugins",
        description="What bags can be written in.",
    ),
)
