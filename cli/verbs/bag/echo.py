"""`bag echo`: print the messages of a bag."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable
from typing import Any

from actors.bag import BagError, BagReader, BagTopic, type_of
from actors.bag.schemas import decoder_of
from actors.interfaces import Message
from actors.interfaces.errors import CdrError
from cli.graph.types import learn_folders
from cli.parsing import TRUNCATED
from cli.text import message_yaml, plain
from cli.verbs.bag.options import complain_of_absent, selection_of
from cli.verbs.topic.echo import field_of


def echo(options: argparse.Namespace) -> int:
    """Print the messages of a bag; the exit code is 1 if one, or a whole topic, cannot be decoded."""
    learn_folders(options)
    options.topics += options.positional
    with BagReader(options.bag_path) as bag:
        return _echo(bag, options)


def _echo(bag: BagReader, options: argparse.Namespace) -> int:
    selection = selection_of(options)
    complain_of_absent(selection, bag)
    names = {topic.name for topic in bag.topics if selection.takes(topic.name, topic.type)}
    decoders: dict[BagTopic, Callable[[bytes], Message] | None] = {}
    start = bag.metadata.start_ns + round(options.start_offset * 1e9)
    failed = 0
    number = 0
    for one in bag.messages(names, start_ns=start):
        if one.topic not in decoders:
            decoders[one.topic] = _decoder(one.topic)
        decode = decoders[one.topic]
        if decode is None:
            failed += 1
            continue
        if number == options.num_messages:
            break
        number += 1
        try:
            message = decode(one.data)
        except CdrError as error:
            failed += 1
            print(f"{one.topic.name} at {one.received_ns}: {error}", file=sys.stderr)
            continue
        value: Any = message if options.field is None else field_of(message, options.field)
        if options.json:
            head = {"topic": one.topic.name, "type": one.topic.type, "received_ns": one.received_ns}
            head |= {"published_ns": one.published_ns}
            print(json.dumps({**head, "message": plain(value)}))
        else:
            if len(names) > 1:
                print(f"# {one.topic.name} at {one.received_ns / 1e9:.9f}")
            print(_text(value, None if options.full_length else TRUNCATED) + "---")
    return 1 if failed else 0


def _decoder(topic: BagTopic) -> Callable[[bytes], Message] | None:
    """What decodes the messages of a topic; None, and a line that says why, if its messages cannot be decoded."""
    try:
        return decoder_of(topic, type_of(topic))
    except BagError as error:
        print(f"left out: {error}", file=sys.stderr)
        return None


def _text(value: Any, truncate: int | None) -> str:
    return message_yaml(value, truncate) if isinstance(value, Message) else f"{plain(value, truncate)}\n"
