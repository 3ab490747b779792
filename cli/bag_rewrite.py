"""`bag convert | filter | merge | reindex | recover`: bags from bags."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from actors.bag import BagMetadata, BagReader, Selection, WriterOptions, recover, reindex, rewrite
from actors.yaml_bounds import check_yaml
from cli.bag import progress, progress_over
from cli.bag_options import add_selection, add_writing, not_negative, selection_of, with_types, writing_of
from cli.command import CommandFailed
from cli.parsing import add_interfaces, parsed

__all__ = ["run"]


def run(verb: str, argv: Sequence[str]) -> int:
    """Run the verb; the exit code."""
    return VERBS[verb](argv)


def _convert(argv: Sequence[str]) -> int:
    parser = _parser("convert", "Write bags anew; with -O as ros2 bag convert, by a YAML file.")
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
    options = with_types(parser, argv)
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
        load: Any = yaml.safe_load  # its stubs do not type it
        text = path.read_text(encoding="utf-8")
        check_yaml(text)
        listed: Any = load(text)["output_bags"]
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


def _filter(argv: Sequence[str]) -> int:
    parser = _parser("filter", "Write some of a bag.")
    parser.add_argument("bag_path", type=Path, help="the folder of a bag, or one of its files")
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="BAG", help="the folder to make")
    add_selection(parser, "keep", everything=True)
    group = parser.add_argument_group("when")
    group.add_argument(
        "--start-offset", type=not_negative, default=0.0, metavar="S", help="begin S seconds into the bag"
    )
    group.add_argument("--duration", type=not_negative, metavar="S", help="keep S seconds from there")
    add_writing(parser)
    options = with_types(parser, argv)
    with BagReader(options.bag_path) as bag:
        start_ns = bag.metadata.start_ns + round(options.start_offset * 1e9)
    metadata = _rewritten(
        [options.bag_path],
        options.output,
        selection=selection_of(options),
        start_ns=start_ns,
        end_ns=None if options.duration is None else start_ns + round(options.duration * 1e9),
        options=writing_of(options),
    )
    return _told(options.output, metadata)


def _merge(argv: Sequence[str]) -> int:
    parser = _parser("merge", "Write several bags into one, in order of time.")
    parser.add_argument("bags", nargs="+", type=Path, metavar="BAG", help="the bags")
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="BAG", help="the folder to make")
    add_writing(parser)
    options = with_types(parser, argv)
    return _told(options.output, _rewritten(options.bags, options.output, options=writing_of(options)))


def _reindex(argv: Sequence[str]) -> int:
    parser = _parser("reindex", "Write metadata.yaml of a bag anew, from its files.")
    parser.add_argument("bag_path", type=Path, help="the folder of the bag")
    parser.add_argument("-s", "--storage", choices=("mcap", "sqlite3"), help="accepted for ros2's sake: it is seen")
    add_interfaces(parser)
    options = parsed(parser, argv)
    return _told(options.bag_path, reindex(options.bag_path))


def _recover(argv: Sequence[str]) -> int:
    parser = _parser("recover", "Write all that can be read of a bag that was cut or damaged into a new one.")
    parser.add_argument("bag_path", type=Path, help="the folder of the bag, or one of its files")
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="BAG", help="the folder to make")
    add_writing(parser)
    options = with_types(parser, argv)
    found = recover(options.bag_path, options.output, options=writing_of(options))
    if found.damaged or found.lost_bytes:
        print(
            f"not readable: {found.damaged} damaged chunks or records, and {found.lost_bytes} bytes at the end",
            file=sys.stderr,
        )
    return _told(options.output, found.metadata)


def _parser(verb: str, text: str) -> argparse.ArgumentParser:
    return argparse.ArgumentParser(prog=f"python -m robot bag {verb}", description=text)


def _rewritten(sources: Sequence[Path], target: Path, **told: Any) -> BagMetadata:
    try:
        return rewrite(sources, target, progress=lambda count: progress(f"{count} messages"), **told)
    finally:
        progress_over()


def _told(path: Path, metadata: BagMetadata) -> int:
    print(f"{path}: {metadata.message_count} messages of {len(metadata.topics)} topics in {len(metadata.files)} files")
    return 0


VERBS: dict[str, Callable[[Sequence[str]], int]] = {
    "convert": _convert,
    "filter": _filter,
    "merge": _merge,
    "reindex": _reindex,
    "recover": _recover,
}
