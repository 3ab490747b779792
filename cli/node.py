"""`node list`: the nodes of the graph."""

from __future__ import annotations

import argparse
import asyncio
from collections import Counter
from collections.abc import Sequence

from actors.names.names import is_hidden
from cli.graph import add_graph_options, seen

__all__ = ["main"]


def main(argv: Sequence[str]) -> int:
    """Run one verb of the group; the exit code."""
    parser = argparse.ArgumentParser(prog="python -m robot node", description="The nodes of the graph.")
    verbs = parser.add_subparsers(dest="verb", required=True, metavar="VERB")
    listing = verbs.add_parser("list", help="their full names, one a line")
    listing.add_argument("-a", "--all", action="store_true", help="also hidden ones, whose names begin with _")
    listing.add_argument("-c", "--count-nodes", action="store_true", help="only how many")
    add_graph_options(listing)
    return asyncio.run(_list(parser.parse_args(argv)))


async def _list(options: argparse.Namespace) -> int:
    async with seen(options) as graph:
        names = [node.name for node in graph.system.snapshot().nodes]
    names = sorted(name for name in names if options.all or not is_hidden(name))
    if options.count_nodes:
        print(len(names))
        return 0
    for name in names:
        print(name)
    if any(number > 1 for number in Counter(names).values()):
        import sys

        print("WARNING: some nodes of the graph share a name: what one is told, may reach the other", file=sys.stderr)
    return 0
