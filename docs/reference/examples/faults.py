"""Faults of scenarios, and what a failed test says."""

import asyncio
import threading

from actors import Node, Topic, every
from actors.interfaces.std_msgs.msg import Int32
from actors.testing import Deadlock, ExpectedFailure, Leak, Livelock, Probe, Rig, Stalled, UnexpectedFailure, VirtualLoop
from actors.testing.faults import (
    ALL, KINDS, NETWORK, ClockJump, ClockOffset, Crash, Cut, Delay, Duplicate, Fault, Freeze, HostCrash, HostPause, Kind, LinkDelay, LinkDuplicate,
    LinkLoss, LinkReorder, Lose, NotANumber, Possible, Profile, Reorder, RouterStop, SlowHandler, SlowStart, SlowStep, draw, parse,
)

# -- faults are values

(late,) = parse("delay:/scan>/planner#12+0.25")
assert late == Fault("delay", "/scan>/planner", nth=12, by=0.25) and str(late) == "delay:/scan>/planner#12+0.25"
print(late.in_words())

seen = Profile(links={"/scan>/planner": 200}, awaits={"/planner": 500}, handled={"/planner": 200}, numeric={"/scan>/planner"}, seconds=20.0)
messages: tuple[Possible, ...] = (Lose(), Delay(up_to=0.5), Duplicate(), Reorder(), Freeze(up_to=2.0), NotANumber())
nodes: tuple[Possible, ...] = (Crash(at_most=2), SlowHandler(), SlowStart(), SlowStep(), ClockJump(up_to=60.0))
network: tuple[Possible, ...] = (
    Cut(), LinkLoss(), LinkDelay(most=1.0), LinkDuplicate(), LinkReorder(), HostCrash(), HostPause(), RouterStop(), ClockOffset(),
)
assert {type(one) for one in (*messages, *nodes, *network)} == {type(one) for one in (*ALL, *NETWORK)}
assert draw(messages, 1, seen) == draw(messages, 1, seen)  # the same seed, the same faults
kinds: set[Kind] = {fault.kind for seed in range(200) for fault in draw(messages, seed, seen)}
assert kinds == {"lose", "delay", "duplicate", "swap", "freeze", "nan"} <= {*KINDS}

# -- what a failed test says

COUNT = Topic(Int32, "count")


class Faulty(Node):
    @every(hz=1)
    async def tick(self) -> None:
        raise OSError("cable pulled")


async def test_a_failure_that_nobody_expects_fails_the_test(rig: Rig) -> None:
    await rig.start(Faulty)
    try:
        await rig.advance(1.5)
    except UnexpectedFailure as failure:
        assert "cable pulled" in str(failure)
    else:
        raise AssertionError("it must be told")


async def test_a_failure_that_is_expected_must_come(rig: Rig) -> None:
    await rig.start(Faulty)
    expected: ExpectedFailure = rig.expect_failure(OSError, match="cable")
    with expected:
        await rig.advance(1.5)


async def test_a_probe_hears_all_that_is_published(rig: Rig) -> None:
    await rig.start(Faulty)
    heard: Probe[Int32] = rig.probe(COUNT)
    rig.publish(COUNT, Int32(data=1))
    await rig.quiet()
    assert heard.last == Int32(data=1) and len(heard) == 1

class Forgetful(Node):
    async def on_start(self) -> None:
        self.task = asyncio.get_running_loop().create_task(asyncio.sleep(3600.0), name="polls the server")


async def test_a_task_that_outlives_its_node_is_found(rig: Rig) -> None:
    own = Rig()
    await own.start(Forgetful)
    task = own.node(Forgetful).task  # self.create_task(...) would have ended it with the node
    try:
        await own.close()
    except Leak as leak:
        assert "polls the server" in str(leak)
    else:
        raise AssertionError("it must be told")
    task.cancel()

async def waits_for_nobody() -> None:
    await asyncio.get_running_loop().create_future()


async def goes_in_circles() -> None:
    while True:
        await asyncio.sleep(0)


for program, error in ((waits_for_nobody, Deadlock), (goes_in_circles, Livelock)):
    with asyncio.Runner(loop_factory=VirtualLoop) as runner:
        loop = runner.get_loop()
        assert isinstance(loop, VirtualLoop)
        loop.max_spins = 1000
        try:
            runner.run(program())
        except error as told:
            print(str(told).splitlines()[0])
        else:
            raise AssertionError(error)

gate = threading.Event()


async def waits_for_a_thread() -> None:
    try:
        await asyncio.to_thread(gate.wait)
    finally:
        gate.set()


with asyncio.Runner(loop_factory=VirtualLoop) as runner:
    loop = runner.get_loop()
    assert isinstance(loop, VirtualLoop)
    loop.patience = 0.05
    try:
        runner.run(waits_for_a_thread())
    except Stalled as told:
        assert "thread running Event.wait" in str(told)
    else:
        raise AssertionError("it must be told")
