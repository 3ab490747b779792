"""The executables that a launch has started, and what events say about them."""

from __future__ import annotations

from dataclasses import dataclass, field
from io import StringIO
from typing import Any

from actors.launch.errors import ProcessDied
from actors.launch.plan import Item, Job, Process, Scope
from actors.logs import LogRecord, ros_console_sink

SHOWN = ("screen", "both", "full")
"""The values of `output` with which what a process writes to stdout is shown. What it writes to stderr is always shown."""


@dataclass(eq=False)
class Running:
    """An executable that has been started: its job, its supervisor's path, and what is known of its present life."""

    job: Job
    path: tuple[str, ...]
    pid: int = 0
    returncode: int = 0
    """The exit code of the last process that has ended."""
    exit_told: bool = False
    """Whether handlers have been told that its present life has ended."""
    failures: list[BaseException] = field(default_factory=list[BaseException])

    def started(self, pid: int) -> None:
        """A process has been started."""
        self.pid, self.returncode = pid, 0
        self.job.action.process_details = self.details()

    def finished(self, returncode: int) -> None:
        """The process has ended."""
        self.returncode = returncode

    @property
    def code(self) -> int:
        """The exit code of its present life, as far as it has ended; 1 for a node that has failed."""
        if not self.failures or isinstance(self.failures[-1], ProcessDied):
            return self.returncode
        return 1

    def details(self) -> dict[str, object]:
        """What its action tells in `process_details`."""
        return {name: value for name, value in self.about().items() if name != "action"}

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


def console_line(record: LogRecord) -> bytes:
    """A line of the log as a node of ROS 2 writes it to its console."""
    stream = StringIO()
    ros_console_sink(stream, {})(record)
    return stream.getvalue().encode()


def shows_stdout(process: Process) -> bool:
    """Whether what a process writes to stdout is shown."""
    everything = process.environment.get("OVERRIDE_LAUNCH_PROCESS_OUTPUT", "")
    return process.output in SHOWN or everything in SHOWN
