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
from actors.errors import GoalRejected
from actors.goal_client import Goal as Client
from actors.goals import CancelCode, GoalStatus
from actors.interfaces import derived
from actors.interfaces.action_msgs.msg import GoalInfo, GoalStatusArray
from actors.interfaces.action_msgs.srv import CancelGoal
from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.unique_identifier_msgs.msg import UUID
from actors.testing import Rig, VirtualLoop
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
from tests.conformance.checks.common import Case, Unsupported, Vector, each, same

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


class Run:
    """A script under way: the client's side, and what is seen from there."""

    def __init__(self, script: Script, rig: Rig) -> None:
        self.script = script
        self.rig = rig
        self.statuses = rig.probe(STATUS)
        self.feedback = rig.probe(FEEDBACK)
        self.clients: dict[str, Client[Any, Any]] = {}
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

    async def steps(self) -> None:
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
            await self.rig.advance(PAUSE)
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
            reply = await self._send(one.id, one.number)
            one.accepted, one.stamp = reply.accepted, reply.stamp
        self.accepted.append((one, bool(one.accepted)))
        if self.script.queued and one.accepted and one.gate is None:
            one.gate = self.script.gates[-1]
            await self._block()
        return {"accepted": one.accepted, "goal_accepted": one.accepted, "stamp_is_zero": one.stamp == Time()}

    async def _block(self) -> None:
        """Let a goal of our own keep those behind it waiting until its gate opens."""
        self.script.gates.append(asyncio.Event())
        number = len(self.script.gates)
        await self._send(f"blocker {number}".encode().ljust(16, b"\0"), -number)

    async def _send_as_client(self, one: Goal) -> None:
        """Send a goal with a client's handle instead of a bare request."""
        self.clients[one.name] = client = self.rig.me.start(COUNT, Fibonacci.Goal(order=one.number))
        self.untold[one.name] = client.status.name.lower()
        try:
            await client.send()
        except GoalRejected:
            one.accepted = False
        else:
            one.id, one.accepted = client.goal_id, True

    async def op_cancel_request(
        self, goal: str | None = None, cancel_callback: str = "default", stamp_ns: int = 0
    ) -> Vector:
        for one in self.script.goals.values():
            one.cancel_policy = known("cancel callback", cancel_callback, POLICIES)
        self.canceled = await self._cancel(bytes(16) if goal is None else self.script.goal(goal).id, stamp_ns)
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

    async def op_signal(self, goal: str) -> None:
        one = self.script.goal(goal)
        early = [result for asker, result in self.results if asker is one and result.done()]
        assert not early, "a result was handed out before the goal had ended"
        one.signal.set()
        one.orders.put_nowait(None)

    async def op_execute(self, goal: str) -> None:
        one = self.script.goal(goal)
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

    async def op_check_status(self, goal: str) -> str:
        self.checked.append(self.status(self.script.goal(goal)))
        return self.checked[-1]

    async def op_new_status_subscription(self) -> bool:
        late = self.rig.probe(STATUS)
        self.late_subscriber = late.last is not None and late.last == self.statuses.last
        return self.late_subscriber

    async def op_default_result_timeout(self) -> float:
        server = self.rig.state("server").mailbox.actions[COUNT.name]
        self.default_timeout = server.table.result_timeout_ns / 1e9
        return self.default_timeout

    async def op_goal_accepted_sequence(self) -> list[bool]:
        return [accepted for _, accepted in self.accepted]

    async def op_client_goal_handle_status_before_any_status_message(self, goal: str | None = None) -> str:
        return self.untold[goal or next(reversed(self.untold))]

    # -- what is seen -------------------------------------------------------------------------------------------------------

    async def _send(self, goal_id: bytes, order: int) -> Any:
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

    def sequence(self, goal: Goal) -> list[str]:
        """The states that the status topic told of a goal, in order, ACCEPTED included."""
        seen: list[str] = []
        for message in self.statuses.messages:
            for one in message.status_list:
                name = GoalStatus(one.status).name.lower()
                if one.goal_info.goal_id.uuid.tobytes() == goal.id and seen[-1:] != [name]:
                    seen.append(name)
        return seen

    def status(self, goal: Goal) -> str:
        return (self.sequence(goal) or ["unknown"])[-1]

    def name_of(self, goal_id: bytes) -> str:
        return next(goal.name for goal in self.script.goals.values() if goal.id == goal_id)

    # -- what is expected ---------------------------------------------------------------------------------------------------

    async def check(self) -> None:
        for name in self.script.expect:
            await self.check_one(name, self.script.expect[name])

    async def check_one(self, name: str, wanted: Any) -> None:
        """Compare one expectation with what was seen; those about the status topic may have any name that says so."""
        answer = getattr(self, f"seen_{name}", None)
        if answer is None and "status" in name:
            answer = self.seen_last_status_message
        if answer is None:
            raise Unsupported(f"unsupported expectation {name!r}")
        same(name, await answer(wanted), wanted)

    async def check_step(self, what: str, answer: Any, wanted: Any) -> None:
        """Compare what a step expects with its own answer, and otherwise with what has been seen until then."""
        if not isinstance(wanted, dict):
            same(what, answer, wanted)
            return
        own = answer if isinstance(answer, dict) else {}
        for name, value in wanted.items():
            if name in own:
                same(f"{what}: {name}", own[name], value)
            else:
                await self.check_one(name, value)

    async def seen_goal_accepted(self, wanted: Vector) -> Vector:
        return {name: self.script.goal(name).accepted for name in wanted}

    async def seen_goal_accepted_sequence(self, wanted: Any) -> Any:
        if isinstance(wanted, dict):
            return {name: [accepted for goal, accepted in self.accepted if goal.name == name] for name in wanted}
        return await self.op_goal_accepted_sequence()

    async def seen_client_goal_handle_status_before_any_status_message(self, wanted: Any) -> Any:
        if isinstance(wanted, dict):
            return {name: self.untold[name] for name in wanted}
        return await self.op_client_goal_handle_status_before_any_status_message()

    async def seen_publish_feedback_wrong_type(self, wanted: Any) -> Any:
        return self.script.feedback_error

    seen_publish_feedback_error = seen_execute_publish_feedback_error = seen_publish_feedback_wrong_type

    async def seen_cancel_callback_called_for(self, wanted: list[str]) -> list[str]:
        return self.script.cancel_asked

    seen_selected_for_cancel_callback = seen_cancel_callback_called_for

    async def seen_execute_called(self, wanted: Any) -> Any:
        called = self.script.status_on_entry
        if isinstance(wanted, dict):
            return {name: name in called for name in wanted}
        return list(called) if isinstance(wanted, list) else bool(called)

    async def seen_tracked_goals(self, wanted: int) -> int:
        return await self.tracked()

    async def seen_tracked_counts(self, wanted: list[int]) -> list[int]:
        return self.counts

    async def seen_status_on_execute_entry(self, wanted: Any) -> Any:
        entered = self.script.status_on_entry
        if isinstance(wanted, dict):
            return {name: entered.get(name) for name in wanted}
        return next(reversed(entered.values()), None)

    async def seen_status_sequence(self, wanted: Vector) -> Vector:
        return {name: [one for one in self.sequence(self.script.goal(name)) if one != "accepted"] for name in wanted}

    async def seen_status(self, wanted: Any) -> Any:
        if isinstance(wanted, dict):
            return {name: self.status(self.script.goal(name)) for name in wanted}
        return self.status(next(reversed(self.script.goals.values())))

    async def seen_last_status_message(self, wanted: Any) -> Any:
        """The last list on the status topic, in its order, in the form in which it is expected."""
        last = self.statuses.last
        listed = [] if last is None else last.status_list
        names = {goal.id: goal.name for goal in self.script.goals.values()}
        pairs = [
            (names[one.goal_info.goal_id.uuid.tobytes()], GoalStatus(one.status).name.lower())
            for one in listed
            if one.goal_info.goal_id.uuid.tobytes() in names
        ]
        if isinstance(wanted, dict):
            states = dict(pairs)
            return states if set(wanted) == set(states) else {name: states.get(name) for name in wanted}
        if isinstance(wanted, int):
            return len(pairs)
        if not isinstance(wanted, list):
            raise Unsupported(f"unsupported form of an expected list of statuses: {wanted!r}")
        if all(isinstance(one, dict) for one in wanted):
            return [{"goal": name, "status": state} for name, state in pairs]
        if all(isinstance(one, list) for one in wanted):
            return [list(pair) for pair in pairs]
        return [name if set(wanted) <= set(names.values()) else state for name, state in pairs]

    async def seen_checked_statuses(self, wanted: list[str]) -> list[str]:
        return self.checked

    async def seen_result_statuses(self, wanted: list[str]) -> list[str]:
        return [GoalStatus(result.result().status).name.lower() for _, result in self.results]

    async def seen_result_status(self, wanted: Vector | str) -> Vector | str:
        last = {goal.name: GoalStatus(result.result().status).name.lower() for goal, result in self.results}
        return {name: last[name] for name in wanted} if isinstance(wanted, dict) else next(reversed(last.values()))

    async def seen_result_is_default(self, wanted: Any) -> Any:
        last = {goal.name: result.result().result == Fibonacci.Result() for goal, result in self.results}
        return {name: last[name] for name in wanted} if isinstance(wanted, dict) else next(reversed(last.values()))

    async def seen_goals_canceling(self, wanted: list[str]) -> list[str]:
        assert self.canceled is not None
        return [self.name_of(info.goal_id.uuid.tobytes()) for info in self.canceled.goals_canceling]

    async def seen_return_code(self, wanted: str) -> str:
        assert self.canceled is not None
        return CancelCode(self.canceled.return_code).name.lower()

    async def seen_execute_set_state_error(self, wanted: str | None) -> str | None:
        if self.script.execute.states == [
            "canceled"
        ]:  # its body raised one of its own, which must not have canceled it
            ends = {self.status(goal) for goal in self.script.goals.values()}
            return "invalid_transition" if ends == {"aborted"} else None
        return self.script.set_state_error

    async def seen_feedback(self, wanted: Vector) -> Vector:
        seen: dict[str, list[list[int]]] = {name: [] for name in wanted}
        for message in self.feedback.messages:
            seen[self.name_of(message.goal_id.uuid.tobytes())].append(message.feedback.sequence.tolist())
        return seen

    async def seen_feedback_callback_called_for(self, wanted: list[str]) -> list[str]:
        return [name for name, client in self.clients.items() if client.feedback_count]

    async def seen_response_stamp(self, wanted: str) -> str:
        if wanted != "node clock time at acceptance":
            raise Unsupported(f"unsupported stamp {wanted!r}")
        stamps = {goal.name: (goal.stamp, goal.asked_at) for goal in self.script.goals.values() if goal.accepted}
        assert stamps, "no goal was accepted"
        for name, (stamp, asked_at) in stamps.items():
            same(f"stamp of {name}", stamp, asked_at)
        return wanted

    async def seen_rejected_stamp(self, wanted: str) -> str:
        again = next(iter(self.script.goals.values()))
        reply = await self._send(again.id, again.number)  # its id is in use already
        assert not reply.accepted
        return "zero" if reply.stamp == Time() else repr(reply.stamp)

    async def seen_receives_last_status_message(self, wanted: bool) -> bool | None:
        return self.late_subscriber

    async def seen_seconds(self, wanted: float) -> float | None:
        return self.default_timeout


async def play(vector: Vector) -> None:
    """Run one case from the server's start to its end, and compare."""
    script = Script(vector)
    rig = Rig()
    await rig.start(make_server(script))
    try:
        run = Run(script, rig)
        await run.steps()
        await rig.advance(PAUSE)
        if script.skip is not None:
            raise script.skip
        await run.check()
    finally:
        script.over = True
        await rig.close()


def check(vector: Vector) -> None:
    with asyncio.Runner(loop_factory=VirtualLoop) as runner:
        runner.run(play(vector))


def cases(path: Path) -> Iterable[Case]:
    return each(path, check)
