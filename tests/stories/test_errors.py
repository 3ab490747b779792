"""What a caller is told when a process that serves it fails, is killed, or asks back: errors that name the peer."""

from __future__ import annotations

import asyncio

import pytest

from actors import CallTimeout, GoalAborted, ServiceFailed, System
from actors.errors import NotRunning
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.std_srvs.srv import Trigger
from tests.stories.conftest import Start
from tests.stories.programs import COUNT, PING, PONG, SLOW

pytestmark = pytest.mark.realtime

PROGRAMS = "tests.stories.programs"


async def test_a_cycle_of_calls_over_two_processes_ends_at_once_and_is_named(start: Start, observer: System) -> None:
    await start(PROGRAMS, "ping")
    await start(PROGRAMS, "pong")
    me = observer.node("observer")
    await me.wait_for(PING, timeout=20.0)
    await me.wait_for(PONG, timeout=20.0)

    async with asyncio.timeout(10.0):  # the calls themselves would take 20 s
        answer = await me.call(PING, Trigger.Request(), timeout=30.0)

    assert answer.message.startswith(
        "CallCycle: this call can never be answered: /ping waits for /pong waits for /ping; "
    )


async def test_a_killed_server_ends_a_call_and_a_goal_with_errors_that_name_it(start: Start, observer: System) -> None:
    server = await start(PROGRAMS, "slow")
    me = observer.node("observer")
    await me.wait_for(SLOW, timeout=20.0)
    await me.wait_for(COUNT, timeout=20.0)
    call = asyncio.create_task(me.call(SLOW, Trigger.Request(), timeout=60.0))
    with pytest.raises(GoalAborted) as aborted:
        async with me.send_goal(COUNT, Fibonacci.Goal(order=5)) as goal:
            await server.says("asked")
            await anext(aiter(goal))
            await server.kill()
            async with asyncio.timeout(1.0):
                with pytest.raises(NotRunning) as pending:
                    await call
                await goal
    assert str(pending.value) == (
        "/slow, which serves /slow, has ended or is lost, and has not answered: ask again when it is back"
    )
    assert aborted.value.reason == "/slow ended or was lost while the goal ran"
    with pytest.raises(
        NotRunning, match=r"^/slow, which served /slow, has stopped: start it again, or ask another service$"
    ):
        await me.call(SLOW, Trigger.Request())


async def test_a_handler_that_fails_and_one_that_is_late_are_named(start: Start, observer: System) -> None:
    await start(PROGRAMS, "slow")
    me = observer.node("observer")
    await me.wait_for(SLOW, timeout=20.0)
    await me.wait_for(PING, timeout=20.0)

    with pytest.raises(ServiceFailed) as failed:
        await me.call(PING, Trigger.Request())
    with pytest.raises(CallTimeout) as late:
        await me.call(SLOW, Trigger.Request(), timeout=0.2)

    assert "/slow" in str(failed.value) and "OSError" in str(failed.value) and "no such port" in str(failed.value)
    assert all(part in str(late.value) for part in ("/slow", "in time", "make it an action"))
