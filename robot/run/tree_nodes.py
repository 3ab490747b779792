"""The nodes of a tree, whatever supervisors stand between: all of them, some of them, and changed ones."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

from actors import Child, Supervisor
from actors.suggest import did_you_mean


class UnknownNode(LookupError):
    """A node was asked for that the tree does not have; the text is one line that names the closest ones."""


def nodes_of(tree: Supervisor) -> Iterator[Child]:
    """The nodes of a tree in the order of their start, those of its supervisors included."""
    for child in tree.children:
        if isinstance(child, Supervisor):
            yield from nodes_of(child)
        elif isinstance(child, Child):
            yield child


def changed(tree: Supervisor, change: Callable[[Child], Child | None]) -> Supervisor:
    """The tree with what `change` makes of each of its nodes, without those of which it makes nothing, and without supervisors of none."""
    children: list[Child | Supervisor | None] = []
    for child in tree.children:
        if isinstance(child, Supervisor):
            below = changed(child, change)
            children.append(below if below.children else None)
        elif isinstance(child, Child):
            children.append(change(child))
    return tree.replace(children=[child for child in children if child is not None])


def only(tree: Supervisor, names: Sequence[str]) -> Supervisor:
    """The tree with just these nodes, in its own order, and with the supervisors above them. Raises `UnknownNode`."""
    known = [child.name for child in nodes_of(tree)]
    wanted = {name.lstrip("/") for name in names}
    for name in sorted(wanted.difference(known)):
        near = did_you_mean(name, known, "did", most=3, cutoff=0.5, quoted=False)
        raise UnknownNode(f"there is no node {name!r}; {near or 'there are: ' + ', '.join(known)}")
    return changed(tree, lambda child: child if child.name in wanted else None)


def check_journals(tree: Supervisor, names: Sequence[str]) -> None:
    """Raise `UnknownNode` for a name, or the path of a supervisor such as ``robot/safety``, that the tree does not have."""
    paths = [name for name in names if "/" in name and not name.startswith("/")]
    only(tree, [name for name in names if name not in paths])
    known = [f"{tree.name}/{child.name}" for child in tree.children if isinstance(child, Supervisor)]
    for path in paths:
        if path not in known:
            near = did_you_mean(path, known, "did")
            raise UnknownNode(f"there is no subtree {path!r}; {near or 'there are: ' + ', '.join(known)}")
