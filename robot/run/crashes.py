"""Nodes that fail because the words of a run ask for it: whether they are there, and how it is done to them."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import TYPE_CHECKING

from cli.command import UsageError
from robot.run.tasks import Crash, Hang

if TYPE_CHECKING:
    from actors import Child, Supervisor, System


def check_crashes(tree: Supervisor, crashes: Sequence[Crash | Hang], option: str = "--crash") -> None:
    """Refuse to let fail what is not there. Raises `UsageError`."""
    from robot.run.tree_nodes import UnknownNode, only

    for crash in crashes:
        try:
            only(tree, [crash.node])
        except UnknownNode as error:
            raise UsageError(f"{option} {crash.node}@{crash.at:g}: {error}") from None


def with_hangs(tree: Supervisor, hangs: Sequence[Hang]) -> Supervisor:
    """The tree of a run that begins now, in which the processes of these nodes hang. Raises `UsageError` for one on another machine."""
    from actors import Supervisor
    from robot.nodes import process_care
    from robot.run.tree_nodes import changed, nodes_of

    now = time.monotonic()
    concerns = {
        node.name: concern.name for concern in tree.children for node in nodes_of(tree.replace(children=[concern]))
    }
    away = {concern.name for concern in tree.children if isinstance(concern, Supervisor) and concern.hosts}
    for hang in hangs:
        if concerns[hang.node.lstrip("/")] in away:
            raise UsageError(f"--hang {hang.node}: its process is on another machine")

    def change(child: Child) -> Child:
        if child.factory is not process_care.ProcessCare:
            return child
        mine = [one for one in hangs if concerns[one.node.lstrip("/")] == child.args[0]]
        return child.replace(args=(*child.args, *(process_care.Hang(one.node, now + one.at) for one in mine)))

    return changed(tree, change)


def crash(system: System, name: str) -> None:
    """Make a node fail as if one of its handlers had raised."""
    from actors.errors import NotStarted

    try:
        system.crash(name, RuntimeError("crashed on request (--crash)"))
    except (LookupError, NotStarted):
        system.log.error("there is no such node to crash", asked=name)
