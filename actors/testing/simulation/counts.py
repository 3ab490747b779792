"""Whether the books of the supervisors agree with what really runs: tasks, nodes, restarts."""

# pyright: reportPrivateUsage=false
# The books are the supervisors' own; nobody else looks into them.
from __future__ import annotations

import asyncio
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from actors.supervision.child_task import ChildTask
from actors.supervision.running import RunningSupervisor

if TYPE_CHECKING:
    from actors.supervision.entry import Entry
    from actors.system import System

__all__ = ["miscounts"]


def miscounts(system: System) -> Iterator[str]:
    """What does not agree in a quiet system, each in a sentence.

    A child that its supervisor counts as there has a task that runs, and the other way round; a node runs exactly if its supervisor says
    so; it has had more lives than ends; and a supervisor that goes on has not seen more restarts than it allows.
    """
    supervisor = system.supervisor
    if supervisor is None:
        return
    known = {leaked.task for leaked in supervisor.leaked} | set(system.unsupervised.tasks)
    for each in _below(supervisor):
        counts, children = each.counts(), each._entries.values()
        alive = [entry for entry in children if entry.now is not None and not entry.now.task.done()]
        known.update(entry.now.task for entry in alive if entry.now is not None)
        if counts.active > len(alive):
            yield f"supervisor {each.name} counts {counts.active} active children, and {len(alive)} have a task that runs"
        if each._phase == "running" and len(each._window.times) > each.spec.intensity.restarts:
            yield f"supervisor {each.name} goes on after {len(each._window.times)} restarts, and {each.spec.intensity} are allowed"
        for entry in children:
            yield from _miscounted(system, (*each.path, entry.spec.name), entry)
    for task in asyncio.all_tasks(system.loop) - known:
        if getattr(task.get_coro(), "cr_code", None) is ChildTask._live.__code__:
            yield f"{task.get_name()} runs, and no supervisor counts it among its children"


def _below(supervisor: RunningSupervisor) -> Iterator[RunningSupervisor]:
    yield supervisor
    for entry in supervisor._entries.values():
        life: Any = entry.now.life if entry.now is not None else None
        if isinstance(life, RunningSupervisor):
            yield from _below(life)


def _miscounted(system: System, path: tuple[str, ...], entry: Entry) -> Iterator[str]:
    state = system.nodes.get(path)
    if state is None:
        return
    if entry.state == "running" and state.state not in ("running", "stopping"):
        yield f"{'/'.join(path)} runs for its supervisor, and is {state.state} in the system"
    if state.state == "running" and entry.now is None:
        yield f"{'/'.join(path)} is {entry.state} for its supervisor, and runs in the system"
    if state.restart_count > state.incarnation - (state.state == "running"):
        yield f"{'/'.join(path)} has had {state.restart_count} restarts in {state.incarnation} lives"
