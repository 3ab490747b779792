"""`bag info` and `bag list`: what a bag holds."""

from __future__ import annotations

import argparse
import json
import time
from collections import Counter
from collections.abc import Iterator, Sequence

from actors.bag import BagReader, BagTopic
from cli.verbs.bag import PLUGINS
from cli.verbs.bag.options import size

COLUMN = 19
"""Where values begin, as in ros2."""

EVENT = "/_service_event"


def info(options: argparse.Namespace) -> int:
    """Print what a bag holds."""
    with BagReader(options.bag_path) as bag:
        topics = _sorted(bag, options.sort)
        if options.json:
            print(json.dumps(_facts(bag)))
        elif options.topic_name and not options.verbose:
            for topic in topics:
                print(topic.name)
        else:
            sizes = _sizes(bag) if options.verbose else None
            print("\n".join(_lines(bag, topics, sizes)))
            if bag.cut:
                print(f"the bag was not closed; `bag recover {bag.path} -o NEW` writes what it holds into a whole one")
    return 0


def list_plugins(options: argparse.Namespace) -> int:
    """Print what bags can be written in."""
    print("\n".join(PLUGINS[options.plugin_type]))
    return 0


def _sorted(bag: BagReader, by: str) -> list[BagTopic]:
    if by == "count":
        return sorted(bag.topics, key=lambda topic: bag.metadata.topics[topic])
    return sorted(bag.topics, key=lambda topic: str(getattr(topic, by)))


def _sizes(bag: BagReader) -> Counter[str]:
    sizes: Counter[str] = Counter()
    for message in bag.messages():
        sizes[message.topic.name] += len(message.data)
    return sizes


def _lines(bag: BagReader, topics: Sequence[BagTopic], sizes: Counter[str] | None) -> Iterator[str]:
    told = bag.metadata
    services = [topic for topic in topics if topic.name.endswith(EVENT)]
    others = [topic for topic in topics if not topic.name.endswith(EVENT)]
    events = sum(told.topics[topic] for topic in services)
    yield ""
    yield from _listed("Files:", [file.path for file in told.files], COLUMN)
    yield f"{'Bag size:':<{COLUMN}}{size(bag.size)}"
    yield f"{'Storage id:':<{COLUMN}}{told.storage}"
    yield f"{'ROS Distro:':<{COLUMN}}{told.ros_distro or 'unknown'}"
    yield f"{'Duration:':<{COLUMN}}{_seconds(told.duration_ns)}s"
    yield f"{'Start:':<{COLUMN}}{_instant(told.start_ns)}"
    yield f"{'End:':<{COLUMN}}{_instant(told.end_ns)}"
    yield f"{'Messages:':<{COLUMN}}{told.message_count - events}"
    lines = [_line("Topic", "Count", topic.name, topic.type, topic, bag, sizes) for topic in others]
    yield from _listed("Topic information:", lines, COLUMN)
    yield f"{'Service:':<{COLUMN}}{len(services)}"
    lines = [
        _line("Service", "Event Count", one.name.removesuffix(EVENT), one.type.removesuffix("_Event"), one, bag, sizes)
        for one in services
    ]
    yield from _listed("Service information:", lines, COLUMN + 2)


def _listed(label: str, values: Sequence[str], column: int) -> Iterator[str]:
    first, *others = values or [""]
    yield f"{label:<{column}}{first}".rstrip() if not first else f"{label:<{column}}{first}"
    for other in others:
        yield " " * column + other


def _line(
    kind: str, counted: str, name: str, type: str, topic: BagTopic, bag: BagReader, sizes: Counter[str] | None
) -> str:
    share = "" if sizes is None else f"Size Contribution: {size(sizes[topic.name])} | "
    count = bag.metadata.topics[topic]
    return f"{kind}: {name} | Type: {type} | {counted}: {count} | {share}Serialization Format: {topic.serialization_format}"


def _seconds(nanoseconds: int) -> str:
    whole, part = divmod(nanoseconds, 1_000_000_000)
    return f"{whole}.{part:09d}"


def _instant(nanoseconds: int) -> str:
    at = time.localtime(nanoseconds // 1_000_000_000)
    part = nanoseconds % 1_000_000_000
    return f"{time.strftime('%b %e %Y %H:%M:%S', at)}.{part:09d} ({_seconds(nanoseconds)})"


def _facts(bag: BagReader) -> dict[str, object]:
    told = bag.metadata
    return {
        "path": str(bag.path),
        "files": [file.path for file in told.files],
        "bytes": bag.size,
        "storage": told.storage,
        "ros_distro": told.ros_distro,
        "start_ns": told.start_ns,
        "duration_ns": told.duration_ns,
        "messages": told.message_count,
        "complete": not bag.cut,
        "custom_data": dict(told.custom_data),
        "topics": [
            {"name": topic.name, "type": topic.type, "count": count, "type_hash": topic.type_hash}
            for topic, count in told.topics.items()
        ],
    }
