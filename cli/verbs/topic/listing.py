"""What `topic list | info` print."""

from __future__ import annotations

import argparse

from cli.command import Exit
from cli.graph.view import PUBLISHER, SUBSCRIPTION, GraphView, look
from cli.output import print_json
from cli.parsing import count
from cli.verbs.endpoints import show
from cli.verbs.naming import print_names
from cli.verbs.topic import KIND


async def list_topics(options: argparse.Namespace) -> Exit:
    """The names of the topics, with types or with the number of their ends."""
    async with look(options) as view:
        topics = view.topics(options.hidden)
    if options.verbose and not options.counted:
        _print_verbose(options, view, topics)
    else:
        print_names(topics, options, types=options.show_types)
    return Exit.DONE


def _print_verbose(options: argparse.Namespace, view: GraphView, topics: dict[str, list[str]]) -> None:
    numbers = {name: [len(view.endpoints(kind, name=name)) for kind in (PUBLISHER, SUBSCRIPTION)] for name in topics}
    if options.json:
        print_json(
            [
                {"name": name, "types": types, "publishers": numbers[name][0], "subscribers": numbers[name][1]}
                for name, types in topics.items()
            ]
        )
        return
    for index, (title, noun) in enumerate((("Published", "publisher"), ("Subscribed", "subscriber"))):
        print(f"{title} topics:")
        for name, types in topics.items():
            if number := numbers[name][index]:
                print(f" * {name} [{', '.join(types)}] {count(number, noun)}")
        print()


async def info(options: argparse.Namespace) -> Exit:
    """A topic's types and the number of its ends, or all that is known of each."""
    ends = {"Publisher": PUBLISHER, "Subscription": SUBSCRIPTION}
    return await show(options, KIND, ends, gap="\n" if options.verbose else "")
