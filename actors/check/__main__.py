"""The command ``python -m actors.check MODULE:TREE``: it checks a tree before it runs.

It prints the findings of `check_tree`, each with its remedy. The exit code is 0 without findings, 1 with findings, and 2 if there is no
such tree.
"""

from __future__ import annotations

import argparse
import asyncio
import sys
from collections.abc import Sequence

from actors.check.checker import check_tree
from actors.errors import DeclarationError
from actors.running.target import Unusable, find, grown
from actors.supervision.child import Child
from actors.supervision.declarations import DynamicSupervisor, Supervisor


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command and return its exit code."""
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
    """Load the tree of this name. Anything but a tree is put under a supervisor, as `Rig.start` does."""
    grown_trees = asyncio.run(grown(find(name)))
    if len(grown_trees) == 1 and isinstance(grown_trees[0], Supervisor | DynamicSupervisor):
        return grown_trees[0]
    return Supervisor("system", children=[Child(one) if isinstance(one, type) else one for one in grown_trees])


if __name__ == "__main__":
    sys.exit(main())
