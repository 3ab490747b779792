"""Vectors of `action_status`: scripts for an action server, run on the virtual clock against a real one, over its five ROS endpoints.

How a script becomes a node is told in `action_script`.
"""

from __future__ import annotations

import asyncio
from collections.abc import Iterable
from pathlib import Path
from typing import Any, Final

from actors import Service, Topic, qos
from actors.goal_client import Goal as Client
from actors.goals import CancelCode, GoalStatus
from actors.interfaces import derived
from actors.interfaces.action_msgs.msg import GoalInfo, GoalStatusArray
from actors.interfaces.action_msgs.srv import CancelGoal
from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.unique_identifier_msgs.msg import UUID
from actors.testing import Rig, VirtualLoop
from tests.conformance.checks.action_script import BLOCKER, COUNT, Goal, Script, make_server
from tests.conformance.checks.common import Case, Skip, Vector, each, same

STATUS: Final = Topic(GoalStatusArray, "/fibonacci/_action/status", qos.ACTION_STATUS)
FEEDBACK: Final[Topic[Any]] = Topic(
    derived.feedback_message(Fibonacci), "/fibonacci/_action/feedback", qos.ACTION_FEEDBACK
)
SEND_GOAL: Final = Service(derived.send_goal_service(Fibonacci), "/fibonacci/_action/send_goal")
GET_RESULT: Final = Service(derived.get_result_service(Fibonacci), "/fibonacci/_action/get_result")
CANCEL: Final = Service(CancelGoal, "/fibonacci/_action/cancel_goal")

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
        self.results: list[tuple[Goal, asyncio.Task[Any]]] = []
        self.canceled: CancelGoal.Response | None = None
        self.checked: list[str] = []
        self.counts: list[int] = []
        self.late_subscriber: bool | None = None
        self.default_timeout: float | None = None

    async def steps(self) -> None:
        await self.rig.advance(1.5)  # so that a stamp is not zero by chance
        if self.script.deferred and not self.script.held:
            await self._send(b"blocker".ljust(16, b"\0"), BLOCKER)
        for step in self.script.steps:
            act = getattr(self, f"op_{step['op']}", None)
            if act is None:
                raise Skip(f"there is no way to express the step {step['op']!r}")
            await act(**{name: value for name, value in step.items() if name not in ("op", "expect")})
            await self.rig.advance(PAUSE)
        for _, result in self.results:
            await result

    # -- what a step does ---------------------------------------------------------------------------------------------------

    async def op_goal_request(self, goal: str, goal_callback: str = "default") -> None:
        one = self.script.goal(goal)
        one.policy = goal_callback
        one.asked_at = self.rig.system.clock.stamp()
        if "feedback_callback_called_for" in self.script.expect:
            self.clients[goal] = client = await self.rig.start_goal(COUNT, Fibonacci.Goal(order=one.number))
            one.id, one.accepted = client.goal_id, True
            return
        reply = await self._send(one.id, one.number)
        one.accepted, one.stamp = reply.accepted, reply.stamp

    async def op_cancel_request(self, goal: str | None, cancel_callback: str = "default", stamp_ns: int = 0) -> None:
        if cancel_callback == "default":
            raise Skip(
                "by design goals can be canceled unless an @ACTION.cancels method refuses; rclpy refuses by default"
            )
        for one in self.script.goals.values():
            one.cancel_policy = cancel_callback
        self.canceled = await self._cancel(bytes(16) if goal is None else self.script.goal(goal).id, stamp_ns)

    async def op_get_result(self, goal: str, **more: bool) -> None:
        one = self.script.goal(goal)
        request = GET_RESULT.request(goal_id=UUID(uuid=one.id))
        result = asyncio.create_task(self.rig.call(GET_RESULT, request, timeout=PATIENCE))
        self.results.append((one, result))
        if not more.get("async"):
            await asyncio.wait([result])

    async def op_signal(self, goal: str) -> None:
        one = self.script.goal(goal)
        early = [result for asker, result in self.results if asker is one and result.done()]
        assert not early, "a result was handed out before the goal had ended"
        one.signal.set()

    async def op_execute(self, goal: str) -> None:
        self.script.goal(goal).released.set()
        self.script.go_on.set()

    async def op_publish_feedback(self, goal: str, value: list[int]) -> None:
        self.script.goal(goal).orders.put_nowait(value)

    async def op_wait_sec(self, seconds: float) -> None:
        await self.rig.advance(seconds)

    async def op_count_tracked(self) -> None:
        self.counts.append(await self.tracked())

    async def op_check_status(self, goal: str) -> None:
        self.checked.append(self.status(self.script.goal(goal)))

    async def op_new_status_subscription(self) -> None:
        late = self.rig.probe(STATUS)
        self.late_subscriber = late.last is not None and late.last == self.statuses.last

    async def op_default_result_timeout(self) -> None:
        server = self.rig.state("server").mailbox.actions[COUNT.name]
        self.default_timeout = server.table.result_timeout_ns / 1e9

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
            answer = getattr(self, f"seen_{name}", None)
            if answer is None:
                raise Skip(f"there is no check for the expectation {name!r}")
            wanted = self.script.expect[name]
            same(name, await answer(wanted), wanted)

    async def seen_goal_accepted(self, wanted: Vector) -> Vector:
        return {name: self.script.goal(name).accepted for name in wanted}

    async def seen_execute_called(self, wanted: bool) -> bool:
        return bool(self.script.executed)

    async def seen_tracked_goals(self, wanted: int) -> int:
        return await self.tracked()

    async def seen_tracked_counts(self, wanted: list[int]) -> list[int]:
        return self.counts

    async def seen_status_on_execute_entry(self, wanted: str) -> str:
        return self.script.status_on_entry

    async def seen_status_sequence(self, wanted: Vector) -> Vector:
        return {name: [one for one in self.sequence(self.script.goal(name)) if one != "accepted"] for name in wanted}

    async def seen_status(self, wanted: Vector) -> Vector:
        return {name: self.status(self.script.goal(name)) for name in wanted}

    async def seen_checked_statuses(self, wanted: list[str]) -> list[str]:
        return self.checked

    async def seen_result_statuses(self, wanted: list[str]) -> list[str]:
        return [GoalStatus(result.result().status).name.lower() for _, result in self.results]

    async def seen_result_status(self, wanted: Vector | str) -> Vector | str:
        last = {goal.name: GoalStatus(result.result().status).name.lower() for goal, result in self.results}
        return {name: last[name] for name in wanted} if isinstance(wanted, dict) else next(reversed(last.values()))

    async def seen_result_is_default(self, wanted: Vector) -> Vector:
        last = {goal.name: result.result().result == Fibonacci.Result() for goal, result in self.results}
        return {name: last[name] for name in wanted}

    async def seen_goals_canceling(self, wanted: list[str]) -> list[str]:
        assert self.canceled is not None
        return [self.name_of(info.goal_id.uuid.tobytes()) for info in self.canceled.goals_canceling]

    async def seen_return_code(self, wanted: str) -> str:
        assert self.canceled is not None
        return CancelCode(self.canceled.return_code).name.lower()

    async def seen_execute_set_state_error(self, wanted: str | None) -> str | None:
        if self.script.states == [
            "canceled"
        ]:  # its body raised a cancellation: it must not have become a canceled goal
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
            raise Skip(f"there is no check for the stamp {wanted!r}")
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
