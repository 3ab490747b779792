"""The clock of a loop that simulates a world. Real time is invented here: it passes where the loop waits, and where a callback says so."""

from __future__ import annotations

import asyncio
import itertools
import selectors
import time
from collections.abc import Callable, Coroutine
from math import inf
from typing import Any

import pytest

from actors import Child, Node, Supervisor, every, run
from actors.time import lockstep
from actors.time.lockstep import BEHIND, GAP, STALLED, TURNS, Lockstep, Simulated, lockstep_of
from actors.time.real_loop import new_event_loop, waking
from actors.time.ticker import Ticker
from actors.time.virtual_loop import VirtualLoop


class Machine:
    """A processor with one program."""

    def __init__(self) -> None:
        self.now, self.ran = 1000.0, 0.0

    def work(self, seconds: float, *, ran: float | None = None) -> None:
        """Something takes so long, and has had the processor for so much of it: for all, unless it is said."""
        self.now += seconds
        self.ran += seconds if ran is None else ran


class Selector(selectors.DefaultSelector):
    """Time passes at once while it waits."""

    machine: Machine

    def select(self, timeout: float | None = None) -> list[Any]:
        ready = super().select(0)
        if timeout is not None and not ready:
            self.machine.now += max(0.0, timeout)
        return ready


@pytest.fixture
def machine(monkeypatch: pytest.MonkeyPatch) -> Machine:
    made = Machine()
    monkeypatch.setattr(lockstep, "monotonic", lambda: made.now)
    monkeypatch.setattr(lockstep, "thread_time", lambda: made.ran)
    return made


def execute(machine: Machine, main: Callable[[Lockstep], Coroutine[Any, Any, None]]) -> None:
    class Loop(asyncio.SelectorEventLoop):
        def time(self) -> float:
            return machine.now

    def loop() -> asyncio.AbstractEventLoop:
        selector = Selector()
        selector.machine = machine
        return Loop(selector)

    async def begin() -> None:
        step = Lockstep.of(asyncio.get_running_loop())
        assert step is not None
        await main(step)

    with asyncio.Runner(loop_factory=loop) as runner:
        runner.run(begin())


def test_a_loop_that_keeps_up_runs_in_real_time(machine: Machine) -> None:
    async def main(step: Lockstep) -> None:
        begun = step.now
        for _ in range(100):
            await asyncio.sleep(0.01)
            machine.work(0.005)
        assert machine.now - 1000.0 == pytest.approx(1.0, abs=0.01)
        await asyncio.sleep(0.01)
        assert step.now == pytest.approx(machine.now)
        assert step.now - begun == pytest.approx(machine.now - 1000.0)
        assert step.slipped == pytest.approx(0.0, abs=1e-9)

    execute(machine, main)


def test_work_that_takes_longer_than_its_period_makes_the_world_slower_and_loses_no_tick(machine: Machine) -> None:
    """A control loop of 200 Hz whose step takes 20 ms here: a quarter of real time, and every step 5 ms after the one before."""

    async def main(step: Lockstep) -> None:
        seen: list[float] = []
        loop = asyncio.get_running_loop()
        done = loop.create_future()

        def control(k: int, due: float) -> None:
            seen.append(loop.time() - due)
            machine.work(0.02)
            if k == 1000:
                done.set_result(None)

        Ticker(loop).add(200.0, control)
        began = step.now
        await done
        assert len(seen) == 1000
        assert max(seen) < 1e-6
        assert step.now - began == pytest.approx(5.0)
        real = machine.now - 1000.0
        assert (real - step.slipped) / real == pytest.approx(0.25, abs=0.01)
        assert step.stopped == 0.0

    execute(machine, main)


@pytest.mark.parametrize("seconds", [1.0, 10.0, 60.0])
def test_a_stop_of_the_process_is_no_time_of_the_world(machine: Machine, seconds: float) -> None:
    async def main(step: Lockstep) -> None:
        ticks: list[float] = []
        Ticker(asyncio.get_running_loop()).add(100.0, lambda k, due: ticks.append(step.now))
        await asyncio.sleep(0.5)
        machine.work(seconds, ran=0.0)
        await asyncio.sleep(0.5)
        assert step.now - 1000.0 == pytest.approx(1.0)
        assert [round(b - a, 6) for a, b in itertools.pairwise(ticks)] == [0.01] * (len(ticks) - 1)
        assert step.slipped == step.stopped == pytest.approx(seconds - BEHIND, abs=0.02)
        await asyncio.sleep(0.1)
        assert machine.now - step.now == pytest.approx(step.slipped), "what it is late by else was made up for"

    execute(machine, main)


def test_a_short_delay_is_made_up_for(machine: Machine) -> None:
    async def main(step: Lockstep) -> None:
        for _ in range(20):
            machine.work(0.04)
            await asyncio.sleep(0.1)
        assert step.slipped == pytest.approx(0.0, abs=1e-9)
        assert machine.now - step.now == pytest.approx(0.0, abs=1e-9)

    execute(machine, main)


def test_what_one_instant_sets_going_is_done_before_the_next_one_comes(machine: Machine) -> None:
    """A sensor is read, and two messages later the motors have their targets: however late the loop is, not after the next sample."""

    async def main(step: Lockstep) -> None:
        order: list[str] = []
        loop = asyncio.get_running_loop()

        def pass_on(name: str, hops: int) -> None:
            machine.work(0.0001)
            if hops:
                loop.call_soon(pass_on, name, hops - 1)
            else:
                order.append(name)

        for number in range(5):
            loop.call_at(loop.time() + 0.01 + 0.0001 * number, pass_on, str(number), 10)
        machine.work(0.03)
        await asyncio.sleep(0.02)
        assert order == ["0", "1", "2", "3", "4"]

    execute(machine, main)


@pytest.mark.parametrize("cost", [0.00001, 0.005])
def test_a_task_that_never_rests_slows_the_world_down_but_does_not_stop_it(machine: Machine, cost: float) -> None:
    async def main(step: Lockstep) -> None:
        turns = 0

        async def restless() -> None:
            nonlocal turns
            while True:
                turns += 1
                machine.work(cost)
                await asyncio.sleep(0)

        task = asyncio.create_task(restless())
        await asyncio.sleep(0.1)
        assert step.now - 1000.0 >= 0.1
        assert turns >= (TURNS if cost < 0.001 else 20)
        task.cancel()

    execute(machine, main)


def test_time_waits_for_a_world_in_another_process(machine: Machine) -> None:
    """Half as fast as real time, and told every 5 ms; a process of it that was held up itself is then where the world is, at once."""

    async def main(step: Lockstep) -> None:
        ahead = 0.02

        def world() -> tuple[float, float]:
            real = machine.now - 1000.0
            return 1000.0 + 0.5 * (real // 0.01) * 0.01 + ahead, 0.5 * real

        step.follow(world)
        await asyncio.sleep(1.0)
        assert machine.now - 1000.0 == pytest.approx(2.0, abs=0.05)
        assert step.now <= world()[0]
        machine.work(2.0)
        await asyncio.sleep(0.001)
        assert step.now == pytest.approx(1002.0, abs=BEHIND + 0.03)
        assert step.slipped == pytest.approx(0.5 * (machine.now - 1000.0), abs=0.02)

    execute(machine, main)


def test_a_process_that_comes_later_begins_where_the_world_is(machine: Machine) -> None:
    async def main(step: Lockstep) -> None:
        step.follow(lambda: (machine.now - 12.0 + 0.02, 12.0))
        assert step.now == 988.0
        step.follow(lambda: (machine.now - 12.0 + 0.02, 12.0))
        await asyncio.sleep(0.5)
        assert step.now == pytest.approx(988.5)

    execute(machine, main)


def test_a_world_that_was_stopped_says_so_to_all_its_processes(machine: Machine) -> None:
    async def main(step: Lockstep) -> None:
        slipped = 0.0
        step.follow(lambda: (inf, slipped))
        await asyncio.sleep(0.1)
        machine.work(10.0, ran=0.0)
        slipped = 10.0
        await asyncio.sleep(0.1)
        assert (step.slipped, step.stopped) == (10.0, 10.0)
        assert step.now == pytest.approx(1000.2)

    execute(machine, main)


def test_a_world_that_has_ended_holds_no_clock_up_for_ever_but_a_stop_of_both_does_not_count(machine: Machine) -> None:
    async def main(step: Lockstep) -> None:
        limit = 1000.02
        step.follow(lambda: (limit, 0.0))
        await asyncio.sleep(0.01)
        machine.work(60.0, ran=0.0)
        waiting = asyncio.create_task(asyncio.sleep(0.1))
        for _ in range(5):
            await asyncio.sleep(0)
        assert step.now <= limit, "both were stopped: the world may be there still"
        await waiting
        assert machine.now - 1060.0 == pytest.approx(STALLED - GAP, abs=2 * GAP)

    execute(machine, main)


def test_a_loop_has_one_such_clock_and_one_without_a_selector_none(machine: Machine) -> None:
    async def main(step: Lockstep) -> None:
        assert Lockstep.of(asyncio.get_running_loop()) is step is lockstep_of(asyncio.get_running_loop())

    execute(machine, main)
    virtual = VirtualLoop()
    assert Lockstep.of(virtual) is None
    virtual.close()
    assert Lockstep.of(asyncio.AbstractEventLoop()) is None


def test_the_precise_loop_tells_the_time_to_those_whom_it_wakes_first() -> None:
    """On the real clock: what a thread has brought is stamped with the time at which the loop woke for it."""
    seen: list[float] = []

    async def main() -> None:
        loop = asyncio.get_running_loop()
        step = Lockstep.of(loop)
        assert step is not None
        waking(loop).append(lambda: seen.append(step.now))
        before = loop.time()
        await asyncio.sleep(0.02)
        assert before + 0.019 < seen[-1] <= loop.time()
        await asyncio.to_thread(time.sleep, 0.02)  # with no timer to wait for
        assert loop.time() >= before + 0.039

    with asyncio.Runner(loop_factory=new_event_loop) as runner:
        runner.run(main())


class World(Simulated):
    """Counts who lets a loop keep step with it."""

    def __init__(self) -> None:
        self.asked = 0

    def keep_step(self, loop: asyncio.AbstractEventLoop) -> None:
        self.asked += 1
        Lockstep.of(loop)


class Driver(Node):
    def __init__(self, world: World) -> None:
        self.times: list[float] = []

    @every(hz=100)
    def tick(self) -> None:
        self.times.append(self.clock.now())


def test_a_run_keeps_step_with_the_worlds_that_its_nodes_simulate() -> None:
    """On the real clock: a stop of the loop, as of the process, is no time for the nodes."""

    async def main(world: World) -> list[float]:
        tree = Supervisor("s", children=[Supervisor("below", children=[Child(Driver, args=(world,))])])
        async with run(tree, sinks=()) as system:
            (record,) = system.nodes.values()
            driver = record.node
            assert isinstance(driver, Driver)
            while len(driver.times) < 10:
                await asyncio.sleep(0.01)
            world.pause()  # type: ignore[attr-defined]
            while len(driver.times) < 30:
                await asyncio.sleep(0.01)
            return driver.times

    for real_time in (False, True):
        world = World()
        world.real_time = real_time
        world.pause = lambda: time.sleep(0.3)  # type: ignore[attr-defined]
        with asyncio.Runner(loop_factory=new_event_loop) as runner:
            times = runner.run(main(world))
        gaps = [b - a for a, b in itertools.pairwise(times)]
        assert world.asked == (not real_time)
        assert (max(gaps) < 0.0101) is not real_time
