"""A script of `action_status` as a node: the execute callback and its siblings, as an action body of ours.

The scripts are written for rclpy, whose execute callback sets a state on a goal handle and returns a result. Ours is an async
generator, so a script becomes a body: succeed -> `Done`, abort -> `Aborted`, canceled -> the cancellation passes on, or `Done` after
it where there is a result; canceled without a request -> the body raises a cancellation of its own. No state -> the body ends without
a last item; where a result is returned all the same, it is handed over with `Aborted`, the only way to end with a result and without
success. Bodies of rclpy poll for a cancel request, so a body here notes the cancellation and goes on until its script reacts.

A handler that defers the execution is a queue in which another goal runs (`arrivals=queue(n)`); where the deferred goal is canceled,
which ends a waiting goal of ours at once, it is a body that waits before its script begins.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator
from typing import Any, Final

from actors import Aborted, Action, Done, Node, Reject, parallel, queue
from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.example_interfaces.action import Fibonacci
from tests.conformance.checks.common import Skip, Vector

COUNT: Final = Action(Fibonacci, "/fibonacci")
MOMENT: Final = 0.001
"""Seconds that a body rests between two states, so that each of them is seen on the status topic."""
BLOCKER: Final = 0
"""The order of the goal that keeps the queue busy; the goals of a script have the orders 1, 2, ..."""
_EXECUTE: Final = {"set_state", "return_result", "raises", "wait_for_cancel", "wait_for_signal", "publish_feedback"}


class Goal:
    """One goal of a script: what it is told, and what becomes of it."""

    def __init__(self, name: str, number: int) -> None:
        self.name = name
        self.number = number
        self.id = name.encode().ljust(16, b"\0")[:16]
        self.policy = self.cancel_policy = "default"
        self.accepted: bool | None = None
        self.stamp = Time()
        self.asked_at = Time()
        self.released = asyncio.Event()
        self.signal = asyncio.Event()
        self.cancel_seen = asyncio.Event()
        self.orders: asyncio.Queue[list[int]] = asyncio.Queue()


class Script:
    """One case: what its server does, and what is noticed there."""

    def __init__(self, vector: Vector) -> None:
        given = vector["input"]
        self.steps: list[Vector] = given.get("steps", vector.get("steps", []))
        self.expect: Vector = vector["expect"]
        self.execute: Vector = given.get("execute", {})
        for unknown in self.execute.keys() - _EXECUTE:
            raise Skip(f"there is no way to express an execute callback with {unknown!r}")
        states = self.execute.get("set_state", "succeed")
        self.states: list[str | None] = states if isinstance(states, list) else [states]
        self.deferred = given.get("handle_accepted") == "defer"
        self.held = self.deferred and any(step["op"] == "cancel_request" for step in self.steps)
        self.steered = any(step["op"] == "publish_feedback" for step in self.steps)
        self.result_timeout: float | None = given.get("result_timeout_sec")
        self.goals: dict[str, Goal] = {}
        self.executed: list[str] = []
        self.status_on_entry = ""
        self.set_state_error: str | None = None
        self.skip: Skip | None = None
        self.go_on = asyncio.Event()
        self.over = False
        """The case has been run: what its bodies wait for will not come."""

    def goal(self, name: str) -> Goal:
        if name not in self.goals:
            self.goals[name] = Goal(name, len(self.goals) + 1)
        return self.goals[name]

    def of(self, message: Fibonacci.Goal) -> Goal:
        return next(goal for goal in self.goals.values() if goal.number == message.order)

    async def come(self, goal: Goal, event: asyncio.Event) -> None:
        """Wait for an event as a body does that polls for cancel requests: note one and wait on."""
        while not event.is_set():
            try:
                await event.wait()
            except asyncio.CancelledError:
                if self.over:
                    raise
                goal.cancel_seen.set()

    def last_item(self, goal: Goal, state: str | None) -> Done[Any] | Aborted[Any] | None:
        """What stands here for `goal_handle.succeed()` and its siblings, and for returning without them."""
        returned = bool(self.execute.get("return_result"))
        result = Fibonacci.Result(sequence=[0, 1, 1, 2, 3, 5] if returned else [])
        canceled = goal.cancel_seen.is_set()
        match state:
            case "succeed":
                if canceled:
                    self.skip = Skip("by design a goal cannot succeed any more once its cancel has been accepted")
                return Done(result)
            case "abort":
                return Aborted(result)
            case "canceled":
                if canceled and returned:
                    return Done(result)
                raise asyncio.CancelledError
            case None:
                return Aborted(result) if returned else None
            case other:
                self.skip = Skip(f"there is no way to express the state {other!r}")
                return None


def make_server(script: Script) -> type[Node]:
    """A node whose action does what the script says."""
    options: dict[str, Any] = {} if script.result_timeout is None else {"result_timeout": script.result_timeout}
    execute = script.execute

    class Server(Node):
        @COUNT.accepts
        def check(self, message: Fibonacci.Goal) -> Any:
            policy = "accept" if message.order == BLOCKER else script.of(message).policy
            if policy == "reject":
                raise Reject("as the script says")
            if policy == "raises":
                raise RuntimeError("as the script says")
            return "yes" if policy == "returns_other_type" else None

        @COUNT.cancels
        def may_cancel(self, message: Fibonacci.Goal) -> Any:
            policy = script.of(message).cancel_policy
            if policy == "raises":
                raise RuntimeError("as the script says")
            return "yes" if policy == "returns_other_type" else policy == "accept"

        @COUNT.serve(arrivals=queue(100) if script.deferred and not script.held else parallel(100), **options)
        async def work(self, message: Fibonacci.Goal) -> AsyncGenerator[Any, None]:
            if message.order == BLOCKER:
                await script.go_on.wait()
                yield Done(Fibonacci.Result())
                return
            goal = script.of(message)
            if script.held:
                await script.come(goal, goal.released)
            script.executed.append(goal.name)
            script.status_on_entry = self.core.mailbox.actions[COUNT.name].table.status_of(goal.id).name.lower()
            for sequence in execute.get("publish_feedback", ()):
                yield Fibonacci.Feedback(sequence=sequence)
            await self.clock.sleep(MOMENT)
            while script.steered:
                yield Fibonacci.Feedback(sequence=await goal.orders.get())
            if execute.get("wait_for_signal"):
                await script.come(goal, goal.signal)
            if execute.get("wait_for_cancel"):
                await script.come(goal, goal.cancel_seen)
                await self.clock.sleep(MOMENT)
            if execute.get("raises") and "set_state" not in execute:
                raise RuntimeError("as the script says")
            for state in script.states:
                item = script.last_item(goal, state)
                if item is not None:
                    try:
                        yield item
                    except RuntimeError:  # the driver's word on a second last item
                        script.set_state_error = "invalid_transition"
            if execute.get("raises"):
                raise RuntimeError("as the script says")

    return Server
