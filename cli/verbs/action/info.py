"""What `action info` prints."""

from __future__ import annotations

import argparse

from cli.command import Exit
from cli.graph.view import absolute, look
from cli.output import print_json


async def info(options: argparse.Namespace) -> Exit:
    """The clients and servers of one action."""
    name = absolute(options.action_name)
    async with look(options, lambda view: any(view.action_nodes(name))) as view:
        clients, servers = view.action_nodes(name)
    ends = {
        word: [(end.node, end.about.type.removesuffix("_FeedbackMessage")) for end in found]
        for word, found in (("clients", clients), ("servers", servers))
    }
    if options.json:
        listed = {word: [{"node": node, "type": kind} for node, kind in found] for word, found in ends.items()}
        print_json({"name": name, **listed})
        return Exit.DONE
    print(f"Action: {name}")
    for word, found in ends.items():
        print(f"Action {word}: {len(found)}")
        for node, kind in () if options.count else found:
            print(f"    {node} [{kind}]" if options.show_types else f"    {node}")
    return Exit.DONE
