"""Vectors of `action_status`: scripts for an action server, run on the virtual clock against a real one, over its five ROS endpoints.

How a script becomes a node is told in `action_script`.
"""

from __future__ import annotations

import asyncio
from collections.abc import Iterable
from inspect import signature
from pathlib import Path
from typing import Any, Final

from actors import Service, Topic, qos
from actors.actions.goals import CancelCode, GoalStatus
from actors.interfaces import derived
from actors.interfaces.action_msgs.msg import GoalInfo, GoalStatusArray
from actors.interfaces.action_msgs.srv import CancelGoal
from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.unique_identifier_msgs.msg import UUID
from tests.conformance import crossing
from tests.conformance.checks.action_script import (
    COUNT,
    POLICIES,
    WRONG_TYPE,
    Execute,
    Goal,
    Script,
    known,
    make_server,
)
from tests.conformance.checks.action_seen import Seen
from tests.conformance.checks.common import Case, Unsupported, Vector, each
from tests.conformance.crossing import Sent, Stage

STATUS: Final = Topic(GoalStatusArray, "/fibonacci/_action/status", qos.ACTION_STATUS)
FEEDBACK: Final[Topic[Any]] = Topic(
    derived.feedback_message(Fibonacci), "/fibonacci/_action/feedback", qos.ACTION_FEEDBACK
)
SEND_GOAL: Final = Service(derived.send_goal_service(Fibonacci), "/fibonacci/_action/send_goal")
GET_RESULT: Final = Service(derived.get_result_service(Fibonacci), "/fibonacci/_action/get_result")
CANCEL: Final = Service(CancelGoal, "/fibonacci/_action/cancel_goal")

CLIENT_EXPECTATIONS: Final = {
    "feedback_callback_called_for",
    "client_goal_handle_status_before_any_status_message",
}
"""What can only be seen by the holder of a client's handle."""
PAUSE: Final = 0.01
"""Seconds after every step of a script."""
PATIENCE: Final = 60.0
"""Seconds for which a result is waited for."""


class Run(Seen):
    """A script under way: the client's side, and what is seen from there."""

    def __init__(self, script: Script, rig: Stage) -> None:
        self.script = script
        self.rig = rig
        self.statuses = rig.probe(STATUS)
        self.feedback = rig.probe(FEEDBACK)
        self.clients: dict[str, Sent] = {}
        self.accepted: list[tuple[Goal, bool]] = []
        """The answers to the goal requests, in order."""
        self.untold: dict[str, str] = {}
        """The status of each client's goal before the server has said anything about it."""
        self.results: list[tuple[Goal, asyncio.Task[Any]]] = []
        self.canceled: CancelGoal.Response | None = None
        self.checked: list[str] = []
        self.counts: list[int] = []
        self.late_subscriber: bool | None = None
        self.default_timeout: float | None = None
        self.begun_ns = 0
        """The time of day at which the script begins: the stamps of its steps are counted from there."""

    async def steps(self) -> None:
        self.begun_ns = self.rig.system.clock.wall_ns()
        await self.rig.advance(1.5)  # so that a stamp is not zero by chance
        if self.script.queued:
            await self._block()
        for number, step in enumerate(self.script.steps):
            act = getattr(self, f"op_{step['op']}", None)
            if act is None:
                raise Unsupported(f"unsupported step {step['op']!r}")
            given = {name: value for name, value in step.items() if name not in ("op", "expect", "note")}
            for name in given.keys() - signature(act).parameters.keys() - {"async"}:
                raise Unsupported(f"unsupported field {name!r} of the step {step['op']!r}")
            answer = await act(**given)
            await self.rig.advance(PAUSE + crossing.delay())
            if "expect" in step:
                await self.check_step(f"step {number} {step['op']}", answer, step["expect"])
        for _, result in self.results:
            await result

    # -- what a step does ---------------------------------------------------------------------------------------------------

    async def op_goal_request(self, goal: str, goal_callback: str = "default", execute: Vector | None = None) -> Vector:
        one = self.script.goal(goal)
        one.policy = known("goal callback", goal_callback, POLICIES)
        if execute is not None:
            one.execute = Execute(execute)
        one.asked_at = self.rig.system.clock.stamp()
        if CLIENT_EXPECTATIONS & self.script.looked_at:
            await self._send_as_client(one)
        else:
            reply = await self.send(one.id, one.number)
            one.accepted, one.stamp = reply.accepted, reply.stamp
        one.answered_at = self.rig.system.clock.stamp()
        self.accepted.append((one, bool(one.accepted)))
        if self.script.queued and one.accepted and one.gate is None:
            one.gate = self.script.gates[-1]
            await self._block()
        return {"accepted": one.accepted, "goal_accepted": one.accepted, "stamp_is_zero": one.stamp == Time()}

    async def _block(self) -> None:
        """Let a goal of our own keep those behind it waiting until its gate opens."""
        self.script.gates.append(asyncio.Event())
        number = len(self.script.gates)
        await self.send(f"blocker {number}".encode().ljust(16, b"\0"), -number)

    async def _send_as_client(self, one: Goal) -> None:
        """Send a goal with a client's handle instead of a bare request."""
        self.clients[one.name] = sent = await crossing.send_goal(self.rig, COUNT, Fibonacci.Goal(order=one.number))
        self.untold[one.name] = sent.untold
        one.accepted = bool(sent.id)
        if sent.id:
            one.id = sent.id

    async def op_cancel_request(
        self, goal: str | None = None, cancel_callback: str = "default", stamp_ns: int = 0
    ) -> Vector:
        for one in self.script.goals.values():
            one.cancel_policy = known("cancel callback", cancel_callback, POLICIES)
        self.canceled = await self._cancel(
            bytes(16) if goal is None else self.script.goal(goal).id, stamp_ns and stamp_ns + self.begun_ns
        )
        return {"return_code": await self.seen_return_code(""), "goals_canceling": await self.seen_goals_canceling([])}

    async def op_get_result(self, goal: str, **more: bool) -> Vector:
        one = self.script.goal(goal)
        if self.script.steered and not one.execute.waits_for_signal:
            one.orders.put_nowait(None)
        request = GET_RESULT.request(goal_id=UUID(uuid=one.id))
        result = asyncio.create_task(self.rig.call(GET_RESULT, request, timeout=PATIENCE))
        self.results.append((one, result))
        if more.get("async"):
            return {}
        await asyncio.wait([result])
        status, message = result.result().status, result.result().result
        return {"status": GoalStatus(status).name.lower(), "result_is_default": message == Fibonacci.Result()}

    async def op_signal(self, goal: str | None = None) -> None:
        one = self.script.goal(goal or next(reversed(self.script.goals)))
        early = [result for asker, result in self.results if asker is one and result.done()]
        assert not early, "a result was handed out before the goal had ended"
        one.signal.set()
        one.orders.put_nowait(None)

    async def op_execute(self, goal: str | None = None) -> None:
        one = self.script.goal(goal or next(reversed(self.script.goals)))
        one.released.set()
        if one.gate is not None:
            one.gate.set()

    async def op_publish_feedback(self, goal: str, value: list[int], wrong_type: bool = False) -> Vector:
        return await self._order(goal, WRONG_TYPE if wrong_type else value)

    async def op_publish_feedback_wrong_type(self, goal: str | None = None, value: object = None) -> Vector:
        return await self._order(goal or next(reversed(self.script.goals)), WRONG_TYPE)

    async def _order(self, goal: str, order: object) -> Vector:
        """Let a body publish a feedback; what it was told."""
        self.script.feedback_error = None
        self.script.goal(goal).orders.put_nowait(order)
        await self.rig.advance(PAUSE)
        error = self.script.feedback_error
        return {"ok": error is None, "error": error, "publish_feedback_error": error}

    async def op_wait_sec(self, seconds: float) -> None:
        await self.rig.advance(seconds)

    async def op_count_tracked(self) -> int:
        self.counts.append(await self.tracked())
        return self.counts[-1]

    async def op_check_status(self, goal: str | None = None) -> str:
        self.checked.append(self.status(self.script.goal(goal or next(reversed(self.script.goals)))))
        return self.checked[-1]

    async def op_new_status_subscription(self) -> bool:
        late = self.rig.probe(STATUS)
        await self.rig.advance(crossing.delay())
        self.late_subscriber = late.last is not None and late.last == self.statuses.last
        return self.late_subscriber

    async def op_default_result_timeout(self) -> float:
        server = self.rig.state("server").actions[COUNT.name]
        self.default_timeout = server.table.result_timeout_ns / 1e9
        return self.default_timeout

    async def op_goal_accepted_sequence(self) -> list[bool]:
        return [accepted for _, accepted in self.accepted]

    async def op_client_goal_handle_status_before_any_status_message(self, goal: str | None = None) -> str:
        return self.untold_status(goal)

    # -- what is seen -------------------------------------------------------------------------------------------------------

    async def send(self, goal_id: bytes, order: int) -> Any:
        request = SEND_GOAL.request(goal_id=UUID(uuid=goal_id), goal=Fibonacci.Goal(order=order))
        return await self.rig.call(SEND_GOAL, request)

    async def _cancel(self, goal_id: bytes, stamp_ns: int = 0) -> CancelGoal.Response:
        stamp = Time(sec=stamp_ns // 1_000_000_000, nanosec=stamp_ns % 1_000_000_000)
        info = GoalInfo(goal_id=UUID(uuid=goal_id), stamp=stamp)
        return await self.rig.call(CANCEL, CancelGoal.Request(goal_info=info))

    async def tracked(self) -> int:
        """How many of the goals the server remembers: those that a refused cancel request is not UNKNOWN_GOAL_ID for."""
        for goal in self.script.goals.values():
            goal.cancel_policy = "reject"
        codes = [(await self._cancel(goal.id)).return_code for goal in self.script.goals.values()]
        return sum(code != CancelCode.UNKNOWN_GOAL_ID for code in codes)


async def play(vector: Vector) -> None:
    """Run one case from the server's start to its end, and compare."""
    script = Script(vector)
    rig = crossing.rig()
    await rig.start(make_server(script))
    try:
        run = Run(script, rig)
        await run.steps()
        await rig.advance(PAUSE + crossing.delay())
        if script.skip is not None:
            raise script.skip
        await run.check()
    finally:
        script.over = True
        await rig.close()


def check(vector: Vector) -> None:
    with crossing.runner() as runner:
        runner.run(play(vector))


def cases(path: Path) -> Iterable[Case]:
    return each(path, check)
