"""``python -m actors.check MODULE:TREE``: what is wrong with a tree, or will surprise, before it runs.

Prints what `check_tree` finds, each finding with its remedy. Exit code 0: nothing found; 1: something; 2: there is no such tree.
"""

from __future__ import annotations

import argparse
import asyncio
import sys
from collections.abc import Sequence

from actors.check.checker import check_tree
from actors.errors import DeclarationError
from actors.running.target import Unusable, find, grown
from actors.supervision.declarations import Child, DynamicSupervisor, Supervisor

__all__ = ["main"]


def main(arguments: Sequence[str] | None = None) -> int:
    """The command; returns its exit code."""
    parser = argparse.ArgumentParser(
        prog="python -m actors.check", description=(__doc__ or "").partition("\n\n")[2].strip()
    )
    parser.add_argument(
        "tree",
        metavar="MODULE:TREE",
        help="a Supervisor, a Child, a node class, or a function that makes one; several nodes make a list",
    )
    parser.add_argument(
        "--external",
        metavar="NAME",
        action="append",
        default=[],
        help="the full name of a topic, service or action that comes from elsewhere; may be given again",
    )
    parser.add_argument("--errors", action="store_true", help="only what will not work, no warnings")
    options = parser.parse_args(arguments)
    try:
        tree = _tree(options.tree)
    except (Unusable, DeclarationError) as problem:
        print(f"{parser.prog}: {problem}", file=sys.stderr)
        return 2
    found = [one for one in check_tree(tree, external=options.external) if one.level == "error" or not options.errors]
    for finding in found:
        print(finding)
    print(f"{len(found) or 'no'} finding{'' if len(found) == 1 else 's'} in {options.tree}")
    return 1 if found else 0


def _tree(name: str) -> Supervisor | DynamicSupervisor:
    """The tree of this name; what is none yet is put under a supervisor, as a `Rig` does."""
    grown_trees = asyncio.run(grown(find(name)))
    if len(grown_trees) == 1 and isinstance(grown_trees[0], Supervisor | DynamicSupervisor):
        return grown_trees[0]
    return Supervisor("system", children=[Child(one) if isinstance(one, type) else one for one in grown_trees])


if __name__ == "__main__":
    sys.exit(main())
