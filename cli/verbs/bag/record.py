"""`bag record`: record topics, services and actions of the graph."""

from __future__ import annotations

import argparse
import asyncio
import sys
from contextlib import suppress
from datetime import datetime
from functools import partial
from pathlib import Path

from actors import Child, temporary
from actors.bag import BagError, Recorder, RecordOptions
from actors.errors import described
from actors.logs import WARN, LogRecord
from actors.replay.publishing import topic_of
from actors.suggest import did_you_mean
from cli.command import CommandFailed
from cli.graph.seen import seen
from cli.graph.view import absolute
from cli.verbs.bag.journal import keep_journal
from cli.verbs.bag.options import profiles, selection_of, size, writing_of
from cli.verbs.bag.progress import progress, progress_over


async def record(options: argparse.Namespace) -> int:
    """Record until Ctrl-C, which is the usual end; the exit code is then 0, as with ros2."""
    options.topics += options.positional
    if None in options.replay and not options.subtree:
        raise CommandFailed("--replay: say of which node, or of which nodes with --subtree PATH")
    options.replay = [*(absolute(node) for node in options.replay if node is not None), *options.subtree]
    options.topics += [topic_of(name) for name in options.replay]
    told = _told(options)
    path: Path = options.output or Path(datetime.now().strftime("rosbag2_%Y_%m_%d-%H_%M_%S"))
    if path.exists():  # noqa: ASYNC240  # nothing waits yet
        raise CommandFailed(f"Output folder '{path}' already exists.")
    return await _record(options, path, told)


def _told(options: argparse.Namespace) -> RecordOptions:
    """The options of the recorder. Raises `CommandFailed`."""
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
        graph.system.observe(lines=partial(_show_others, absolute(options.node_name)))
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
        with suppress(TimeoutError, asyncio.CancelledError):  # a signal is the usual end
            async with asyncio.timeout(options.duration):
                await _watched(recorder)
        await recorder.finish()
        progress_over()
        published = [name for name, entry in graph.system.graph.topics.items() if entry.publishers]
    if recorder.failure is not None:
        raise BagError(f"{path}: {recorder.failure.strerror or recorder.failure}; {_summary(recorder)}")
    if joined.error is not None:
        raise BagError(f"{path}: the recorder has failed: {described(joined.error)}; {_summary(recorder)}")
    print(f"{path}: {_summary(recorder)}", file=sys.stderr)
    if not recorder.recorded:
        for name in sorted({absolute(topic) for topic in options.topics or ()}.difference(published)):
            print(f"nobody published {name}{did_you_mean(name, published)}", file=sys.stderr)
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


def _show_others(recorder: str, record: LogRecord) -> None:
    """Show a line, unless it is of the end of the recorder: that is told as the error of the command."""
    if record.fields.get("node_name") != recorder:
        show(record)


def show(record: LogRecord) -> None:
    if record.level >= WARN:
        words = " ".join(f"{name}={value}" for name, value in record.fields.items())
        print(f"{record.event} {words}", file=sys.stderr, flush=True)
