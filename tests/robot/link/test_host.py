"""A body behind a link, both ends in this process and on a clock of the test: what crosses is what the body itself would have said and done."""

from __future__ import annotations

import asyncio
import os
import pickle
from collections.abc import Callable, Iterator
from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot.control.gait_controller import GaitController
from robot.hardware.arm import ArmBusy
from robot.hardware.body import ActuatorState, BodySilent, MotorTargets
from robot.link import host, phase, remote, segment
from robot.link.firmware import Drives
from robot.link.host import BodyHost
from robot.link.records import Command, Order, command_record, read_command
from robot.link.remote import LinkedBody
from robot.model.arm import STOWED
from robot.scenes.scene import Box, Scene
from robot.scenes.terrain import Ramp
from robot.scenes.worlds import get_world
from robot.sim.physics import PhysicsBody
from robot.sim.simulation import Simulation, Truth
from tests.robot.stage import floor

BEGAN = 5000.0


class Bench:
    """A physics body behind a link; time passes when the test says so."""

    def __init__(self, world: str | Scene, monkeypatch: pytest.MonkeyPatch, arm: bool = False) -> None:
        self.scene = get_world(world) if isinstance(world, str) else world
        self.now = BEGAN
        monkeypatch.setattr(remote.time, "monotonic", lambda: self.now)
        monkeypatch.setattr(remote.time, "sleep", self._sleep)
        self.segment = segment.create(len(self.scene.things))
        self.body = PhysicsBody(self.scene, seed=1, noise=False, arm=arm)
        self.host = BodyHost(self.body, self.segment, BEGAN)
        self.far = LinkedBody(self.segment.name, self.scene, seed=1, arm=arm)

    def pass_time(self, seconds: float) -> None:
        self.now += seconds
        self.host.serve(self.now)

    def _sleep(self, seconds: float) -> None:
        """Who waits for an answer lets the body's process run."""
        self.pass_time(seconds)

    def close(self) -> None:
        self.segment.remove()
        self.segment.close()


@pytest.fixture
def bench(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[..., Bench]]:
    made: list[Bench] = []

    def make(world: str | Scene = "empty", *, arm: bool = False) -> Bench:
        made.append(Bench(world, monkeypatch, arm))
        return made[-1]

    yield make
    for one in made:
        one.close()


def walk(body: Simulation, gait: GaitController, steps: int, each: Callable[[], None]) -> None:
    """A control loop at 200 Hz; `each` lets 5 ms pass."""
    for _ in range(steps):
        each()
        while (sample := body.next_sample()) is not None:
            body.command(gait.step(0.005, sample.imu, sample.joints))


def same(one: object, other: object) -> None:
    for field in fields(one):  # type: ignore[arg-type]
        np.testing.assert_array_equal(getattr(one, field.name), getattr(other, field.name), err_msg=field.name)


def test_a_linked_body_walks_as_the_body_itself_does_bit_for_bit(
    bench: Callable[..., Bench], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(phase, "TICKS", 10**9)  # the reader is punctual to the bit: there is nothing to align
    there = bench()
    here = PhysicsBody(there.scene, seed=1, noise=False)
    for body, now in ((there.far, lambda: there.now - BEGAN), (here, lambda: here.time)):
        gait = GaitController()
        gait.request("walk")
        gait.command(0.5, 0.0, 0.2)
        body.advance(now())
        body.sample(200.0)
        if body is here:
            walk(here, gait, 800, lambda: here.advance(here.time + 0.005))
        else:
            there.pass_time(0.0)
            walk(there.far, gait, 800, lambda: there.pass_time(0.005))
    there.pass_time(0.0)
    here.advance(4.0)
    assert here.truth().position[0] > 0.2
    same(there.far.truth(), here.truth())


def test_how_often_the_host_looks_makes_no_difference_to_the_motion(bench: Callable[..., Bench]) -> None:
    """A command acts at the instant at which it was given, not when the host finds it."""
    targets = MotorTargets(np.full(12, 0.3), np.zeros(12), np.zeros(12), np.full(12, 60.0), np.full(12, 4.0))
    ends: list[Truth] = []
    for rounds in ([0.004, 0.005, 0.005, 0.005], [0.019]):
        one = bench()
        one.now = BEGAN + 0.006
        one.far.command(targets)
        for seconds in rounds:
            one.pass_time(seconds)
        ends.append(one.far.truth())
    same(*ends)
    assert ends[0].velocity[2] > 0.05


def test_samples_carry_the_time_of_the_readers_own_clock(bench: Callable[..., Bench]) -> None:
    there = bench()
    there.far.advance(12.0)  # the reader's clock, when the machine's is BEGAN
    there.far.sample(200.0)
    there.pass_time(0.0)
    for _ in range(3):
        there.pass_time(0.005)
    times = [sample.time for sample in iter(there.far.next_sample, None)]
    assert times == pytest.approx([12.005, 12.010, 12.015])


def test_a_reader_that_was_held_up_gets_every_sample_and_each_once(bench: Callable[..., Bench]) -> None:
    there = bench()
    there.far.advance(0.0)
    there.far.sample(200.0)
    there.pass_time(0.0)
    for _ in range(30):
        there.pass_time(0.005)
    times = [sample.time for sample in iter(there.far.next_sample, None)]
    assert times == pytest.approx([0.005 * k for k in range(1, 31)])
    assert there.far.next_sample() is None


def test_50_ms_without_targets_and_the_drives_sit_the_robot_down(bench: Callable[..., Bench]) -> None:
    there = bench()
    gait = GaitController()
    gait.request("walk")
    gait.command(0.7, 0.0, 0.0)
    there.far.advance(0.0)
    there.far.sample(200.0)
    there.pass_time(0.0)
    walk(there.far, gait, 1000, lambda: there.pass_time(0.005))
    assert there.far.truth().velocity[0] > 0.5
    height = there.far.truth().position[2]
    for _ in range(9):
        there.pass_time(0.005)
    assert not there.host.drives.stopping
    there.pass_time(0.010)
    assert there.host.drives.stopping
    for _ in range(400):
        there.pass_time(0.005)
        assert not there.far.truth().fallen
    assert there.host.drives.resting
    assert there.far.truth().position[2] < 0.2 < height


def test_a_commander_that_was_replaced_moves_nothing_any_more(bench: Callable[..., Bench]) -> None:
    there = bench()
    still = there.far.truth()
    hard = MotorTargets(np.zeros(12), np.zeros(12), np.full(12, 40.0), np.zeros(12), np.zeros(12))
    soft = MotorTargets(np.zeros(12), np.zeros(12), np.zeros(12), np.zeros(12), np.full(12, 8.0))
    for epoch, targets in ((2, soft), (1, hard)):
        there.segment.commands.write(command_record(Command(Order.TARGETS, there.now, epoch, targets=targets)))
    there.pass_time(0.04)
    assert there.host.drives.refused == 1
    np.testing.assert_allclose(there.far.truth().position, still.position, atol=0.01)


SOFT = MotorTargets(np.zeros(12), np.zeros(12), np.zeros(12), np.zeros(12), np.full(12, 8.0))


def test_the_links_of_a_process_share_its_memory_and_its_number(bench: Callable[..., Bench]) -> None:
    there = bench()
    one, other = pickle.loads(pickle.dumps((there.far, there.far)))
    assert one is other
    assert one.segment is there.far.segment


def test_a_process_of_a_former_life_that_gets_to_command_only_after_its_successor_is_refused(
    bench: Callable[..., Bench],
) -> None:
    """It was launched first, and stood still until its successor had been launched and had commanded."""
    there = bench()
    launched = [pickle.dumps(there.far) for _ in range(2)]
    successor = pickle.loads(launched[1])
    successor.command(SOFT)
    there.pass_time(0.001)

    former = pickle.loads(launched[0])
    former.command(SOFT)
    former.sample(500.0)
    there.pass_time(0.02)

    assert there.host.drives.refused >= 2
    assert there.host.next_round(there.now) == there.now + host.IDLE  # nobody who counts has asked for samples


@given(order=st.permutations(range(5)), heard=st.lists(st.integers(0, 4), max_size=20))
def test_whoever_was_launched_last_of_those_who_command_is_obeyed_in_whatever_order_they_begin(
    order: list[int], heard: list[int]
) -> None:
    """`order` is that in which the processes get to unpack what they were launched with."""
    made = segment.create(0)
    try:
        here = LinkedBody(made.name, floor(), seed=1, arm=False)
        launched = [pickle.dumps(here) for _ in range(5)]
        links = {process: pickle.loads(launched[process]) for process in order}
        drives = Drives()
        obeyed: list[int] = []
        for process in heard:
            links[process].command(SOFT)
            record = made.commands.latest()
            assert record is not None
            command = read_command(record)
            if drives.obey(command.at, command.epoch):
                obeyed.append(process)
        assert obeyed == [process for at, process in enumerate(heard) if process >= max(heard[: at + 1])]
    finally:
        made.remove()
        made.close()


def named(world: str | Scene) -> str:
    return world if isinstance(world, str) else "hilly"


HILLY = replace(
    floor(Box(0.0, 3.0, 1.0, 0.2)),
    terrain=(
        Ramp(1.8, 0.3, 2.0, 1.2, 0.6, yaw=0.4),
        Ramp(-2.0, 1.0, 1.0, 1.0, 0.5, bottom=0.5),
        Ramp(0.0, -2.0, 1.0, 1.0, 0.1, bottom=0.1),
    ),
)
"""A ramp on which level beams end, a block that they meet, and a step that they pass over."""


@pytest.mark.parametrize("world", ["warehouse", "pillars", "corridor", "ramps", HILLY], ids=named)
def test_the_rays_of_the_mirror_meet_what_mujocos_meet(bench: Callable[..., Bench], world: str | Scene) -> None:
    there = bench(world)
    mirrored = there.far.lidar()
    np.testing.assert_allclose(mirrored, there.body.lidar(), atol=0.1)  # the noise of a scan: 15 mm, 6 sd
    there.far._noise = Silence()  # type: ignore[assignment]
    np.testing.assert_allclose(there.far.lidar(), there.body.lidar(), atol=1e-6)


def test_the_rays_of_the_mirror_pass_over_what_is_lower_than_the_body(bench: Callable[..., Bench]) -> None:
    low, high = Box(2.0, 0.0, 0.5, 0.5, height=0.1), Box(-2.0, 0.0, 0.5, 0.5, height=1.0)
    there = bench(floor(low, high))
    there.far._noise = Silence()  # type: ignore[assignment]
    ranges = there.far.lidar()
    assert ranges[180] == 10.0  # ahead
    assert ranges[0] == pytest.approx(1.75, abs=1e-3)  # behind


class Silence:
    """No noise."""

    def apply(self, ranges: np.ndarray, max_range: float) -> np.ndarray:
        return ranges


def test_what_has_not_been_heard_for_a_second_is_an_error_and_no_old_news(bench: Callable[..., Bench]) -> None:
    there = bench()
    there.now += 0.9
    there.far.truth()
    there.now += 0.2
    with pytest.raises(BodySilent, match="has not been heard for 1 s: its process has ended, or stands still"):
        there.far.truth()


def test_the_arm_of_a_linked_body_moves_grips_and_refuses_as_the_arm_itself(bench: Callable[..., Bench]) -> None:
    there = bench("kitchen", arm=True)
    arm = there.far.arm
    assert arm is not None
    assert there.body.arm is not None
    np.testing.assert_allclose(arm.state().position, STOWED, atol=1e-9)
    target = (0.4, *STOWED[1:])
    seconds = arm.move(target)
    with pytest.raises(ArmBusy):
        arm.move(target)
    with pytest.raises(ValueError, match="angle"):
        arm.move((99.0, 0.0, 0.0, 0.0))
    assert arm.state().moving
    while there.now < BEGAN + seconds + 0.5:
        there.pass_time(0.005)
    assert not arm.state().moving
    np.testing.assert_allclose(arm.state().position, target, atol=5e-3)
    arm.grip(True)
    assert arm.gripper.closing
    there.pass_time(0.5)
    assert arm.gripper == there.body.arm.gripper
    assert arm.held is None
    assert arm.stop() == 0.0


def test_things_are_where_the_body_has_them(bench: Callable[..., Bench]) -> None:
    there = bench("kitchen", arm=True)
    there.pass_time(0.5)
    told, true = there.far.things(), there.body.things()
    assert [thing.name for thing in told] == [thing.name for thing in there.scene.things]
    assert told == true


def test_a_push_is_refused_over_a_link(bench: Callable[..., Bench]) -> None:
    with pytest.raises(NotImplementedError, match="this one lives in another process"):
        bench().far.push((1.0, 0.0, 0.0))


def test_what_the_battery_gives_the_drives_crosses_and_what_they_tell_of_themselves(
    bench: Callable[..., Bench],
) -> None:
    there = bench("empty")
    there.far.supply(0.0)
    there.pass_time(0.01)
    assert not there.body.actuators().supplied
    told = there.far.actuators()
    assert (told.supplied, told.temperature.size, told.left) == (False, 0, 1.0)
    there.far.supply(0.9)
    there.pass_time(0.01)
    assert there.far.actuators().supplied


def test_temperatures_of_drives_cross(bench: Callable[..., Bench], monkeypatch: pytest.MonkeyPatch) -> None:
    there = bench("empty")
    warm = ActuatorState(True, np.linspace(30.0, 41.0, 12), 0.75)
    monkeypatch.setattr(there.body, "actuators", lambda: warm)
    there.pass_time(0.01)
    told = there.far.actuators()
    assert told.temperature == pytest.approx(warm.temperature)
    assert (told.supplied, told.left) == (True, 0.75)


# -- a machine that is too slow -------------------------------------------------------------------------------------------------


class Round:
    """The rounds of a body's process on a machine of the test, and who commands it."""

    def __init__(self, bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
        self.bench, self.runnable = bench, False
        self.pace = host.Pace(bench.segment)
        monkeypatch.setattr(host, "is_runnable", lambda process: self.runnable)

    def go(self, real: float) -> float:
        """One round at so many seconds after the start; up to where it went, from there too."""
        host = self.bench.host
        now = self.pace.until(BEGAN + real, host.reached, host.drives.heard)
        self.bench.host.serve(now)
        return now - BEGAN

    def command(self, at: float) -> None:
        targets = MotorTargets(*np.zeros((5, 12)))
        self.bench.segment.commands.write(command_record(Command(Order.TARGETS, BEGAN + at, 1, targets=targets)))


def test_what_a_body_is_late_by_is_lost_but_for_two_samples_and_all_clocks_are_told(
    bench: Callable[..., Bench], monkeypatch: pytest.MonkeyPatch
) -> None:
    rounds = Round(bench(), monkeypatch)
    assert [rounds.go(real) for real in (0.005, 0.012)] == pytest.approx([0.005, 0.012])
    assert rounds.go(60.0) == pytest.approx(0.022), "it was stopped"
    assert rounds.bench.segment.slipped == pytest.approx(60.0 - 0.022)
    assert rounds.go(60.005) == pytest.approx(0.027)
    assert rounds.pace.present(BEGAN + 60.01) == pytest.approx(BEGAN + 0.032)


def test_the_world_waits_for_who_commands_and_has_no_processor_but_not_for_who_hangs(
    bench: Callable[..., Bench], monkeypatch: pytest.MonkeyPatch
) -> None:
    rounds = Round(bench(), monkeypatch)
    rounds.command(0.0)
    for step in range(1, 7):
        rounds.go(0.005 * step)
    rounds.runnable = True
    for step in range(7, 40):
        assert rounds.go(0.005 * step) == pytest.approx(0.03, abs=0.001)
        assert rounds.pace.waits
    rounds.command(0.03)
    rounds.go(0.2)
    assert rounds.go(0.205) == pytest.approx(0.035, abs=0.001)
    assert not rounds.pace.waits
    for step in range(42, 60):
        rounds.go(0.005 * step)
    assert rounds.pace.waits
    assert not rounds.bench.host.drives.stopping
    rounds.runnable = False  # it sleeps, or has ended: the drives are alone
    for step in range(60, 70):
        rounds.go(0.005 * step)
    assert rounds.bench.host.drives.stopping


def test_the_world_does_not_wait_for_ever_for_a_controller_in_an_endless_loop(
    bench: Callable[..., Bench], monkeypatch: pytest.MonkeyPatch
) -> None:
    rounds = Round(bench(), monkeypatch)
    rounds.command(0.0)
    rounds.runnable = True
    real = next(
        real for real in np.arange(0.005, 5.0, 0.005) if rounds.go(real) > 0.0 and rounds.bench.host.drives.stopping
    )
    assert host.PATIENCE < real < host.PATIENCE + 0.2


def test_a_controllers_clock_goes_with_the_body_and_its_commands_have_that_time(bench: Callable[..., Bench]) -> None:
    there = bench()

    async def main() -> None:
        loop = asyncio.get_running_loop()
        there.far.keep_step(loop)
        assert loop.time() <= BEGAN + remote.AHEAD
        there.far.command(MotorTargets(*np.zeros((5, 12))))
        await asyncio.sleep(0.0)

    before = there.segment.commands.written
    asyncio.run(main())
    (_, record), *_ = there.segment.commands.after(before)
    assert read_command(record).at <= BEGAN + remote.AHEAD
    assert there.segment.commander == os.getpid()
