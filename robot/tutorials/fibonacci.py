"""The Fibonacci action: one number a second, and a partial result after a cancel.

`order` n asks for the n + 1 numbers F(0) .. F(n), so order 0 gives [0]. They are 32-bit: order 46 is the last that fits, and a goal that does
not fit is rejected before it runs.
"""

from __future__ import annotations

import asyncio

from actors import Action, Done, GoalFailed, GoalRejected, Node, Reject, Steps, Supervisor, parameter
from robot.interfaces.tutorials.my_robot_pkg.action import (
    Fibonacci,
    Fibonacci_Feedback,
    Fibonacci_Goal,
    Fibonacci_Result,
)
from robot.tutorials.program import Job, JobFailed, main, system

FIBONACCI = Action(Fibonacci, "fibonacci")

PAUSE = 1.0
"""Seconds after each number."""
LARGEST = 46
"""F(46) is 1836311903; F(47) is more than an int32 holds."""


def numbers_up_to(order: int) -> list[int]:
    """F(0) .. F(order)."""
    numbers = [0, 1]
    while len(numbers) <= order:
        numbers.append(numbers[-1] + numbers[-2])
    return numbers[: order + 1]


def why_not(order: int) -> str:
    """Why there is no such sequence; empty if there is."""
    if order < 0:
        return f"order {order} is negative: ask for 0 to {LARGEST}"
    return f"order {order} needs numbers beyond 32 bits: ask for 0 to {LARGEST}" if order > LARGEST else ""


class FibonacciServer(Node):
    """Computes the sequence, one number a second: serves the action fibonacci, any number of goals at once."""

    node_name = "fibonacci_action_server"

    @FIBONACCI.accepts
    def check(self, goal: Fibonacci_Goal) -> None:
        self.log.info("Received goal request")
        if reason := why_not(goal.order):
            self.log.warning(f"Goal rejected: {reason}")
            raise Reject(reason)

    @FIBONACCI.cancels
    def agree(self, goal: Fibonacci_Goal) -> bool:
        self.log.info("Received cancel request")
        return True

    @FIBONACCI.serve(arrivals="parallel")
    async def compute(self, goal: Fibonacci_Goal) -> Steps[Fibonacci_Feedback, Fibonacci_Result]:
        self.log.info("Executing goal...")
        begun, known = self.clock.now(), min(goal.order, 1)
        try:
            for known in range(2, goal.order + 1):
                numbers = numbers_up_to(known)
                self.log.info(f"Feedback: {numbers}")
                yield Fibonacci.Feedback(sequence=numbers)
                await self.clock.sleep_until(begun + (known - 1) * PAUSE)  # not a running sum: that would drift
        except asyncio.CancelledError:
            self.log.info("Goal canceled")
        else:
            self.log.info(f"Result: {numbers_up_to(known)}")
        yield Done(Fibonacci.Result(sequence=numbers_up_to(known)))


class FibonacciClient(Job):
    """Asks fibonacci for one sequence and tells how it grows.

    Parameters: order, patience.
    """

    node_name = "fibonacci_action_client"
    order = parameter(10)

    async def job(self) -> None:
        await self.wait_in_slices(FIBONACCI, "Waiting for action server...")
        try:
            async with self.send_goal(FIBONACCI, Fibonacci.Goal(order=self.order)) as computing:
                self.log.info("Goal accepted")
                async for feedback in computing:
                    self.log.info(f"Received feedback: {feedback.sequence.tolist()}")
                result = await computing
        except GoalRejected as rejected:
            raise JobFailed(f"Goal rejected: {rejected.reason}") from None
        except GoalFailed as failed:
            raise JobFailed(f"Goal failed: {failed.reason}") from None
        self.log.info(f"Result: {result.sequence.tolist()}")


def tree() -> Supervisor:
    """A server of the Fibonacci action and a client that asks for order 10."""
    return system("fibonacci", FibonacciServer, FibonacciClient)


if __name__ == "__main__":
    main(tree)
