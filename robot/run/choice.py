"""Some of the nodes of a tree: what `--only` leaves of it."""

from __future__ import annotations

from collections.abc import Sequence

from actors import Supervisor
from actors.suggest import did_you_mean

__all__ = ["UnknownNode", "only"]


class UnknownNode(LookupError):
    """A node was asked for that the tree does not have; the text is one line that names the closest ones."""


def only(tree: Supervisor, names: Sequence[str]) -> Supervisor:
    """The tree with just these nodes, in its own order. Raises `UnknownNode`."""
    known = [child.name for child in tree.children]
    wanted = {name.lstrip("/") for name in names}
    for name in sorted(wanted.difference(known)):
        near = did_you_mean(name, known, "did", most=3, cutoff=0.5, quoted=False)
        raise UnknownNode(f"there is no node {name!r}; {near or 'there are: ' + ', '.join(known)}")
    return tree.replace(children=[child for child in tree.children if child.name in wanted])
