"""`bag record`: record topics, services and actions of the graph."""

from __future__ import annotations

import argparse
import asyncio
import math
import sys
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path

from actors import Child, temporary
from actors.bag import BagError, Recorder, RecordOptions
from actors.errors import described
from actors.logs import WARN, LogRecord
from actors.replay.publishing import topic_of
from cli.bag import progress, progress_over
from cli.bag_journal import keep_journal, subtree
from cli.bag_options import add_selection, add_writing, not_negative, positive, profiles, selection_of, size, writing_of
from cli.bag_signals import until_signal
from cli.command import CommandFailed
from cli.graph import add_graph_options, seen
from cli.parsing import add_interfaces, parsed
from cli.view import absolute

__all__ = ["run", "show"]


def run(verb: str, argv: Sequence[str]) -> int:
    """Record until Ctrl-C, which is the usual end; the exit code is then 0, as with ros2."""
    options = parsed(_parser(), argv)
    options.topics += options.positional
    if None in options.replay and not options.subtree:
        raise CommandFailed("--replay: say of which node, or of which nodes with --subtree PATH")
    options.replay = [*(absolute(node) for node in options.replay if node is not None), *options.subtree]
    options.topics += [topic_of(name) for name in options.replay]
    told = _told(options)
    path: Path = options.output or Path(datetime.now().strftime("rosbag2_%Y_%m_%d-%H_%M_%S"))
    if path.exists():
        raise CommandFailed(f"Output folder '{path}' already exists.")
    return asyncio.run(_record(options, path, told))


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m robot bag record", description="Record topics, services and actions until Ctrl-C."
    )
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
        type=subtree,
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
        "--snapshot-duration", type=positive, default=math.inf, metavar="S", help="keep those of the last S seconds"
    )
    group.add_argument("--duration", type=not_negative, metavar="S", help="end after S seconds")
    group.add_argument("-p", "--polling-interval", help="accepted for ros2's sake: what appears is seen at once")
    group.add_argument("--disable-keyboard-controls", action="store_true", help="accepted for ros2's sake")
    add_interfaces(parser)
    add_graph_options(parser)
    return parser


def _told(options: argparse.Namespace) -> RecordOptions:
    """What the recorder is told. Raises `CommandFailed`."""
    chosen = (
        "all",
        "all_topics",
        "all_services",
        "all_actions",
        "topics",
        "services",
        "actions",
        "topic_types",
        "regex",
    )
    if not any(getattr(options, name) for name in chosen):
        raise CommandFailed(
            "Need to specify at least one option out of --all, --all-topics, --all-services, --all-actions, --services, "
            "--actions, --topics, --topic-types or --regex"
        )
    try:
        return RecordOptions(
            selection=selection_of(options),
            writer=writing_of(options),
            qos=profiles(options.qos_profile_overrides_path),
            max_cache_bytes=options.max_cache_size,
            snapshot=options.snapshot_mode,
            snapshot_seconds=options.snapshot_duration,
            paused=options.start_paused,
            discovery=not options.no_discovery,
            unpublished=options.include_unpublished_topics,
            leaf_topics=not options.ignore_leaf_topics,
        )
    except ValueError as error:
        raise CommandFailed(str(error)) from error


async def _record(options: argparse.Namespace, path: Path, told: RecordOptions) -> int:
    async with seen(options) as graph:
        for node in options.replay:
            await keep_journal(graph, node, options)
        graph.system.observe(lines=show)
        child = Child(
            Recorder,
            name=options.node_name,
            args=(path, told),
            parameters={"use_sim_time": True} if options.use_sim_time else {},
            restart=temporary,
        )
        joined = await graph.system.join(child)
        recorder = graph.system.node(Recorder)
        print(f"Recording into {path}; Ctrl-C ends it", file=sys.stderr, flush=True)
        await until_signal(_watched(recorder), options.duration)
        await recorder.finish()
        progress_over()
    if recorder.failure is not None:
        raise BagError(f"{path}: {recorder.failure.strerror or recorder.failure}; {_summary(recorder)}")
    if joined.error is not None:
        raise BagError(f"{path}: the recorder has failed: {described(joined.error)}; {_summary(recorder)}")
    print(f"{path}: {_summary(recorder)}", file=sys.stderr)
    return 0


async def _watched(recorder: Recorder) -> None:
    while True:
        try:
            async with asyncio.timeout(1.0):
                return await recorder.wait()
        except TimeoutError:
            progress(_summary(recorder))


def _summary(recorder: Recorder) -> str:
    return f"{recorder.recorded} messages recorded, {recorder.dropped} lost, {size(recorder.size)}"


def show(record: LogRecord) -> None:
    if record.level >= WARN:
        words = " ".join(f"{name}={value}" for name, value in record.fields.items())
        print(f"{record.event} {words}", file=sys.stderr, flush=True)
