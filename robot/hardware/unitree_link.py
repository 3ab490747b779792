"""Finds a Unitree Go2 by DDS, takes command of it, and gives it back: `command_go2`."""

from __future__ import annotations

import asyncio
import json
import time
from collections import deque
from collections.abc import AsyncGenerator, Callable
from contextlib import asynccontextmanager, suppress
from itertools import count
from typing import Final
from xml.sax.saxutils import quoteattr

import numpy as np

from actors.transport.dds import DdsConfig, RawTopics
from robot.hardware.body import BodySilent
from robot.hardware.unitree import KEPT, Go2
from robot.hardware.unitree_wire import JOINTS
from robot.interfaces.unitree.unitree_api.msg import Request, RequestHeader, RequestIdentity, Response
from robot.interfaces.unitree.unitree_go.msg import LowCmd, LowState
from robot.model.bodies import GO2
from robot.model.kinematics import feet

STATE, COMMAND = "rt/lowstate", "rt/lowcmd"
FIRST: Final = 5.0
"""Seconds in which the first state must come."""
DISCOVERY: Final = 1.0
"""Seconds in which other programs that command the robot are discovered."""
MUTUAL: Final = 0.3
"""Seconds that the other side has to discover us, too: a reader that asks for no retransmission misses what is written before."""
BRAKED: Final = 0.5
"""Seconds for which the drives are commanded to brake at the end."""
ANSWER: Final = 2.0
"""Seconds in which a service of the robot must answer."""
TRIES: Final = 5
STANDING: Final = 0.7
"""A robot whose hips are higher above its feet than this share of the height it stands at is not taken from its own walking service."""
_CHECK_MODE, _SELECT_MODE, _RELEASE_MODE = 1001, 1002, 1003


class Refused(RuntimeError):
    """The robot cannot be commanded as it is; says why, and what to do."""


def config_of(interface: str | None, domain: int) -> DdsConfig:
    """How to enter the robot's domain by one network interface; `None`: the one that Cyclone DDS chooses."""
    if interface is None:
        return DdsConfig(domain=domain)
    uri = (
        "<CycloneDDS><Domain><General><Interfaces>"
        f"<NetworkInterface name={quoteattr(interface)}/></Interfaces></General></Domain></CycloneDDS>"
    )
    return DdsConfig(domain=domain, static_peers=("localhost",) if interface.startswith("lo") else (), uri=uri)


@asynccontextmanager
async def command_go2(config: DdsConfig, *, enable: bool, say: Callable[[str], None]) -> AsyncGenerator[Go2]:
    """The legs of the Go2 in a domain, for as long as the context lasts.

    Without `enable` nothing is sent to it. With it, its own walking service is switched off first, and on again at the end, if it has one
    (`say` tells of it); the drives brake from the beginning to the first targets, and at the end.

    Raises `BodySilent` if no Go2 is heard, `Refused` if it stands or somebody else commands it, `WireUnavailable` without Cyclone DDS.
    """
    async with RawTopics(config) as topics:
        states, robot = deque[LowState](maxlen=1), None
        heard: list[Callable[[LowState], None]] = [states.append]
        topics.reader(STATE, LowState, lambda state: heard[-1](state), depth=KEPT)
        try:
            await _until(lambda: bool(states), "")
        except Refused:
            raise BodySilent(
                f"no Go2 is heard in domain {config.domain} (rt/lowstate): is it switched on, and --interface its network?"
            ) from None
        if not enable:
            robot = Go2(states[0])
            heard.append(robot.take)
            yield robot
            return
        _check_lies(states[0])
        switcher = Service(topics, "motion_switcher")
        mode = await _walking(switcher, say)
        try:
            if mode:
                await _release(switcher, mode, say)
            await asyncio.sleep(DISCOVERY)
            if topics.writers(COMMAND):
                raise Refused("another program commands the Go2 (it writes rt/lowcmd): end it, and start again")
            writer = topics.writer(COMMAND, LowCmd)
            await _until(
                lambda: writer.matched > 0, "the Go2 does not listen to rt/lowcmd: it takes no commands for its joints"
            )
            robot = Go2(states[0], writer.write, lambda: topics.writers(COMMAND))
            heard.append(robot.take)
            robot.brake()
            yield robot
        finally:
            if robot is not None:
                for _ in range(round(BRAKED * 100)):
                    robot.brake()
                    await asyncio.sleep(0.01)
            if mode:
                await _give_back(switcher, mode, say)


async def _until(condition: Callable[[], bool], otherwise: str, seconds: float = FIRST) -> None:
    """Wait until it is so. Raises `Refused` with `otherwise`."""
    try:
        async with asyncio.timeout(seconds):
            while not condition():
                await asyncio.sleep(0.01)
    except TimeoutError:
        raise Refused(otherwise) from None


def _check_lies(state: LowState) -> None:
    """Refuse a robot that stands: it would drop."""
    angles = np.array([motor.q for motor in state.motor_state[:12]])[JOINTS]
    if -feet(angles, GO2)[:, 2].mean() > STANDING * GO2.stand_height and any(state.foot_force):
        raise Refused(
            "the Go2 stands: have it lie down by its remote control before its own walking service is switched off"
        )


async def _walking(switcher: Service, say: Callable[[str], None]) -> str:
    """The name of the robot's own walking service; empty if none is on."""
    if await switcher.there():
        return await _mode(switcher)
    say("the Go2 has no motion_switcher service, as a simulator: nothing to switch off")
    return ""


async def _release(switcher: Service, mode: str, say: Callable[[str], None]) -> None:
    """Switch the robot's own walking off. Raises `Refused` if it stays on."""
    for _ in range(TRIES):
        await switcher.call(_RELEASE_MODE)
        if not await _mode(switcher):
            say(f"the Go2's own walking service {mode!r} is switched off")
            return
    raise Refused(f"the Go2's own walking service {mode!r} does not switch off: end it in Unitree's app")


async def _give_back(switcher: Service, mode: str, say: Callable[[str], None]) -> None:
    """Switch the robot's own walking on again."""
    try:
        await switcher.call(_SELECT_MODE, name=mode)
        say(f"the Go2's own walking service {mode!r} is switched on again")
    except Refused as error:
        say(f"the Go2's own walking service {mode!r} stays off ({error}): switch the robot off and on")


async def _mode(switcher: Service) -> str:
    try:
        told = json.loads(await switcher.call(_CHECK_MODE))
        return str(told["name"])[:80]
    except (ValueError, RecursionError, TypeError, KeyError):
        raise Refused("the Go2's motion_switcher service answers what is not understood") from None


class Service:
    """One of the robot's own services: requests and responses on two topics."""

    def __init__(self, topics: RawTopics, name: str) -> None:
        self._name = name
        self._requests = topics.writer(f"rt/api/{name}/request", Request)
        self._numbers = count(time.monotonic_ns())
        self._waiting: dict[int, asyncio.Future[Response]] = {}
        topics.reader(f"rt/api/{name}/response", Response, self._answered, depth=10)

    async def there(self) -> bool:
        """Whether it is found within a second."""
        with suppress(Refused):
            await _until(lambda: self._requests.matched > 0, "", DISCOVERY)
            await asyncio.sleep(MUTUAL)
        return self._requests.matched > 0

    async def call(self, api: int, **parameters: str) -> str:
        """What it answers to a call of its API `api`. Raises `Refused` if it refuses, or does not answer."""
        number = next(self._numbers)
        answer = self._waiting[number] = asyncio.get_running_loop().create_future()
        header = RequestHeader(identity=RequestIdentity(id=number, api_id=api))
        self._requests.write(Request(header=header, parameter=json.dumps(parameters)))
        try:
            response: Response = await asyncio.wait_for(answer, ANSWER)
        except TimeoutError:
            raise Refused(f"the Go2's service {self._name} does not answer within {ANSWER:g} s") from None
        finally:
            del self._waiting[number]
        if (code := response.header.status.code) != 0:
            raise Refused(f"the Go2's service {self._name} refuses call {api} with code {code}")
        data: str = response.data
        return data

    def _answered(self, response: Response) -> None:
        answer = self._waiting.get(response.header.identity.id)
        if answer is not None and not answer.done():
            answer.set_result(response)
