"""What the tests with real processes share: nodes that write down what they do, in a file that all processes append to."""

from __future__ import annotations

import asyncio
import os
import signal
import time
from collections.abc import AsyncGenerator, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

from actors import Child, ExitReason, Node, Skip, Stop, System, run
from actors.logs import LogRecord
from actors.processes.signals import PARENT
from actors.runtime.node import ErrorVerdict
from actors.supervision.declarations import DynamicSupervisor, Supervisor

PATIENCE = 30.0
"""Seconds after which a condition that should become true counts as missed, on a machine however slow."""


class Diary:
    """The file in which all processes of a test write down what they do. Every line is ``event name pid``."""

    def __init__(self, path: Path) -> None:
        self.path = path
        path.touch()

    def lines(self, *events: str) -> list[str]:
        """What was written, in order, as "event name", of these events only, or of all."""
        words = [line.split() for line in self.path.read_text().splitlines()]
        return [f"{event} {name}" for event, name, _ in words if not events or event in events]

    def processes(self, name: str) -> list[int]:
        """The ids of the processes in which the lives of this node began, in order."""
        words = [line.split() for line in self.path.read_text().splitlines()]
        return [int(pid) for event, other, pid in words if event == "start" and other == name]

    def clear(self) -> None:
        self.path.write_text("")


class Scripted(Node):
    """A node that does what its plan says.

    `start`: seconds of its start phase; `refuse`: in how many of its first lives it fails to start; `skip`: it declines to start; `after`:
    seconds until it ends by itself, by raising, or in order with `stops`; `lives`: only in so many first lives; `cleanup`: seconds of its
    `on_stop`; `deaf`: it ignores the signal of its parent, and its `on_stop` never ends.
    """

    def __init__(self, diary: str, plan: dict[str, Any]) -> None:
        super().__init__()
        self.diary = diary
        self.plan = plan

    def write(self, event: str) -> None:
        with open(self.diary, "a") as file:
            file.write(f"{event} {self.name} {os.getpid()}\n")

    async def on_start(self) -> None:
        self.write("start")
        plan = self.plan
        if plan.get("deaf"):
            signal.signal(PARENT, signal.SIG_IGN)
        await asyncio.sleep(plan.get("start", 0.0))
        if plan.get("skip"):
            raise Skip("not today")
        lives = Diary(Path(self.diary)).lines("start").count(f"start {self.name}")
        if lives <= plan.get("refuse", 0):
            raise OSError(f"{self.name} refuses")
        if "after" in plan and lives <= plan.get("lives", 1_000_000):
            self.create_task(self.end(plan["after"]))
        self.write("ready")

    async def end(self, after: float) -> None:
        await asyncio.sleep(after)
        if self.plan.get("stops"):
            raise Stop("its work is done")
        raise OSError(f"{self.name} broke")

    def on_error(self, error: Exception, handler: str) -> ErrorVerdict:
        return "fail"

    async def on_stop(self, reason: ExitReason) -> None:
        self.write("stop")
        if self.plan.get("deaf"):
            time.sleep(1000)  # noqa: ASYNC251  # that it does not listen is its plan
        await asyncio.sleep(self.plan.get("cleanup", 0.0))
        self.write("end")


def in_order(diary: Diary, *names: str, options: dict[str, dict[str, Any]] | None = None, **plans: Any) -> list[Child]:
    """Children with processes of their own, by name, with the plans and the options of those named."""
    return [
        Child(
            Scripted,
            name=name,
            args=(str(diary.path), plans.get(name, {})),
            process=True,
            **(options or {}).get(name, {}),
        )
        for name in names
    ]


async def until(condition: Callable[[], object], what: str = "the condition holds") -> None:
    """Wait for a condition, for as long as `PATIENCE`."""
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end, f"waited {PATIENCE:g} s in vain until {what}"
        await asyncio.sleep(0.01)


def alive(pid: int) -> bool:
    """Whether a process exists and is no zombie."""
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except FileNotFoundError:
        return False
    return state != "Z"


@asynccontextmanager
async def running(tree: Supervisor | DynamicSupervisor, lines: list[LogRecord] | None = None) -> AsyncGenerator[System]:
    """A system that runs the tree; at the end of the block nothing of it is left."""
    system: System | None = None
    pids: set[int] = set()

    def line(record: LogRecord) -> None:
        if lines is not None:
            lines.append(record)
        if "process" in record.fields:
            pids.add(record.fields["process"])

    try:
        async with run(tree, signals=False, sinks=(line,)) as system:
            yield system
    finally:
        if system is not None:
            pids |= {record.process for record in system.nodes.values()} - {0}
        assert [pid for pid in pids if alive(pid)] == []
