"""`navigate_to_goal` with the Fibonacci type as a stand-in: cancel, preemption and retry without a robot to move.

The robot's own node (`robot.nodes.navigation`) serves the real NavigateToGoal.
"""

from __future__ import annotations

import asyncio

from actors import Action, Done, GoalRejected, Node, Reject, Steps, Supervisor, parameter
from actors.interfaces.example_interfaces.action import (
    Fibonacci,
    Fibonacci_Feedback,
    Fibonacci_Goal,
    Fibonacci_Result,
)
from actors.typing import Goal
from robot.tutorials.fibonacci import numbers_up_to, why_not
from robot.tutorials.program import Job, JobFailed, main, system

NAVIGATE_TO_GOAL = Action(Fibonacci, "navigate_to_goal")

TICK = 0.1
"""Seconds for each of the `order` iterations."""


class NavigationServer(Node):
    """Pretends to navigate: serves the action navigate_to_goal, `order` feedbacks 0.1 s apart. A new goal preempts the one before it."""

    node_name = "navigation_action_server"

    @NAVIGATE_TO_GOAL.accepts
    def check(self, goal: Fibonacci_Goal) -> None:
        if reason := why_not(goal.order):
            self.log.warning(f"Goal rejected: {reason}")
            raise Reject(reason)

    @NAVIGATE_TO_GOAL.serve(arrivals="preempt")
    async def navigate(self, goal: Fibonacci_Goal) -> Steps[Fibonacci_Feedback, Fibonacci_Result]:
        self.log.info("Executing goal...")
        begun, done = self.clock.now(), 0
        try:
            while done < goal.order:
                await self.clock.sleep_until(begun + (done + 1) * TICK)
                done += 1
                numbers = numbers_up_to(done)
                self.log.info(f"Feedback: {numbers}")
                yield Fibonacci.Feedback(sequence=numbers)
        except asyncio.CancelledError:
            self.log.info("Goal cancelled")
        yield Done(Fibonacci.Result(sequence=numbers_up_to(done)))


class NavigationClient(Job):
    """Sends one goal of navigate_to_goal, and on request cancels it after a while.

    Parameters: order, cancel_after, patience.
    """

    node_name = "navigation_action_client"
    order = parameter(10)
    cancel_after = parameter(0.0, unit="s", ge=0.0, description="0: not at all.")

    async def job(self) -> None:
        await self.wait_in_slices(NAVIGATE_TO_GOAL, "Waiting for action server...")
        self.log.info("Sending goal...")
        try:
            async with self.send_goal(NAVIGATE_TO_GOAL, Fibonacci.Goal(order=self.order)) as goal:
                self.log.info("Goal accepted")
                canceling = self.create_task(self._cancel_later(goal)) if self.cancel_after else None
                async for feedback in goal:
                    self.log.info(f"Received feedback: {feedback.sequence.tolist()}")
                outcome = await goal.ended()
                if canceling is not None:
                    await canceling
        except GoalRejected as rejected:
            raise JobFailed(f"Goal rejected: {rejected.reason}") from None
        if outcome.result is None:
            raise JobFailed(f"Goal failed: {outcome.reason}")
        self.log.info(f"Result: {outcome.result.sequence.tolist()}")

    async def _cancel_later(self, goal: Goal[Fibonacci_Result, Fibonacci_Feedback]) -> None:
        await self.clock.sleep(self.cancel_after)
        self.log.info("Goal cancelled" if await goal.cancel() else "Goal could not be cancelled")


def tree() -> Supervisor:
    """A stand-in for a navigator, and a client that sends it a goal of ten steps."""
    return system("navigate_stand_in", NavigationServer, NavigationClient)


if __name__ == "__main__":
    main(tree)
