"""The stand-ins of the loop-back scenarios: what comes over is made from bytes, and what ROS 2 has no field for gets lost."""

from __future__ import annotations

import asyncio

import pytest

from actors import CallTimeout, Done, GoalCanceled, GoalRejected, Node, Reject, Service, Steps
from actors.interfaces.errors import CdrError
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.std_srvs.srv import SetBool
from actors.testing import Rig
from tests.loopback import actions, services
from tests.stage import COUNT, order, result, step

SWITCH = Service(SetBool, "switch")


class Server(Node):
    """Keeps what it was given, and what it gave."""

    def __init__(self) -> None:
        self.request: SetBool.Request | None = None
        self.response = SetBool.Response(message="done")
        self.goal: Fibonacci.Goal | None = None
        self.feedback, self.result = step(1), result(1, 2)

    @SWITCH.serve()
    async def switch(self, request: SetBool.Request) -> SetBool.Response:
        self.request = request
        await self.clock.sleep(1.0 if request.data else 0.0)
        return self.response

    @COUNT.accepts
    def check(self, goal: Fibonacci.Goal) -> None:
        if goal.order < 0:
            raise Reject("too few")

    @COUNT.serve()
    async def count(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
        self.goal = goal
        yield self.feedback
        await self.clock.sleep(float(goal.order))
        yield Done(self.result)


@pytest.fixture(autouse=True)
def linked(monkeypatch: pytest.MonkeyPatch) -> None:
    services.install(monkeypatch)
    actions.install(monkeypatch)


async def test_requests_and_responses_are_other_objects_of_the_same_value(rig: Rig) -> None:
    await rig.start(Server)
    request = SetBool.Request()
    response = await rig.call(SWITCH, request)
    server = rig.node(Server)
    assert (server.request, response) == (request, server.response)
    assert server.request is not request
    assert response is not server.response


async def test_a_request_that_cannot_be_encoded_does_not_leave_its_caller(rig: Rig) -> None:
    await rig.start(Server)
    rig.node(Server).response = SetBool.Response(message="\ud800")
    errors: list[object] = []
    asyncio.get_running_loop().set_exception_handler(lambda _, context: errors.append(context["exception"]))
    with pytest.raises(CallTimeout, match="/server did not answer /switch in time"):
        await rig.call(SWITCH, SetBool.Request())
    assert [type(error) for error in errors] == [CdrError]


async def test_a_late_response_is_dropped(rig: Rig) -> None:
    await rig.start(Server)
    with pytest.raises(CallTimeout):
        await rig.call(SWITCH, SetBool.Request(data=True), timeout=0.5)
    await rig.advance(1.0)
    assert (await rig.call(SWITCH, SetBool.Request())).message == "done"


async def test_goals_feedback_and_results_are_other_objects_of_the_same_value(rig: Rig) -> None:
    await rig.start(Server)
    sent = order(1)
    goal = rig.me.start(COUNT, sent)
    async with goal:
        feedback = [one async for one in goal]
        answer = await goal
    server = rig.node(Server)
    assert (server.goal, feedback, answer) == (sent, [server.feedback], server.result)
    assert server.goal is not sent
    assert feedback[0] is not server.feedback
    assert answer is not server.result


async def test_the_reasons_of_a_rejection_and_of_a_cancellation_get_lost(rig: Rig) -> None:
    await rig.start(Server)
    with pytest.raises(GoalRejected) as rejected:
        await rig.start_goal(COUNT, order(-1))
    goal = await rig.start_goal(COUNT, order(5))
    assert await goal.cancel("changed my mind")
    with pytest.raises(GoalCanceled) as canceled:
        await goal
    assert (rejected.value.reason, canceled.value.reason) == ("", "")
