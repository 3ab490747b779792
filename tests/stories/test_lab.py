"""The lab of three nodes in three processes (X-09, DDS-07): its checklist, and a planner that is stopped and started again."""

from __future__ import annotations

import asyncio

import pytest

from actors import System
from robot.tutorials.humanoid_lab import MOTOR_COMMANDS, SENSOR_DATA
from tests.stories.conftest import Start, nodes, until

pytestmark = pytest.mark.realtime

LAB = ("robot.tutorials", "humanoid_lab", "--log-level", "debug", "--only")


def edges(system: System, topic: str) -> tuple[set[str], set[str]]:
    """The nodes that publish a topic, and those of the lab that take it."""
    view = next(one for one in system.snapshot().topics if one.name == topic)
    taking = {edge.node for edge in view.subscriptions} - {"/observer"}
    return {edge.node for edge in view.publishers}, taking


async def counted(observer: System, seconds: float) -> tuple[int, int]:
    """How many readings and motor commands pass within so many seconds."""
    me = observer.node("observer")
    async with me.subscribe(SENSOR_DATA) as readings, me.subscribe(MOTOR_COMMANDS) as commands:
        numbers = [0, 0]

        async def count(stream: object, which: int) -> None:
            async for _ in stream:  # type: ignore[attr-defined]
                numbers[which] += 1

        tasks = [asyncio.ensure_future(count(stream, which)) for which, stream in enumerate((readings, commands))]
        await asyncio.sleep(seconds)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
    return numbers[0], numbers[1]


async def test_the_checklist_holds_for_three_processes(start: Start, observer: System) -> None:
    programs = [await start(*LAB, name) for name in ("sensor_simulator", "planner", "motor_controller")]
    await until(observer, lambda: {"/sensor_simulator", "/planner", "/motor_controller"} <= nodes(observer))
    await programs[2].says("Published motor commands")

    readings, commands = await counted(observer, 35.0)

    assert abs(readings - 350) <= 4
    assert abs(commands - 17) <= 1
    assert abs(sum("Received sensor data" in line for line in programs[1].lines) - readings) <= 60  # before and after
    assert edges(observer, "/sensor/data") == ({"/sensor_simulator"}, {"/planner"})
    assert edges(observer, "/motor/commands")[0] == {"/motor_controller"}
    service = next(one for one in observer.snapshot().services if one.name == "/plan_trajectory")
    assert (service.server, service.clients) == ("/planner", ("/motor_controller",))
    assert [line for program in programs for line in program.lines if "[error" in line or "[warning" in line] == []


async def test_a_planner_that_is_killed_and_started_again_is_asked_again_and_nobody_else_restarts(
    start: Start, observer: System
) -> None:
    sensor, planner, motors = [await start(*LAB, name) for name in ("sensor_simulator", "planner", "motor_controller")]
    await motors.says("Published motor commands")

    await planner.kill()
    await until(observer, lambda: "/planner" not in nodes(observer))
    await motors.says("Planner service not available, waiting...")
    since = len(motors.lines)
    again = await start(*LAB, "planner")

    await motors.says("Published motor commands", since)
    await again.says("Received sensor data")
    assert sensor.process.returncode is None and motors.process.returncode is None
    assert not [line for program in (sensor, motors) for line in program.lines if "restart" in line]
