"""What is seen of a script of `action_status`, and compared with what the case expects."""

from __future__ import annotations

import asyncio
from abc import ABC, abstractmethod
from typing import Any

from actors.actions.goals import CancelCode, GoalStatus
from actors.interfaces.action_msgs.srv import CancelGoal
from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.example_interfaces.action import Fibonacci
from tests.conformance.checks.action_script import Goal, Script
from tests.conformance.checks.common import Unsupported, Vector, same
from tests.conformance.crossing import Sent


class Seen(ABC):
    """What came of a script; `seen_NAME` answers to the expectation NAME, in the form in which it is wanted."""

    script: Script
    statuses: Any
    feedback: Any
    clients: dict[str, Sent]
    accepted: list[tuple[Goal, bool]]
    untold: dict[str, str]
    results: list[tuple[Goal, asyncio.Task[Any]]]
    canceled: CancelGoal.Response | None
    checked: list[str]
    counts: list[int]
    late_subscriber: bool | None
    default_timeout: float | None

    @abstractmethod
    async def tracked(self) -> int:
        """How many of the goals the server remembers."""

    @abstractmethod
    async def send(self, goal_id: bytes, order: int) -> Any:
        """Send a goal request; its answer."""

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
        return [accepted for _, accepted in self.accepted]

    async def seen_client_goal_handle_status_before_any_status_message(self, wanted: Any) -> Any:
        if isinstance(wanted, dict):
            return {name: self.untold[name] for name in wanted}
        return self.untold_status()

    def untold_status(self, goal: str | None = None) -> str:
        """The status of a client's goal, of the last one if none is named, before the server has said anything about it."""
        return self.untold[goal or next(reversed(self.untold))]

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
        accepted = [goal for goal in self.script.goals.values() if goal.accepted]
        assert accepted, "no goal was accepted"
        for goal in accepted:  # in one system no time passes from the question to the answer
            first, stamp, last = ((at.sec, at.nanosec) for at in (goal.asked_at, goal.stamp, goal.answered_at))
            assert first <= stamp <= last, f"stamp of {goal.name}: {goal.stamp}, wanted {first} to {last}"
        return wanted

    async def seen_rejected_stamp(self, wanted: str) -> str:
        again = next(iter(self.script.goals.values()))
        reply = await self.send(again.id, again.number)  # its id is in use already
        assert not reply.accepted
        return "zero" if reply.stamp == Time() else repr(reply.stamp)

    async def seen_receives_last_status_message(self, wanted: bool) -> bool | None:
        return self.late_subscriber

    async def seen_seconds(self, wanted: float) -> float | None:
        return self.default_timeout
