"""What the tests of `decide` share: books and ends of lives, made by hand, without an event loop."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

from actors.supervision.child_task import ChildTask
from actors.supervision.children import Children, Phase
from actors.supervision.declarations import DynamicSupervisor, Supervisor
from actors.supervision.events import Ended
from actors.supervision.reasons import ExitReason
from actors.supervision.refs import ChildRef


def life(name: str, *, ready: bool = True, **facts: Any) -> ChildTask:
    """The facts of one life, with no task behind it."""
    plain = {"over": False, "declined": False, "asked": None, "imposed": None, "killed": None}
    return cast("ChildTask", SimpleNamespace(ref=ChildRef(("top", name), 1), ready=ready, **plain | facts))


def books(spec: Supervisor | DynamicSupervisor, *, phase: Phase = "running", instances: int = 0) -> Children:
    """The books of a supervisor all of whose children run."""
    children = Children(spec, ("top",))
    children.phase = phase
    if isinstance(spec, DynamicSupervisor):
        for number in range(1, instances + 1):
            children.add(spec.instance(f"{spec.template.name}_{number}"))
    for entry in children:
        entry.now, entry.number = life(entry.spec.name), 1
    return children


def end(children: Children, name: str, reason: ExitReason, *, at: float = 0.0, **facts: Any) -> Ended:
    """The end of a child's life, which is in the books no more."""
    children[name].now = None
    return Ended(life(name, **facts), reason, at)
