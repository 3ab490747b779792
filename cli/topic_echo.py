"""What `topic echo` prints, and how it fits itself to the publishers."""

from __future__ import annotations

import argparse
import asyncio
import sys
from collections.abc import Sequence
from typing import Any

from actors import QoS, Topic, qos
from actors.graph.graph import TopicEntry
from actors.interfaces import Message, UnknownInterface, get_message
from actors.interfaces.foreign import difference
from actors.names.names import is_hidden
from actors.suggest import did_you_mean
from actors.topics.peers import PublisherPeer
from cli.command import CommandFailed
from cli.graph import Seen, seen
from cli.text import message_yaml, plain

__all__ = ["echo", "field_of", "fitting_qos"]


async def echo(options: argparse.Namespace) -> int:
    """Print messages until Ctrl-C, or until the options say so."""
    name = options.topic if options.topic.startswith("/") else f"/{options.topic}"
    async with seen(options) as graph:
        entry = graph.system.graph.topics.get(name)
        publishers = [] if entry is None else entry.publishers
        kind = _message_type(options, name, graph, entry)
        if not publishers:
            hint = did_you_mean(name, _published(graph))
            print(f"nobody publishes {name} now{hint}; waiting", file=sys.stderr)
        wanted = fitting_qos(publishers, options)
        truncate = None if options.full_length else options.truncate_length
        async with graph.node.subscribe(Topic(kind, name, wanted)) as messages:
            while True:
                try:
                    async with asyncio.timeout(options.timeout):
                        message = await anext(messages)
                except TimeoutError:
                    raise CommandFailed(f"no message on {name} for {options.timeout:g} s") from None
                print(_text(message, options, truncate), flush=True)
                if options.once:
                    return 0


def _message_type(options: argparse.Namespace, name: str, graph: Seen, entry: TopicEntry | None) -> type[Message]:
    """The type that was asked for, or that of the topic's endpoints."""
    ends = [] if entry is None else [*entry.publishers, *entry.subscriptions]
    wanted = options.type or next((end.type.__ros_type__ for end in ends), None)
    if wanted is None:
        hint = did_you_mean(name, _published(graph))
        raise CommandFailed(
            f"nobody publishes {name}, so its type is not known{hint}; or give the type after the topic"
        )
    try:
        kind = get_message(wanted)
    except UnknownInterface as error:
        raise CommandFailed(f"{name}: {error}") from error
    unlike = next((told for end in ends if (told := difference(end.type, kind)) is not None), None)
    if unlike is not None:
        print(f"{name} is sent as {unlike[0]}, and asked for as {unlike[1]}: that cannot be read", file=sys.stderr)
    return kind


def _published(graph: Seen) -> list[str]:
    return [name for name, entry in graph.system.graph.topics.items() if entry.publishers and not is_hidden(name)]


def fitting_qos(publishers: Sequence[PublisherPeer], options: argparse.Namespace) -> QoS:
    """Sensor data's quality of service; reliable or transient local if all publishers are. What the options say counts more."""
    fitting: dict[str, Any] = {}
    if publishers and all(publisher.qos.reliable for publisher in publishers):
        fitting["reliability"] = "reliable"
    if publishers and all(publisher.qos.transient_local for publisher in publishers):
        fitting["durability"] = "transient_local"
    told = {
        "reliability": options.qos_reliability,
        "durability": options.qos_durability,
        "depth": options.qos_depth,
    }
    fitting.update({name: value for name, value in told.items() if value is not None})
    return qos.SENSOR_DATA.replace(**fitting)


def _text(message: Message, options: argparse.Namespace, truncate: int | None) -> str:
    if options.field is None:
        return message_yaml(message, truncate, options.flow_style) + "---"
    value = field_of(message, options.field)
    if isinstance(value, Message):
        return message_yaml(value, truncate, options.flow_style) + "---"
    return f"{plain(value, truncate)}\n---"


def field_of(message: Message, path: str) -> Any:
    """The value at a path like ``pose.position.x``. Raises `CommandFailed` if there is none."""
    value: Any = message
    for part in path.split("."):
        fields = [field.name for field in value.__ros_fields__] if isinstance(value, Message) else []
        if part not in fields:
            known = f"it has {', '.join(fields)}" if fields else "it has no fields"
            raise CommandFailed(f"Invalid field {path!r}: there is no {part!r}; {known}{did_you_mean(part, fields)}")
        value = getattr(value, part)
    return value
