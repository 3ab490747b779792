"""Sweeping a map cell by cell: a long job that tells its progress in percent and can be canceled.

Its action type is declared here, in Python: that is all a type needs.
"""

from __future__ import annotations

import asyncio
from typing import TypeAlias

from actors import Action, Done, GoalFailed, GoalRejected, Node, Reject, Steps, Supervisor, parameter
from actors.interfaces import ActionType, Message
from actors.interfaces.types import float32, int32, string
from robot.tutorials.program import Job, JobFailed, main, system


class Sweep_Goal(Message, frozen=True, kw_only=True):
    """How many cells there are."""

    width: int32 = 10
    height: int32 = 10


class Sweep_Result(Message, frozen=True, kw_only=True):
    """How many of them were swept."""

    success: bool = False
    cells: int32 = 0
    message: string = ""


class Sweep_Feedback(Message, frozen=True, kw_only=True):
    """Which cell has been swept just now, and how much of the map that makes, 0 to 100."""

    x: int32 = 0
    y: int32 = 0
    percent_complete: float32 = 0.0


class Sweep(ActionType[Sweep_Goal, Sweep_Result, Sweep_Feedback]):
    """Sweep every cell of a map."""

    Goal: TypeAlias = Sweep_Goal
    Result: TypeAlias = Sweep_Result
    Feedback: TypeAlias = Sweep_Feedback


SWEEP = Action(Sweep, "sweep_map")

TIME_PER_CELL = 0.1
"""s."""


class SweepServer(Node):
    """Sweeps a map row by row, there and back: serves the action sweep_map, ten cells a second, one map at a time."""

    @SWEEP.accepts
    def check(self, goal: Sweep_Goal) -> None:
        if goal.width < 1 or goal.height < 1:
            raise Reject(f"a map of {goal.width} x {goal.height} cells has nothing to sweep")

    @SWEEP.serve(arrivals="reject")
    async def sweep(self, goal: Sweep_Goal) -> Steps[Sweep_Feedback, Sweep_Result]:
        cells, begun, swept = goal.width * goal.height, self.clock.now(), 0
        try:
            while swept < cells:
                row, column = divmod(swept, goal.width)
                await self.clock.sleep_until(begun + (swept + 1) * TIME_PER_CELL)
                swept += 1
                x = goal.width - 1 - column if row % 2 else column
                yield Sweep.Feedback(x=x, y=row, percent_complete=100.0 * swept / cells)
        except asyncio.CancelledError:
            yield Done(Sweep.Result(cells=swept, message=f"Canceled after {swept} of {cells} cells"))
        else:
            yield Done(Sweep.Result(success=True, cells=swept, message=f"All {cells} cells swept"))


class SweepClient(Job):
    """Has a map swept by sweep_map and tells of every tenth part of it.

    Parameters: width, height, patience.
    """

    width = parameter(10)
    height = parameter(10)

    async def job(self) -> None:
        await self.wait_in_slices(SWEEP, "Waiting for action server...")
        told = 0
        try:
            async with self.send_goal(SWEEP, Sweep.Goal(width=self.width, height=self.height)) as sweeping:
                async for feedback in sweeping:
                    if feedback.percent_complete >= told + 10:
                        told = int(feedback.percent_complete // 10) * 10
                        self.log.info(f"{feedback.percent_complete:.0f}% complete")
                result = await sweeping
        except (GoalRejected, GoalFailed) as failed:
            raise JobFailed(f"Map not swept: {failed.reason}") from None
        self.log.info(result.message)


def tree() -> Supervisor:
    """A sweeper of maps, and a client that has a map of 10 x 10 cells swept."""
    return system("map_sweep", SweepServer, SweepClient)


if __name__ == "__main__":
    main(tree)
