"""Services by way of bytes: that they are, and every scenario of services and restarts once more."""

from __future__ import annotations

import asyncio

import pytest

from actors import CallTimeout, Node, Service
from actors.interfaces.errors import CdrError
from actors.interfaces.std_srvs.srv import SetBool
from actors.testing import Rig
from tests.actors.services import test_services
from tests.actors.supervision import test_restarts
from tests.loopback import borrowed, services

SWITCH = Service(SetBool, "switch")


class Server(Node):
    """Keeps what it was asked, and what it answered."""

    def __init__(self) -> None:
        self.request: SetBool.Request | None = None
        self.response = SetBool.Response(message="done")

    @SWITCH.serve()
    async def switch(self, request: SetBool.Request) -> SetBool.Response:
        self.request = request
        await self.clock.sleep(1.0 if request.data else 0.0)
        return self.response


@pytest.fixture(autouse=True)
def linked(monkeypatch: pytest.MonkeyPatch) -> None:
    services.install(monkeypatch)


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


TAKEN_BACK = "no message of ROS 2 takes back a request"
CAUSE = "the error itself does not leave its process, only its type and text"
CYCLE = "who waits for whom is known in one process only"
LOCAL = {
    "test_a_caller_that_is_canceled_is_forgotten_its_request_is_not_worked_for_nobody": TAKEN_BACK,
    "test_an_exception_in_the_handler_is_that_callers_the_server_lives": CAUSE,
    "test_a_cycle_of_calls_is_refused_at_once_and_named": CYCLE,
    "test_two_handlers_that_call_each_other_at_the_same_time_are_a_cycle_too": CYCLE,
    "test_a_node_that_calls_itself_while_it_starts_or_stops_is_told_so": CYCLE,
    "test_a_handler_that_starts_a_goal_of_its_own_node_is_told_so": CYCLE,
}
"""Scenario tests that a wire with the messages of ROS 2 cannot carry, and why."""

for module, but in ((test_services, LOCAL), (test_restarts, {})):
    tests = borrowed(module, but=but)
    assert not tests.keys() & globals().keys()
    globals().update(tests)
