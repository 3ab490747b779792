"""A process is killed from outside, by its id: its node comes back in another one, and its topics find their other ends again."""

from __future__ import annotations

import asyncio
import os
import signal

import pytest

from actors import Child, Node, Service, Supervisor, System, Topic, every, publishes
from actors.interfaces.std_msgs.msg import Int64
from actors.interfaces.std_srvs.srv import Trigger, Trigger_Request, Trigger_Response
from tests.actors.processes.kit import running, until

pytestmark = pytest.mark.realtime

PROCESSES, STEPS = Topic(Int64, "processes", 10), Topic(Int64, "steps", 10)
PING = Service(Trigger, "ping")


class Sensor(Node):
    """Publishes the id of its process, twenty times a second; takes steps; serves ping."""

    out = publishes(PROCESSES)
    steps = 0

    @every(hz=20)
    def tell(self) -> None:
        self.out(Int64(data=os.getpid()))

    @STEPS.on()
    def step(self, message: Int64) -> None:
        self.steps += message.data

    @PING.serve()
    async def ping(self, request: Trigger_Request) -> Trigger_Response:
        return Trigger.Response(success=True, message=str(self.steps))


class Brain(Node):
    """Hears the sensor, and sends it steps."""

    out = publishes(STEPS)

    def __init__(self) -> None:
        self.heard: list[int] = []

    @PROCESSES.on()
    def hear(self, message: Int64) -> None:
        self.heard.append(message.data)


async def steps_of(brain: Brain) -> int:
    return int((await brain.call(PING, Trigger.Request(), timeout=10.0)).message)


async def both_ways(system: System, pid: int) -> None:
    """Wait until the brain hears the sensor of this process, and the sensor the brain."""
    brain = system.node(Brain)
    await until(lambda: pid in brain.heard[-1:], f"the sensor in process {pid} is heard")
    before = await steps_of(brain)
    brain.out(Int64(data=1))
    async with asyncio.timeout(30):
        while await steps_of(brain) == before:
            await asyncio.sleep(0.01)


async def test_a_killed_process_is_replaced_and_its_topics_and_services_are_matched_again() -> None:
    async with running(Supervisor("top", children=[Child(Brain), Child(Sensor, process=True)])) as system:
        first = system.nodes["top", "sensor"].process
        assert first != os.getpid()
        await both_ways(system, first)

        os.kill(first, signal.SIGKILL)
        await until(lambda: system.nodes["top", "sensor"].process not in (0, first), "there is another process")

        await both_ways(system, system.nodes["top", "sensor"].process)
        assert system.nodes["top", "sensor"].incarnation == 2
        assert system.nodes["top", "brain"].incarnation == 1
