"""The executables that a launch has started, and what events say about them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from actors.launch.plan import Item, Job, Scope
from actors.launch.program import ProcessDied

__all__ = ["Running", "exit_code", "flattened"]


@dataclass(eq=False)
class Running:
    """An executable that has been started: its job, its supervisor's path, and what is known of its present life."""

    job: Job
    path: tuple[str, ...]
    pid: int = 0
    failures: list[BaseException] = field(default_factory=list[BaseException])

    def about(self) -> dict[str, Any]:
        """What events say about it."""
        process = self.job.process
        return {
            "action": self.job.action,
            "name": self.job.label,
            "cmd": list(process.cmd) if process is not None else [],
            "cwd": process.cwd if process is not None else None,
            "env": dict(process.environment) if process is not None else {},
            "pid": self.pid,
        }


def flattened(item: Item) -> list[Item]:
    """The items of scopes that were found late: they have no supervisor of their own."""
    if isinstance(item, Scope):
        return [one for inner in item.items for one in flattened(inner)]
    return [item]


def exit_code(errors: list[BaseException]) -> int:
    """The exit code that stands for the end of a node."""
    if not errors:
        return 0
    return errors[0].returncode if isinstance(errors[0], ProcessDied) else 1
