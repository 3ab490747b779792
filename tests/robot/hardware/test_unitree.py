"""A Go2 by DDS: its bytes, and the whole robot around a simulated one at the other end of the wire."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from itertools import count
from typing import TypeVar

import numpy as np
import pytest

from actors import Child, Node, SupervisorGaveUp, every
from actors.interfaces.geometry_msgs.msg import Twist, Vector3
from actors.interfaces.std_srvs.srv import Trigger
from actors.testing import Rig
from robot.contracts import SIT, STAND, TELEOP_CMD, WALK
from robot.hardware.battery import SupplyStatus
from robot.hardware.body import BodySilent, MotorTargets
from robot.hardware.devices import Equipment
from robot.hardware.unitree import Go2, Go2Battery
from robot.hardware.unitree_wire import FootContacts, command_of, crc_of, damping
from robot.interfaces.unitree.unitree_go.msg import BmsState, IMUState, LowCmd, LowState, MotorCmd, MotorState
from robot.model.bodies import GO2
from robot.model.kinematics import inverse
from robot.model.stance import nominal_feet
from robot.tree import tree_of

pytest.importorskip("cyclonedds")
pytest.importorskip("mujoco")

from actors.transport.dds import DdsConfig, RawTopics
from robot.hardware.unitree_link import Refused, command_go2
from tests.robot.hardware.go2 import SimulatedGo2

T = TypeVar("T")
_domains = count(120)
RAMP = [MotorCmd(mode=1, q=0.1 * i, dq=-0.2 * i, tau=0.5 * i, kp=60.0, kd=5.0) for i in range(12)]


@pytest.mark.parametrize(
    ("command", "crc"),
    [
        (LowCmd(), 0x4B5A4880),
        (
            LowCmd(head=(0xFE, 0xEF), level_flag=0xFF, motor_cmd=[MotorCmd(mode=1, q=2.146e9, dq=16000.0)] * 20),
            0x6E577CD,
        ),
        (LowCmd(head=(0xFE, 0xEF), level_flag=0xFF, motor_cmd=[*RAMP, *[MotorCmd()] * 8]), 0xD668DBB5),
    ],
)
def test_the_check_sum_is_that_of_the_makers_library(command: LowCmd, crc: int) -> None:
    """The numbers are those of `crc32_core` in unitree_sdk2_python's library for the same structures."""
    assert crc_of(command) == crc


def state(**more: object) -> LowState:
    motors = [MotorState(q=float(i), dq=10.0 + i, tau_est=20.0 + i, temperature=30 + i) for i in range(12)]
    return LowState(motor_state=[*motors, *[MotorState()] * 8], foot_force=(1, 2, 3, 4)).replace(**more)


def test_each_joint_and_foot_has_its_place_on_the_wire_and_back() -> None:
    go2 = Go2(state())
    assert go2.joints().position.tolist() == [3, 4, 5, 0, 1, 2, 9, 10, 11, 6, 7, 8]
    assert go2.joints().effort[0] == 23.0 and go2.actuators().temperature[3] == 30.0
    hips = np.array((0.1, 0.5, -1.5, 0.2, 0.6, -1.6, 0.3, 0.7, -1.7, 0.4, 0.8, -1.8))
    command = command_of(MotorTargets(hips, *np.zeros((4, 12))), GO2)
    assert [round(motor.q, 6) for motor in command.motor_cmd[:4]] == [0.2, 0.6, -1.6, 0.1]
    feet = FootContacts()
    feet.contact(np.zeros(4), 0.0)
    assert feet.contact(np.array((0.0, 80.0, 0.0, 0.0)), 0.01).tolist() == [False, True, False, False]


def test_feet_that_read_nothing_feel_nothing() -> None:
    assert Go2(state()).capabilities.contacts
    assert not Go2(state(foot_force=(0, 0, 0, 0))).capabilities.contacts


def test_no_command_goes_beyond_the_joints() -> None:
    far = command_of(MotorTargets(np.full(12, 9.0), np.zeros(12), np.full(12, -500.0), np.zeros(12), np.zeros(12)), GO2)
    assert far.motor_cmd[0].q == pytest.approx(1.0472) and far.motor_cmd[0].tau == pytest.approx(-23.7)
    assert far.motor_cmd[2].tau == pytest.approx(-45.43)


def test_a_foot_finds_the_zero_of_its_sensor() -> None:
    feet = FootContacts()
    assert not feet.contact(np.full(4, 55.0), 0.0).any()  # it lies, with some weight on its feet
    assert not feet.contact(np.full(4, 30.0), 0.1).any()
    for at in range(600):
        assert feet.contact(np.full(4, 60.0), 0.2 + at / 10).all()  # a minute on its feet does not become the zero
    assert feet.contact(np.full(4, 45.0), 61.0).all()
    assert not feet.contact(np.full(4, 40.0), 61.1).any()


def test_without_targets_it_brakes_and_after_a_silence_it_stays_so() -> None:
    sent: list[LowCmd] = []
    go2 = Go2(state(), sent.append)
    go2.sample(200.0)
    ours = MotorTargets(*np.zeros((5, 12)))
    for tick in range(1, 41):
        go2.take(state())
        go2.take(state())
        go2.advance(tick * 0.005)
        assert go2.next_sample() is not None and go2.next_sample() is None
        if tick <= 10:
            assert sent[-1] == damping()
        if 10 <= tick <= 18:
            go2.command(ours)
    assert sum(command != damping() for command in sent) == 9 and sent[-1] == damping()
    for tick in range(41, 81):
        go2.command(ours)
        assert sent[-1] != damping()
        go2.joints()
        go2.advance(tick * 0.005)
    go2.advance(0.41)
    with pytest.raises(BodySilent, match="has not been heard"):
        go2.joints()
    go2.take(state())
    go2.advance(0.5)
    go2.command(ours)
    assert sent[-1] == damping() and go2.lost


def test_a_caller_that_was_held_up_has_not_lost_it() -> None:
    go2 = Go2(state())
    go2.sample(200.0)
    go2.advance(0.01)
    go2.advance(3.0)
    assert not go2.lost
    for _ in range(50):
        go2.take(state())
    go2.advance(3.1)
    assert len(list(iter(go2.next_sample, None))) == 40 and not go2.lost


def test_numbers_that_are_none_are_no_state() -> None:
    broken = state(imu_state=IMUState(gyroscope=(float("nan"), 0.0, 0.0)))
    with pytest.raises(BodySilent):
        Go2(broken)
    go2 = Go2(state())
    for tick in range(60):
        go2.take(broken)
        go2.advance(tick * 0.005)
    assert go2.lost


def test_the_battery_is_what_its_electronics_say() -> None:
    pack = BmsState(soc=83, current=-2500, cell_vol=[3600] * 8 + [0] * 7, bq_ntc=(31, 33))
    told = Go2Battery(Go2(state(bms_state=pack))).state
    assert told.voltage == pytest.approx(28.8) and (told.current, told.soc, told.temperature) == (-2.5, 0.83, 33.0)
    assert told.status is SupplyStatus.DISCHARGING
    assert Go2Battery(Go2(state())).state.status is SupplyStatus.UNKNOWN


# -- over DDS ---------------------------------------------------------------------------------------------------------------


async def paced(awaitable: Awaitable[T]) -> T:
    """Let real time pass with that of the clock: what is on the network has its time."""
    task = asyncio.ensure_future(awaitable)
    while not task.done():
        await asyncio.sleep(0.002)
        time.sleep(0.002)  # noqa: ASYNC251  # real time is the point
    return task.result()


async def crossed(condition: Callable[[], bool]) -> bool:
    """Wait on the real clock, while this one stands still, until it is so; after two seconds it has been lost, as on a network."""
    end = time.monotonic() + 2.0
    while not condition() and time.monotonic() < end:
        await asyncio.sleep(0)
        time.sleep(0.0002)  # noqa: ASYNC251
    return condition()


class Bench(Node):
    """Moves the simulated robot, step by step with ours: the newest message has arrived before time goes on, known by what is in it."""

    def __init__(self, far: SimulatedGo2, near: Go2) -> None:
        self.far, self.near = far, near
        self.silent = False

    @every(hz=200)
    async def step(self) -> None:
        far, near = self.far, self.near
        if far.closed:  # a story that ended early has closed the wire before its nodes are stopped
            return
        await crossed(lambda: near.told is None or far.newest.crc == near.told.crc)
        if self.silent:
            far.body.advance(self.clock.now())
            return
        far.tell(self.clock.now())
        await crossed(lambda: near.arrived.tick == far.tick)


async def telling(far: SimulatedGo2) -> None:
    while True:
        far.tell(far.body.time)
        await asyncio.sleep(0.01)


@asynccontextmanager
async def simulated(domain: int, walking: str = "") -> AsyncIterator[SimulatedGo2]:
    topics = RawTopics(DdsConfig(domain=domain, discovery_range="LOCALHOST"))
    await paced(topics.__aenter__())
    try:
        yield SimulatedGo2(topics, walking=walking)
    finally:
        await paced(topics.__aexit__(None, None, None))


@asynccontextmanager
async def commanded(
    domain: int, far: SimulatedGo2, *, enable: bool = True, say: Callable[[str], None] = lambda text: None
) -> AsyncIterator[Go2]:
    driver = command_go2(DdsConfig(domain=domain, discovery_range="LOCALHOST"), enable=enable, say=say)
    states = asyncio.ensure_future(telling(far))
    try:
        near = await paced(driver.__aenter__())
    finally:
        states.cancel()
    try:
        yield near
    finally:
        await paced(driver.__aexit__(None, None, None))
        far.closed = True


@pytest.mark.slow(reason="each state and command crosses a real DDS")
@pytest.mark.parametrize("feels", [True, False])
async def test_a_go2_stands_up_walks_and_sits_down_over_dds(rig: Rig, feels: bool) -> None:
    """Also one whose feet have no sensors, as in its maker's simulator."""
    domain, said = next(_domains), list[str]()
    async with simulated(domain, "normal") as far:
        far.feels = feels
        async with commanded(domain, far, say=said.append) as near:
            await crossed(lambda: near.told is not None and far.newest.crc == near.told.crc)
            assert far.walking == "" and far.newest == damping()
            await rig.start(Child(Bench, args=(far, near)), tree_of(Equipment(near, Go2Battery(near), model=GO2)))
            await rig.call(STAND, Trigger.Request())
            await rig.advance(3.0)
            assert far.body.truth().position[2] > 0.28
            await rig.call(WALK, Trigger.Request())
            for _ in range(40):
                rig.publish(TELEOP_CMD, Twist(linear=Vector3(x=0.4)))
                await rig.advance(0.1)
            assert far.body.truth().position[0] > 1.0
            for _ in range(25):
                rig.publish(TELEOP_CMD, Twist(angular=Vector3(z=0.6)))
                await rig.advance(0.1)
            assert far.body.truth().yaw > 1.2
            await rig.call(SIT, Trigger.Request())
            await rig.advance(3.0)
            truth = far.body.truth()
            assert truth.position[2] < 0.15 and np.hypot(*truth.quaternion[1:3]) < 0.1
            await rig.stop()
        assert far.newest == damping() and far.refused == 0
        assert far.walking == "normal"
        assert ["switched off" in said[0], "on again" in said[1]] == [True, True]


@pytest.mark.slow(reason="each state and command crosses a real DDS")
async def test_when_no_states_come_its_drives_brake_and_the_run_ends(rig: Rig) -> None:
    domain = next(_domains)
    async with simulated(domain) as far, commanded(domain, far) as near:
        bench = Bench(far, near)
        await rig.start(Child(lambda: bench, name="bench"), tree_of(Equipment(near, Go2Battery(near), model=GO2)))
        await rig.call(STAND, Trigger.Request())
        await rig.advance(3.0)
        rig.expect_failure(BodySilent)
        rig.expect_failure(SupervisorGaveUp)
        bench.silent = True
        await rig.advance(0.15)
        assert not near.lost and far.newest != damping()
        await rig.advance(0.1)
        assert "has not been heard" in near.lost and far.newest == damping()
        far.body.advance(far.body.time + 2.0)
        assert far.body.truth().position[2] < 0.2


async def test_without_enable_nothing_is_sent(rig: Rig) -> None:
    domain = next(_domains)
    async with simulated(domain, "normal") as far:
        async with commanded(domain, far, enable=False) as near:
            near.command(MotorTargets(*np.zeros((5, 12))))
            assert near.joints().position[1] == pytest.approx(far.body.truth().joints[1], abs=0.02)
        await paced(asyncio.sleep(0.2))
        assert (far.taken, far.calls, near.sent) == (0, [], 0)


async def test_it_is_refused_where_another_program_commands_it(rig: Rig) -> None:
    domain = next(_domains)
    async with simulated(domain, "normal") as far, simulated(domain) as other:
        other.topics.writer("rt/lowcmd", LowCmd)
        with pytest.raises(Refused, match="another program commands the Go2"):
            async with commanded(domain, far):
                pass
        assert far.walking == "normal" and far.taken == 0


async def test_one_that_stands_is_refused_before_its_own_walking_is_switched_off(rig: Rig) -> None:
    domain = next(_domains)
    async with simulated(domain, "normal") as far:
        standing = inverse(nominal_feet(GO2.stand_height, GO2), GO2).joints
        for tick in range(1, 401):
            far.body.command(MotorTargets(standing, np.zeros(12), np.zeros(12), np.full(12, 90.0), np.full(12, 4.0)))
            far.body.advance(tick * 0.005)
        with pytest.raises(Refused, match="the Go2 stands"):
            async with commanded(domain, far):
                pass
        assert far.walking == "normal" and far.calls == []


@pytest.mark.slow(reason="each state and command crosses a real DDS")
async def test_nobody_there_is_one_line(rig: Rig) -> None:
    with pytest.raises(BodySilent, match="no Go2 is heard in domain"):
        here = DdsConfig(domain=next(_domains), discovery_range="LOCALHOST")
        await paced(command_go2(here, enable=True, say=lambda text: None).__aenter__())
