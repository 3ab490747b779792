"""What `topic list` prints."""

from __future__ import annotations

import argparse
from collections.abc import Iterable

from actors.names.names import is_hidden
from actors.typing import TopicView
from cli.graph import seen

__all__ = ["list_topics", "listing"]


async def list_topics(options: argparse.Namespace) -> int:
    async with seen(options) as graph:
        topics = graph.system.snapshot().topics
        own = graph.node.fqn
    shown = [topic for topic in topics if options.include_hidden_topics or not is_hidden(topic.name)]
    if options.count_topics:
        print(len(shown))
    else:
        for line in listing(shown, own, types=options.show_types, verbose=options.verbose):
            print(line)
    return 0


def listing(topics: Iterable[TopicView], own: str, *, types: bool = False, verbose: bool = False) -> Iterable[str]:
    """The lines of the list. Endpoints of the node `own`, which looks, are not counted."""
    if not verbose:
        yield from (f"{topic.name} {_types(topic)}" if types else topic.name for topic in topics)
        return
    topics = tuple(topics)
    for title, noun in (("Published", "publisher"), ("Subscribed", "subscriber")):
        yield f"{title} topics:"
        for topic in topics:
            ends = topic.publishers if noun == "publisher" else topic.subscriptions
            number = sum(1 for end in ends if end.node != own)
            if number:
                yield f" * {topic.name} {_types(topic)} {number} {noun}{'' if number == 1 else 's'}"
        yield ""


def _types(topic: TopicView) -> str:
    return f"[{', '.join(topic.types)}]"
