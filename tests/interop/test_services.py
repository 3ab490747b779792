"""Services between our nodes and those of zenoh-ros2-sdk and pyzeros, both ways.

Neither can use a service if the SDK's registry finds an empty request or response in it (`std_srvs/srv/Trigger`): the SDK refuses it.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from typing import Any

import pytest

from actors import CallTimeout, Service, ServiceFailed, ServiceUnavailable
from actors.errors import NotRunning
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_srvs.srv import SetBool, Trigger
from tests.interop.parties import Ours, Program, until

pytestmark = [pytest.mark.interop, pytest.mark.realtime]

StartProgram = Callable[[str], Awaitable[Program]]
PROGRAMS = ("with_zenoh_ros2_sdk", "with_pyzeros")
every_program = pytest.mark.parametrize("program", PROGRAMS)
ADD = Service(AddTwoInts, "/math/add")
SWITCH = Service(SetBool, "/switch")
POKE = Service(Trigger, "/poke")


async def add(request: AddTwoInts.Request) -> AddTwoInts.Response:
    if request.a < 0:
        raise ValueError("too small")
    return AddTwoInts.Response(sum=request.a + request.b)


async def switch(request: SetBool.Request) -> SetBool.Response:
    return SetBool.Response(success=request.data, message="größer")


async def _known(ours: Ours, there: Program, service: str) -> None:
    """The SDK's client does not wait for a server."""
    if there.name == "with_zenoh_ros2_sdk":
        while not (info := await there.do("service_info", service=service)) or not info["server_count"]:
            pass


@every_program
async def test_they_call_our_services(program: str, ours: Ours, start: StartProgram) -> None:
    ours.node.serve(ADD, add)
    ours.node.serve(SWITCH, switch)
    there = await start(program)
    for service in (ADD, SWITCH):
        await _known(ours, there, service.name)
        await there.do("client", service=service.name, type=service.type.__ros_type__, timeout=30.0)

    sums = [await there.do("call", service="/math/add", request={"a": a, "b": 2**40}) for a in (1, 2, 2**62)]
    assert sums == [{"sum": a + 2**40} for a in (1, 2, 2**62)]
    for on in (True, False):
        answer = await there.do("call", service="/switch", request={"data": on})
        assert answer == {"success": on, "message": "größer"}


async def test_pyzeros_calls_a_service_without_request_fields(ours: Ours, start: StartProgram) -> None:
    async def poke(request: Trigger.Request) -> Trigger.Response:
        return Trigger.Response(success=True, message="poked")

    ours.node.serve(POKE, poke)
    there = await start("with_pyzeros")
    await there.do("client", service="/poke", type="std_srvs/srv/Trigger", timeout=30.0)
    assert await there.do("call", service="/poke", request={}) == {"success": True, "message": "poked"}


async def test_the_sdk_refuses_a_service_without_request_fields(ours: Ours, start: StartProgram) -> None:
    there = await start("with_zenoh_ros2_sdk")
    with pytest.raises(AssertionError, match="Trigger_Request not found in registry"):
        await there.do("client", service="/poke", type="std_srvs/srv/Trigger", timeout=30.0)


async def test_neither_can_use_a_service_with_a_list_of_messages(ours: Ours, start: StartProgram) -> None:
    """The SDK looks for a type of the same package among the services, pyzeros leaves such a field out and so has another hash."""
    service, type = "/ours/robot/get_parameters", "rcl_interfaces/srv/GetParameters"
    sdk, pyzeros = await start("with_zenoh_ros2_sdk"), await start("with_pyzeros")
    await _known(ours, sdk, service)
    await sdk.do("client", service=service, type=type, timeout=5.0)
    assert await sdk.do("call", service=service, request={"names": ["use_sim_time"]}) is None
    with pytest.raises(AssertionError, match="TimeoutError"):
        await pyzeros.do("client", service=service, type=type, timeout=1.0)


@every_program
async def test_an_error_of_our_handler_is_told_where_the_response_has_a_field_for_it(
    program: str, ours: Ours, start: StartProgram
) -> None:
    async def broken(request: SetBool.Request) -> SetBool.Response:
        raise ValueError("no such switch")

    ours.node.serve(SWITCH, broken)
    there = await start(program)
    await _known(ours, there, SWITCH.name)
    await there.do("client", service=SWITCH.name, type=SWITCH.type.__ros_type__, timeout=30.0)

    answer = await there.do("call", service=SWITCH.name, request={"data": True})
    assert answer == {
        "success": False,
        "message": "/ours/robot failed to serve the request: ValueError: no such switch",
    }


async def test_an_error_of_our_handler_leaves_the_sdk_without_an_answer_where_it_has_none(
    ours: Ours, start: StartProgram
) -> None:
    ours.node.serve(ADD, add)
    there = await start("with_zenoh_ros2_sdk")
    await _known(ours, there, "/math/add")
    await there.do("client", service="/math/add", type="example_interfaces/srv/AddTwoInts", timeout=1.0)

    assert await there.do("call", service="/math/add", request={"a": -1, "b": 1}) is None
    assert await there.do("call", service="/math/add", request={"a": 1, "b": 1}) == {"sum": 2}


@every_program
async def test_we_call_their_services(program: str, ours: Ours, start: StartProgram) -> None:
    there = await start(program)
    await there.do("server", service="/math/add", type="example_interfaces/srv/AddTwoInts", answers={})
    answers = {"success": True, "message": "größer"}
    await there.do("server", service="/switch", type="std_srvs/srv/SetBool", answers=answers)

    for a in (6, 7, 2**62):
        assert await ours.node.call(ADD, AddTwoInts.Request(a=a, b=-5), timeout=30.0) == AddTwoInts.Response(sum=a - 5)
    assert await ours.node.call(SWITCH, SetBool.Request(data=True), timeout=30.0) == SetBool.Response(**answers)
    assert (await there.until("asked", service="/switch"))["request"] == {"data": True}


@every_program
async def test_calls_of_several_clients_each_get_their_own_answer(
    program: str, ours: Ours, start: StartProgram
) -> None:
    there = await start(program)
    await there.do("server", service="/math/add", type="example_interfaces/srv/AddTwoInts", answers={})
    await ours.node.wait_for(ADD, timeout=30.0)

    # a server of pyzeros drops what it has no room for beyond 10
    requests = [AddTwoInts.Request(a=number, b=1) for number in range(8)]
    answers = await asyncio.gather(*(ours.node.call(ADD, one, timeout=30.0) for one in requests))

    assert [answer.sum for answer in answers] == list(range(1, 9))


async def test_an_error_of_the_sdk_reaches_our_caller_with_its_text(ours: Ours, start: StartProgram) -> None:
    there = await start("with_zenoh_ros2_sdk")
    await there.do("server", service="/math/add", type="example_interfaces/srv/AddTwoInts", answers={})
    with pytest.raises(ServiceFailed, match="Service callback error: too small"):
        await ours.node.call(ADD, AddTwoInts.Request(a=-3, b=1), timeout=30.0)


@every_program
async def test_a_server_that_does_not_answer_is_named_and_so_is_one_that_is_killed(
    program: str, ours: Ours, start: StartProgram
) -> None:
    there = await start(program)
    await there.do("server", service="/math/add", type="example_interfaces/srv/AddTwoInts", answers={})
    await ours.node.wait_for(ADD, timeout=30.0)
    name = {"with_zenoh_ros2_sdk": "/sdk_server", "with_pyzeros": "/third/pyzeros_node"}[program]

    def view() -> Any:
        return next(view for view in ours.system.snapshot().services if view.name == "/math/add")

    with pytest.raises(CallTimeout, match=f"{name} did not answer /math/add in time"):
        await ours.node.call(ADD, AddTwoInts.Request(a=0, b=0), timeout=0.5)
    call = asyncio.create_task(ours.node.call(ADD, AddTwoInts.Request(a=0, b=0), timeout=60.0))
    await until(lambda: view().open == 1, "the request is sent")
    there.process.kill()
    with pytest.raises(NotRunning, match=name):
        await call
    await until(lambda: name not in ours.nodes(), "its node has gone")
    with pytest.raises((ServiceUnavailable, NotRunning)):
        await ours.node.call(ADD, AddTwoInts.Request(a=0, b=0), timeout=0.1)
