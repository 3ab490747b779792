"""`bag convert | filter | merge | reindex | recover`: bags from bags."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from actors.bag import BagMetadata, BagReader, Selection, WriterOptions, recover, reindex, rewrite
from actors.yaml_bounds import load_yaml
from cli.command import CommandFailed
from cli.graph.types import learn_folders
from cli.verbs.bag.options import complain_of_absent, selection_of, writing_of
from cli.verbs.bag.progress import progress, progress_over


def convert(options: argparse.Namespace) -> int:
    """Rewrite bags."""
    learn_folders(options)
    sources = [one[0] for one in options.input]
    if options.output is not None:
        return _told(options.output, _rewritten(sources, options.output, options=writing_of(options)))
    for path, selection, writing in _outputs(options.output_options):
        _told(path, _rewritten(sources, path, selection=selection, options=writing))
    return 0


def _outputs(path: Path) -> list[tuple[Path, Selection, WriterOptions]]:
    """The bags of an options file of ros2. Raises `CommandFailed`."""
    import yaml

    try:
        listed: Any = load_yaml(path.read_text(encoding="utf-8"))["output_bags"]
        return [_output(one) for one in listed]
    except (yaml.YAMLError, KeyError, TypeError, ValueError) as error:
        raise CommandFailed(f"{path}: it has no list output_bags as ros2 bag convert takes it ({error})") from error


def _output(told: dict[str, Any]) -> tuple[Path, Selection, WriterOptions]:
    storage = told.get("storage_id") or "mcap"
    if storage != "mcap":
        raise CommandFailed(f"{told['uri']}: bags are written in mcap, not in {storage}")
    named = told.get("topics") or told.get("services") or told.get("regex")
    everything = bool(told.get("all")) or not (named or told.get("all_topics") or told.get("all_services"))
    selection = Selection(
        topics=told.get("topics") or (),
        services=told.get("services") or (),
        types=told.get("topic_types") or (),
        regex=told.get("regex") or "",
        all_topics=everything or bool(told.get("all_topics")),
        all_services=everything or bool(told.get("all_services")),
        all_actions=everything,
        hidden=everything or bool(told.get("include_hidden_topics")),
        exclude_regex=told.get("exclude_regex") or "",
        exclude_topics=told.get("exclude_topics") or (),
    )
    preset = told.get("storage_preset_profile") or ""
    plain = preset in ("none", "fastwrite") or told.get("compression_mode") == "none"
    writing = WriterOptions(
        compression="none" if plain else told.get("compression_format") or "zstd",
        max_bytes=told.get("max_bagfile_size") or 0,
        max_seconds=told.get("max_bagfile_duration") or 0.0,
    )
    return Path(told["uri"]), selection, writing


def filter_bag(options: argparse.Namespace) -> int:
    """Write some of a bag."""
    learn_folders(options)
    selection = selection_of(options)
    with BagReader(options.bag_path) as bag:
        complain_of_absent(selection, bag)
        start_ns = bag.metadata.start_ns + round(options.start_offset * 1e9)
    metadata = _rewritten(
        [options.bag_path],
        options.output,
        selection=selection,
        start_ns=start_ns,
        end_ns=None if options.duration is None else start_ns + round(options.duration * 1e9),
        options=writing_of(options),
    )
    return _told(options.output, metadata)


def merge(options: argparse.Namespace) -> int:
    """Write several bags into one, in order of time."""
    learn_folders(options)
    return _told(options.output, _rewritten(options.bags, options.output, options=writing_of(options)))


def reindex_bag(options: argparse.Namespace) -> int:
    """Rewrite metadata.yaml of a bag."""
    return _told(options.bag_path, reindex(options.bag_path))


def recover_bag(options: argparse.Namespace) -> int:
    """Write all that can be read of a bag into a new one."""
    learn_folders(options)
    found = recover(options.bag_path, options.output, options=writing_of(options))
    if found.damaged or found.lost_bytes:
        print(
            f"not readable: {found.damaged} damaged chunks or records, and {found.lost_bytes} bytes at the end",
            file=sys.stderr,
        )
    return _told(options.output, found.metadata)


def _rewritten(sources: Sequence[Path], target: Path, **told: Any) -> BagMetadata:
    try:
        return rewrite(sources, target, progress=lambda count: progress(f"{count} messages"), **told)
    finally:
        progress_over()


def _told(path: Path, metadata: BagMetadata) -> int:
    print(f"{path}: {metadata.message_count} messages of {len(metadata.topics)} topics in {len(metadata.files)} files")
    return 0
