"""Whether the books of the supervisors agree with what really runs: tasks, nodes, restarts."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from typing import TYPE_CHECKING

from actors.supervision.child_task import is_child_task

if TYPE_CHECKING:
    from actors.supervision.seam import ChildStatus
    from actors.system import System

__all__ = ["miscounts"]


def miscounts(system: System) -> Iterator[str]:
    """The contradictions in the counts of a quiet system, each in a sentence.

    A child that its supervisor counts as there has a task that runs, and the other way round; a node runs exactly if its supervisor says
    so; it has had more lives than ends; and a supervisor that goes on has not seen more restarts than it allows.
    """
    supervisor = system.supervisor
    if supervisor is None:
        return
    known = {leaked.task for leaked in supervisor.leaked} | set(system.unsupervised.tasks)
    for each in supervisor.below():
        children = each.statuses()
        active = each.counts().active
        alive = {status.task for status in children.values() if status.task is not None and not status.task.done()}
        known |= alive
        if active > len(alive):
            yield f"supervisor {each.name} counts {active} active children, and {len(alive)} have a task that runs"
        if each.phase == "running" and each.recent_restarts > each.spec.intensity.restarts:
            yield f"supervisor {each.name} goes on after {each.recent_restarts} restarts, and {each.spec.intensity} are allowed"
        for name, status in children.items():
            yield from _miscounted(system, (*each.path, name), status)
    for task in asyncio.all_tasks(system.loop) - known:
        if is_child_task(task):
            yield f"{task.get_name()} runs, and no supervisor counts it among its children"


def _miscounted(system: System, path: tuple[str, ...], entry: ChildStatus) -> Iterator[str]:
    state = system.nodes.get(path)
    if state is None:
        return
    if entry.state == "running" and state.state not in ("running", "stopping"):
        yield f"{'/'.join(path)} runs for its supervisor, and is {state.state} in the system"
    if state.state == "running" and entry.task is None:
        yield f"{'/'.join(path)} is {entry.state} for its supervisor, and runs in the system"
    if state.restart_count > state.incarnation - (state.state == "running"):
        yield f"{'/'.join(path)} has had {state.restart_count} restarts in {state.incarnation} lives"
