"""`topic pub`: messages on a topic, once, so many times, or until Ctrl-C."""

from __future__ import annotations

import argparse
import asyncio
import itertools
import time
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from actors import Topic, qos
from actors.interfaces.builtin_interfaces.msg import Time
from cli.command import CommandFailed, Exit
from cli.graph.seen import seen
from cli.graph.types import message_type
from cli.graph.view import absolute
from cli.output import print_json
from cli.quality import stated_qos
from cli.text import message_json, message_repr
from cli.values import Values, read_documents, read_stdin, read_values

if TYPE_CHECKING:
    from actors.typing import Publisher

LOOK = 0.1
"""Seconds between two looks for subscriptions."""


async def pub(options: argparse.Namespace) -> Exit:
    """Publish the messages that the options describe."""
    times = 1 if options.once else options.times
    awaited = options.wait_matching_subscriptions
    if awaited is None:
        awaited = 1 if times else 0
    if not awaited and options.max_wait_time_secs is not None:
        raise CommandFailed(
            "--max-wait-time-secs option is only effective with --wait-matching-subscriptions, --once or --times"
        )
    name = absolute(options.topic_name)
    async with seen(options, options.node_name) as graph:
        entry = graph.system.graph.topics.get(name)
        ends = [] if entry is None else [*entry.subscriptions, *entry.publishers]
        kind = await message_type(graph, options.message_type, lambda: [(end.node.fqn, end.type) for end in ends], name)
        messages = _messages(options, kind)
        publisher = graph.node.publisher(Topic(kind, name, stated_qos(options, qos.DEFAULT)))
        await _subscriptions(publisher, awaited, options)
        if not options.json:
            print("publisher: beginning loop")
        await _publish(publisher, itertools.islice(messages, times or None), options)
        await asyncio.sleep(options.keep_alive)
    return Exit.DONE


def now() -> Time:
    """The time of day."""
    seconds, nanoseconds = divmod(time.time_ns(), 10**9)
    return Time(sec=seconds, nanosec=nanoseconds)


def _messages(options: argparse.Namespace, kind: Any) -> Iterator[Values[Any]]:
    """What is to be published, in order. All of it has been checked before the first is."""
    if options.yaml_file is not None:
        return iter(list(read_documents(options.yaml_file, kind)))
    return itertools.repeat(read_values(read_stdin() if options.stdin else options.values, kind))


async def _subscriptions(publisher: Publisher[Any], wanted: int, options: argparse.Namespace) -> None:
    """Wait until so many subscriptions match, and say so every second."""
    limit, waited, said = options.max_wait_time_secs, 0.0, 0.0
    while publisher.subscription_count < wanted:
        if waited >= said and not options.json:
            print(f"Waiting for at least {wanted} matching subscription(s)...")
            said += 1.0
        if limit is not None and waited >= limit:
            raise CommandFailed(
                f"Timed out waiting for subscribers: Expected {wanted} subscribers but only got "
                f"{publisher.subscription_count} subscribers"
            )
        await asyncio.sleep(LOOK)
        waited += LOOK


async def _publish(publisher: Publisher[Any], messages: Iterator[Values[Any]], options: argparse.Namespace) -> None:
    """Publish them at the rate that is asked for, the first one at once."""
    loop = asyncio.get_running_loop()
    start = loop.time()
    for number, values in enumerate(messages, start=1):
        due = start + (number - 1) / options.rate
        if due > loop.time():
            await asyncio.sleep(due - loop.time())
        message = values.message(now())
        if options.json:
            print_json(message_json(message))
        elif options.print and number % options.print == 0:
            print(f"publishing #{number}: {message_repr(message)}\n")
        await publisher.send(message)
        await asyncio.sleep(0)
