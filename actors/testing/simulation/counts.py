"""The check that what supervisors record agrees with what is running: tasks, nodes and restarts."""

from __future__ import annotations

import asyncio
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING

from actors.supervision.child_task import ChildTask

if TYPE_CHECKING:
    from actors.runtime.record import NodeRecord
    from actors.supervision.peers import ChildStatus
    from actors.system import System


def miscounts(system: System, beside: Iterable[System] = ()) -> Iterator[str]:
    """Yield a sentence for each contradiction in the counts of a system in which nothing can run without time passing.

    A child has a running task exactly if its supervisor counts it as present. A node has an incarnation only while its supervisor has a
    task for it, and has had more incarnations than restarts. A supervisor that goes on has not counted more restarts than it allows.
    `beside` are other systems on the same event loop, whose tasks are known, too.
    """
    if system.supervisor is None:
        return
    tree = system.runtime.tree
    leaked = {one.ref.path for each in tree.supervisors() for one in each.leaked}
    for each in tree.supervisors():
        children = each.statuses()
        active = each.counts().active
        alive = _running(children.values())
        if active > len(alive):
            yield f"supervisor {each.name} counts {active} active children, and {len(alive)} have a task that runs"
        if each.phase == "running" and each.recent_restarts > each.spec.intensity.restarts:
            yield f"supervisor {each.name} goes on after {each.recent_restarts} restarts, and {each.spec.intensity} are allowed"
        for name, status in children.items():
            record = system.nodes.get((*each.path, name))
            if record is not None:
                yield from _miscounted(record, status, record.path in leaked)
    known = set[object]().union(*(_known(one) for one in (system, *beside)))
    for task in asyncio.all_tasks(system.loop) - known:
        if ChildTask.runs_in(task):
            yield f"{task.get_name()} runs, and no supervisor counts it among its children"


def _known(system: System) -> set[object]:
    """The tasks that the supervisors of a system count."""
    known: set[object] = set()
    for each in system.runtime.tree.supervisors():
        known |= {one.task for one in each.leaked} | _running(each.statuses().values())
    return known


def _running(children: Iterable[ChildStatus]) -> set[object]:
    return {status.task for status in children if status.task is not None and not status.task.done()}


def _miscounted(record: NodeRecord, status: ChildStatus, leaked: bool) -> Iterator[str]:
    where = "/".join(record.path)
    if record.life is not None and status.task is None and not leaked:
        yield f"{where} is {status.state} for its supervisor, and an incarnation of it has not ended"
    if record.restart_count > record.incarnation - (status.state == "running"):
        yield f"{where} has had {record.restart_count} restarts in {record.incarnation} lives"
