"""`python -m tests.tools.journal_cost`: what it costs to keep journals of the robot's nodes.

The robot (kinematic body, virtual time) walks to its charging station, once without journals and once with those of the named nodes and subtrees. Printed are
the processor time that the journals took for each second of the robot, the longest time for which the event loop waited while entries were made
bytes and written, and for each journal its entries and bytes a second. Processor times are those of the machine on which it runs.
"""

from __future__ import annotations

import argparse
import asyncio
import time
from collections.abc import Callable, Sequence
from typing import Any

from actors import Child, Node, Supervisor, execute, run
from actors.interfaces.std_srvs.srv import Trigger
from actors.replay import Journal
from actors.replay.parts import Spool, pack
from robot.assembly import Robot
from robot.contracts import DOCK, STAND
from robot.interfaces.robactor_msgs.action import Dock

JOURNALS = ("navigation", "gait", "battery", "safety_monitor", "robot_controller", "localizer")


class Operator(Node):
    """Has the robot stand up and walk."""

    async def walk(self) -> None:
        await self.call(STAND, Trigger.Request())
        await self.clock.sleep(2.5)
        async with self.send_goal(DOCK, Dock.Goal()) as goal:
            await goal.ended()


class Pauses:
    """How long the event loop waited for spools, seconds: measured by standing in for their methods."""

    def __init__(self) -> None:
        self.longest = self.total = 0.0

    def measure(self, method: Callable[[Spool], int]) -> Callable[[Spool], int]:
        def measured(spool: Spool) -> int:
            begun = time.thread_time()
            count = method(spool)
            took = time.thread_time() - begun
            self.longest, self.total = max(self.longest, took), self.total + took
            return count

        return measured


async def walk(journal: Journal | None, seconds: float) -> float:
    """Walk; the processor time that it took, seconds."""
    begun = time.process_time()
    observers = () if journal is None else (journal,)
    tree = Supervisor("system", children=[Robot("kitchen", body="kinematic").tree, Child(Operator)])
    async with run(tree, observers=observers, sinks=()) as system:
        await system.clock.sleep(1.0)
        walking = asyncio.ensure_future(system.node(Operator).walk())
        await system.clock.sleep(seconds)
        walking.cancel()
    return time.process_time() - begun


def main(argv: Sequence[str] | None = None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.tools.journal_cost", description="What journals of the robot's nodes cost."
    )
    parser.add_argument(
        "journals", nargs="*", default=JOURNALS, metavar="NODE", help="nodes, or paths such as system/robot/navigation"
    )
    parser.add_argument("--seconds", type=float, default=20.0, metavar="S", help="of virtual time")
    options = parser.parse_args(argv)
    walked: Any = execute(lambda: walk(None, options.seconds), clock="virtual")
    pauses = Pauses()
    spool: Any = Spool
    settle, flush = Spool.settle, Spool.flush
    spool.settle, spool.flush = pauses.measure(settle), pauses.measure(flush)
    journal = Journal(*options.journals)
    try:
        kept: Any = execute(lambda: walk(journal, options.seconds), clock="virtual")
    finally:
        spool.settle, spool.flush = settle, flush
    print(f"{options.seconds:g} s of the robot took {walked:.2f} s of a core, with journals {kept:.2f} s")
    took, written = (seconds / options.seconds * 1e3 for seconds in (kept - walked, pauses.total))
    print(f"the journals took {took:.1f} ms of a core a second, {written:.1f} ms of it to make them bytes")
    print(f"the event loop waited for that for at most {pauses.longest * 1e3:.2f} ms at once")
    print(f"{'journal':<28} {'entries/s':>10} {'kB/s':>8}")
    for name in options.journals:
        entries = journal.recording(name).entries
        size = len(pack(0, entries))
        print(f"{name:<28} {len(entries) / options.seconds:10.0f} {size / options.seconds / 1e3:8.1f}")


if __name__ == "__main__":
    main()
