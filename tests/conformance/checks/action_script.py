"""A script of `action_status` as a node: the execute callback and its siblings, as an action body of ours.

The scripts are written for rclpy, whose execute callback sets a state on a goal handle and returns a result. Ours is an async
generator, so a script becomes a body: succeed -> `Done`, abort -> `Aborted`, canceled -> the cancellation passes on, or `Done` after
it where there is a result; canceled without a request -> the body raises a cancellation of its own. No state -> the body ends without
a last item; where a result is returned all the same, it is handed over with `Aborted`, the only way to end with a result and without
success. Bodies of rclpy poll for a cancel request, so a body here notes the cancellation and goes on until its script reacts.

A handler that defers the execution is a queue in which another goal runs (`arrivals=queue(n)`): the goal is accepted and waits. Where a
cancel of the deferred goal is accepted and the case looks at what is between that and the end, it is a body that waits before its script
begins, for a waiting goal of ours that is canceled ends at once.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator
from typing import Any, Final

from actors import Aborted, Action, Done, Node, Reject
from actors.actions import parallel, queue
from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.runtime.incarnation import incarnation_of
from tests.conformance.checks.common import Skip, Unsupported, Vector, steps_of

COUNT: Final = Action(Fibonacci, "/fibonacci")
MOMENT: Final = 0.001
"""Seconds that a body rests between two states, so that each of them is seen on the status topic."""
WRONG_TYPE: Final = "publish_feedback_wrong_type"
_INPUT: Final = {"execute", "handle_accepted", "result_timeout_sec", "steps", "kind"}
_EXECUTE: Final = {
    "set_state", "return_result", "raises", "wait_for_cancel", "wait_for_signal", "publish_feedback", WRONG_TYPE,
}  # fmt: skip
_STATES: Final = {"succeed", "abort", "canceled", None}
POLICIES: Final = {"default", "accept", "reject", "raises", "returns_other_type"}


def known(what: str, given: object, words: set[Any]) -> Any:
    """The word that was given, or a failure that names what is not known."""
    if given not in words:
        raise Unsupported(f"unsupported {what} {given!r}: known are {', '.join(sorted(map(str, words)))}")
    return given


class Execute:
    """What an execute callback does."""

    def __init__(self, given: Vector) -> None:
        for name in given:
            known("field of execute", name, _EXECUTE)
        states = given.get("set_state", None if given.get("raises") else "succeed")
        self.states: list[str | None] = states if isinstance(states, list) else [states]
        for state in self.states:
            known("state to set", state, _STATES)
        self.returns = bool(given.get("return_result"))
        self.raises = bool(given.get("raises"))
        self.sets_nothing = self.raises and "set_state" not in given
        self.waits_for_cancel = bool(given.get("wait_for_cancel"))
        self.waits_for_signal = bool(given.get("wait_for_signal"))
        self.feedback: list[Any] = list(given.get("publish_feedback", ()))
        self.wrong_feedback = bool(given.get(WRONG_TYPE))


class Goal:
    """One goal of a script: what it is told, and what becomes of it."""

    def __init__(self, name: str, number: int, execute: Execute) -> None:
        self.name = name
        self.number = number
        self.id = name.encode().ljust(16, b"\0")[:16]
        self.execute = execute
        self.policy = self.cancel_policy = "default"
        self.accepted: bool | None = None
        self.stamp = Time()
        self.asked_at = self.answered_at = Time()
        self.gate: asyncio.Event | None = None
        self.released = asyncio.Event()
        self.signal = asyncio.Event()
        self.cancel_seen = asyncio.Event()
        self.orders: asyncio.Queue[Any] = asyncio.Queue()


class Script:
    """One case: what its server does, and what is noticed there."""

    def __init__(self, vector: Vector) -> None:
        given = vector["input"]
        for name in given:
            known("field of input", name, _INPUT)
        self.steps: list[Vector] = steps_of(vector)
        self.expect: Vector = vector.get("expect", {})
        self.execute = Execute(given.get("execute", {}))
        self.deferred = known("handle_accepted", given.get("handle_accepted"), {None, "default", "defer"}) == "defer"
        self.held = self.deferred and self._looks_at_canceling()
        self.queued = self.deferred and not self.held
        self.steered = any(step["op"] in ("publish_feedback", WRONG_TYPE) for step in self.steps)
        self.looked_at: set[str] = {*self.expect, *(step["op"] for step in self.steps)}
        self.tries_wrong_feedback = WRONG_TYPE in self.expect and not self.steered
        self.result_timeout: float | None = given.get("result_timeout_sec")
        self.goals: dict[str, Goal] = {}
        self.status_on_entry: dict[str, str] = {}
        """For each goal whose execute callback was called: its status at that moment."""
        self.cancel_asked: list[str] = []
        self.set_state_error: str | None = None
        self.feedback_error: str | None = None
        self.skip: Skip | None = None
        self.gates: list[asyncio.Event] = []
        """What the goals that keep the queue busy wait for: one before each deferred goal, with the orders -1, -2, ..."""
        self.over = False
        """The case has been run: what its bodies wait for will not come."""

    def _looks_at_canceling(self) -> bool:
        """Whether an accepted cancel of a deferred goal is followed by a look at the goal before it ends."""
        agreed = [step["op"] == "cancel_request" and step.get("cancel_callback") == "accept" for step in self.steps]
        if not any(agreed):
            return False
        after = {step["op"] for step in self.steps[agreed.index(True) :]}
        return bool({"execute", "check_status"} & after or {"status", "status_on_execute_entry"} & set(self.expect))

    def goal(self, name: str) -> Goal:
        if name not in self.goals:
            self.goals[name] = Goal(name, len(self.goals) + 1, self.execute)
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
        returned = goal.execute.returns
        result = Fibonacci.Result(sequence=[0, 1, 1, 2, 3, 5] if returned else [])
        canceled = goal.cancel_seen.is_set()
        if state == "succeed":
            if canceled:
                self.skip = Skip("by design a goal cannot succeed any more once its cancel has been accepted")
            return Done(result)
        if state == "abort":
            return Aborted(result)
        if state == "canceled":
            if canceled and returned:
                return Done(result)
            raise asyncio.CancelledError
        return Aborted(result) if returned else None


def make_server(script: Script) -> type[Node]:
    """A node whose action does what the script says."""
    options: dict[str, Any] = {} if script.result_timeout is None else {"result_timeout": script.result_timeout}

    class Server(Node):
        @COUNT.accepts
        def check(self, message: Fibonacci.Goal) -> Any:
            policy = "accept" if message.order < 0 else script.of(message).policy
            if policy == "reject":
                raise Reject("as the script says")
            if policy == "raises":
                raise RuntimeError("as the script says")
            return "yes" if policy == "returns_other_type" else None

        @COUNT.cancels
        def may_cancel(self, message: Fibonacci.Goal) -> Any:
            if message.order < 0:
                return False
            script.cancel_asked.append(script.of(message).name)
            policy = script.of(message).cancel_policy
            if policy == "default":
                script.skip = Skip(
                    "by design a cancel is accepted unless an @ACTION.cancels method refuses; rclpy refuses"
                )
            if policy == "raises":
                raise RuntimeError("as the script says")
            return "yes" if policy == "returns_other_type" else policy == "accept"

        @COUNT.serve(arrivals=queue(100) if script.queued else parallel(100), **options)
        async def work(self, message: Fibonacci.Goal) -> AsyncGenerator[Any, None]:
            if message.order < 0:
                await script.gates[-message.order - 1].wait()
                yield Done(Fibonacci.Result())
                return
            goal = script.of(message)
            if script.held:
                await script.come(goal, goal.released)
            table = incarnation_of(self).record.actions[COUNT.name].table
            script.status_on_entry[goal.name] = table.status_of(goal.id).name.lower()
            for sequence in goal.execute.feedback:
                yield Fibonacci.Feedback(sequence=sequence)
            if goal.execute.wrong_feedback or script.tries_wrong_feedback:
                goal.orders.put_nowait(WRONG_TYPE)
            await self.clock.sleep(MOMENT)
            while script.steered or not goal.orders.empty():
                order = await goal.orders.get()
                if order is None:
                    break
                try:
                    yield Fibonacci.Result() if order == WRONG_TYPE else Fibonacci.Feedback(sequence=order)
                except TypeError:  # the driver's word on what is no feedback of this action
                    script.feedback_error = "type_error"
            if goal.execute.waits_for_signal:
                await script.come(goal, goal.signal)
            if goal.execute.waits_for_cancel:
                await script.come(goal, goal.cancel_seen)
                await self.clock.sleep(MOMENT)
            if goal.execute.sets_nothing:
                raise RuntimeError("as the script says")
            for state in goal.execute.states:
                item = script.last_item(goal, state)
                if item is not None:
                    try:
                        yield item
                    except RuntimeError:  # the driver's word on a second last item
                        script.set_state_error = "invalid_transition"
            if goal.execute.raises:
                raise RuntimeError("as the script says")

    return Server
