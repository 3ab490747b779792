"""`topic echo`: what is sent on a topic, and how the subscription fits itself to the publishers."""

from __future__ import annotations

import argparse
import asyncio
import re
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from actors import QoS, Topic
from actors.interfaces import Message
from actors.names.names import is_hidden
from actors.suggest import did_you_mean
from cli.command import CommandFailed, Exit
from cli.graph.seen import Seen, seen
from cli.graph.types import message_type
from cli.graph.view import absolute, look
from cli.output import clear_screen, print_json
from cli.parsing import complain
from cli.quality import fitting_qos, objections
from cli.text import Style, message_csv, message_json, plain, yaml_of

if TYPE_CHECKING:
    from actors.graph.graph import TopicEntry

_ITEM = re.compile(r"\[(-?\d+)\]")


async def echo(options: argparse.Namespace) -> Exit:
    """Print messages until Ctrl-C, or until the options say so."""
    if options.topic_name is None:
        async with look(options) as view:
            raise CommandFailed(f"which topic? there are: {', '.join(view.topics(hidden=False)) or 'none'}")
    if options.raw:
        from cli.verbs.topic.raw import echo_raw

        return await echo_raw(options)
    wanted = chosen_filter(options.filter)
    async with seen(options, options.node_name) as graph:
        topic = await topic_of(graph, options)
        lost = 0
        async with graph.node.subscribe(topic) as messages:
            while True:
                try:
                    async with asyncio.timeout(options.timeout):
                        message = await anext(messages)
                except TimeoutError:
                    raise CommandFailed(f"no message on {topic.name} for {options.timeout:g} s") from None
                if messages.dropped > lost and not (options.no_lost_messages or options.json or options.csv):
                    print(f"A message was lost!!!\n\ttotal count change:{messages.dropped - lost}", end="")
                    print(f"\n\ttotal count: {messages.dropped}---")
                    lost = messages.dropped
                values = [field_of(message, path) for path in options.field or ()] or [message]
                values = [value for value in values if wanted(value)]
                if values:
                    _print(values, options, messages.received)
                    if options.once:
                        return Exit.DONE


async def topic_of(graph: Seen, options: argparse.Namespace) -> Topic[Any]:
    """The topic that is asked for, with its type and a quality of service that fits. Tells if nobody publishes it."""
    name = absolute(options.topic_name)
    wanted = getattr(options, "message_type", None)
    if wanted is None and not await graph.late(lambda: bool(_uses(graph, name)), options.spin_time):
        complain(f"WARNING: topic [{name}] does not appear to be published yet{did_you_mean(name, _published(graph))}")
        raise CommandFailed("Could not determine the type for the passed topic: give it after the topic")
    kind = await message_type(graph, wanted, lambda: _uses(graph, name), name)
    entry = graph.system.graph.topics.get(name)
    publishers = [] if entry is None else entry.publishers
    quality = fitting_qos([publisher.qos for publisher in publishers], options)
    if not publishers:
        complain(f"nobody publishes {name} now{did_you_mean(name, _published(graph))}; waiting")
    _complain_of_quality(name, entry, quality, options)
    return Topic(kind, name, quality)


def _uses(graph: Seen, name: str) -> list[tuple[str, Any]]:
    """The nodes that publish a topic or subscribe to it, each with its type."""
    entry = graph.system.graph.topics.get(name)
    return [] if entry is None else [(end.node.fqn, end.type) for end in (*entry.publishers, *entry.subscriptions)]


def _complain_of_quality(name: str, entry: TopicEntry | None, wanted: QoS, options: argparse.Namespace) -> None:
    offered = [] if entry is None else [(each.node.fqn, each.qos) for each in entry.publishers]
    for line in objections(offered, wanted):
        complain(f"{name}: {line}")
    if len({offer.reliable for _, offer in offered}) > 1 and options.qos_reliability is None:
        complain(f"{name}: not all publishers are reliable, so best effort is used, which all of them offer")
    if len({offer.transient_local for _, offer in offered}) > 1 and options.qos_durability is None:
        complain(f"{name}: not all publishers are transient local, so volatile is used, which all of them offer")


def _published(graph: Seen) -> list[str]:
    return [name for name, entry in graph.system.graph.topics.items() if entry.publishers and not is_hidden(name)]


def chosen_filter(expression: str | None) -> Callable[[Any], bool]:
    """The messages that are wanted, by a Python expression of `m`. Raises `CommandFailed` if it is none, or fails for a message."""
    if expression is None:
        return lambda message: True
    try:
        code = compile(expression, "<filter>", "eval")
    except SyntaxError as error:
        raise CommandFailed(f"--filter {expression!r} is no expression of Python: {error.msg}") from None

    def wanted(message: Any) -> bool:
        try:
            return bool(eval(code, {"m": message}))
        except Exception as error:
            raise CommandFailed(f"--filter {expression!r}: {type(error).__name__}: {error}") from None

    return wanted


def field_of(message: Any, path: str) -> Any:
    """The value at a path like ``pose.position.x``, ``poses[0].x`` or ``name.[-1]``. Raises `CommandFailed` if there is none."""
    parts = [part for part in path.replace("[", ".[").split(".") if part]
    if not parts:
        raise CommandFailed(f"Invalid field value '{path}'")
    value = message
    for part in parts:
        value = _part_of(value, part, path)
    return value


def _part_of(value: Any, part: str, path: str) -> Any:
    if item := _ITEM.fullmatch(part):
        items: Any = value if hasattr(value, "__len__") and not isinstance(value, str) else ()
        if -len(items) <= int(item[1]) < len(items):
            found = items[int(item[1])]
            return found.item() if hasattr(found, "item") else found
        raise CommandFailed(f"Invalid field '{path}': there is no item {item[1]}; it has {len(items)}")
    fields = [field.name for field in value.__ros_fields__] if isinstance(value, Message) else []
    if part not in fields:
        known = f"it has {', '.join(fields)}" if fields else "it has no fields"
        raise CommandFailed(f"Invalid field '{path}': there is no {part!r}; {known}{did_you_mean(part, fields)}")
    return getattr(value, part)


def style_of(options: argparse.Namespace) -> Style:
    """How much of a message the options ask for."""
    return Style(None if options.full_length else options.truncate_length, options.no_arr, options.no_str)


def _print(values: list[Any], options: argparse.Namespace, number: int) -> None:
    if options.json:
        found = [message_json(value) for value in values]
        print_json(found[0] if len(found) == 1 else found)
        return
    info = {"received_timestamp": time.time_ns(), "reception_sequence_number": number}
    if options.clear:
        clear_screen()
    if options.csv:
        ahead = "".join(f"{each}," for each in info.values()) if options.include_message_info else ""
        for value in values:
            print(ahead + message_csv(value, style_of(options)))
        return
    if options.include_message_info:
        print(yaml_of(info), end="---\n")
    style = style_of(options)
    for value in values:
        if isinstance(value, Message):
            print(yaml_of(plain(value, *style), options.flow_style), end="")
        else:
            print(plain(value, *style))
    print("---")
