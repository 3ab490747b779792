"""Simulated time: nodes with `use_sim_time` live on `/clock`, paused, slower or faster than the loop, through jumps and restarts."""

from __future__ import annotations

import asyncio
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from actors import (
    CallTimeout,
    Child,
    Done,
    LifecycleNode,
    Node,
    QoS,
    Service,
    Steps,
    Supervisor,
    Tick,
    Topic,
    every,
    open_node,
)
from actors.errors import TickMissed
from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.rcl_interfaces import srv
from actors.interfaces.rosgraph_msgs.msg import Clock
from actors.nodes.clock_publisher import ClockPublisher
from actors.runtime.incarnation import incarnation_of
from actors.runtime.sim_time import CLOCK, SimClock
from actors.supervision.reasons import ExitReason
from actors.testing import Rig
from actors.time import Duration
from actors.time.ros_clock import ClockChange, JumpThreshold, TimeJump
from tests.stage import ADD, COUNT, WORDS, events, order, result, two, word

ROOT = Path(__file__).parents[3]
SIMULATED = {"use_sim_time": True}
SET = Service(srv.SetParameters, "/follower/set_parameters")


def at(seconds: float = 0.0, *, ns: int = 0) -> Clock:
    sec, nanosec = divmod(round(seconds * 1e9) + ns, 1_000_000_000)
    return Clock(clock=Time(sec=sec, nanosec=nanosec))


class Follower(Node):
    """Ticks ten times a second of its own time."""

    def __init__(self) -> None:
        self.ticks: list[Tick] = []
        self.heard: list[Any] = []

    @property
    def due(self) -> list[float]:
        return [round(tick.due, 6) for tick in self.ticks]

    @property
    def numbers(self) -> list[int]:
        return [tick.k for tick in self.ticks]

    @every(hz=10)
    async def tick(self, tick: Tick) -> None:
        self.ticks.append(tick)


async def following(rig: Rig, kind: type[Follower] = Follower, **child: Any) -> Follower:
    await rig.start(Child(kind, name="follower", parameters=SIMULATED, **child))
    return rig.node(kind)


async def show(rig: Rig, *seconds: float, every: float = 0.0) -> None:
    """Publish these times one after another, `every` so many seconds of the loop's clock."""
    for instant in seconds:
        rig.publish(CLOCK, at(instant))
        await rig.advance(every)


# -- the time ------------------------------------------------------------------------------------------------------------------------


async def test_before_the_first_message_time_is_0_and_stands_still(rig: Rig) -> None:
    follower = await following(rig)
    await rig.advance(5.0)
    assert (follower.clock.now(), follower.clock.now_ns(), follower.clock.wall()) == (0.0, 0, 0.0)
    assert follower.clock.stamp() == Time()
    assert follower.ticks == []
    assert repr(follower.clock) == "<simulated clock at 0.000000 s>"
    assert repr(incarnation_of(follower).sim).startswith("<ROS time of /follower: RosClock(")


async def test_stamps_follow_the_simulated_clock_to_the_nanosecond(rig: Rig) -> None:
    follower = await following(rig)
    await show(rig, 12.5)
    assert follower.clock.now() == 12.5
    assert follower.clock.stamp() == Time(sec=12, nanosec=500_000_000)
    assert follower.clock.stamp(3.25) == Time(sec=3, nanosec=250_000_000)
    rig.publish(CLOCK, at(ns=1_700_000_000_123_456_789))
    assert follower.clock.stamp() == Time(sec=1_700_000_000, nanosec=123_456_789)
    assert follower.clock.now_ns() == follower.clock.wall_ns() == 1_700_000_000_123_456_789
    await rig.quiet()


async def test_each_node_has_its_own_time_and_the_others_pay_nothing(rig: Rig) -> None:
    class Plain(Node):
        pass

    await rig.start(Child(Follower, parameters=SIMULATED), Child(Plain, parameters={"use_sim_time": False}))
    await show(rig, 100.0)
    plain = rig.node(Plain)
    assert plain.clock is rig.system.clock
    assert incarnation_of(plain).sim is None
    assert plain.clock.now() == 0.0
    assert rig.node(Follower).clock.now() == 100.0


def test_a_system_without_simulated_time_does_not_even_import_it() -> None:
    code = (
        "import sys\n"
        "from actors import Child, Node, execute, run\n"
        "class Plain(Node): pass\n"
        "async def main():\n"
        "    async with run(Child(Plain), sinks=()): pass\n"
        "execute(main, clock='virtual')\n"
        "print([name for name in sys.modules if 'sim_t' in name or 'ros_clock' in name])\n"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, timeout=60)
    assert (done.stdout, done.stderr) == ("[]\n", "")


async def test_a_script_s_node_may_live_on_simulated_time(rig: Rig) -> None:
    await rig.start(Child(Node, name="other"))
    async with open_node("viewer", parameters=SIMULATED) as viewer:
        await show(rig, 42.0)
        assert viewer.clock.now() == 42.0


async def test_time_is_there_as_soon_as_it_is_published_also_within_a_handler(rig: Rig) -> None:
    class Sleeper(Follower):
        @WORDS.on()
        async def hear(self, _: Any) -> None:
            self.heard.append((self.clock.now(), await self.clock.sleep(1.0), self.clock.now()))

    sleeper = await following(rig, Sleeper)
    await show(rig, 5.0)
    rig.publish(WORDS, word("go"))
    await rig.quiet()
    await show(rig, 5.5, 5.999, every=10.0)
    assert sleeper.heard == []
    await show(rig, 6.25)
    assert sleeper.heard == [(5.0, True, 6.25)]


async def test_clock_may_be_remapped_and_its_messages_may_age(rig: Rig) -> None:
    await rig.start(Child(Follower, parameters=SIMULATED, remap={"/clock": "/lab/clock"}))
    aging = Topic(Clock, "/lab/clock", QoS(depth=1, lifespan=1.0))
    rig.publish(CLOCK, at(1.0))
    rig.publish(aging, at(2.0))
    assert rig.node(Follower).clock.now() == 2.0
    await rig.quiet()


async def test_a_time_before_0_is_ignored_and_told_once(rig: Rig) -> None:
    follower = await following(rig)
    await show(rig, 3.0, -1.0, -0.5)
    assert follower.clock.now() == 3.0
    (line,) = events(rig.logs, "time before 0 on /clock")
    assert (line.node, line.fields["sec"]) == ("/follower", -1)


async def test_what_has_no_meaning_under_simulated_time_says_so(rig: Rig) -> None:
    follower = await following(rig)
    await show(rig, 3.0)
    with pytest.raises(RuntimeError, match=r"nobody knows when <simulated clock at 3\.0+ s> will show 4\.0 s"):
        follower.clock.loop_time(4.0)
    for wrong in (float("nan"), float("inf")):
        with pytest.raises(ValueError, match="finite"):
            await follower.clock.sleep(wrong)
        with pytest.raises(ValueError, match="finite"):
            await follower.clock.sleep_until(wrong)

    async def nap() -> None:
        await follower.clock.sleep(1e300)

    sleeping = follower.create_task(nap())
    await show(rig, 2.0**31 - 1.0)
    assert not sleeping.done()


# -- paused, slower, faster ------------------------------------------------------------------------------------------------------


async def test_timers_tick_on_simulated_time_slower_than_the_loop(rig: Rig) -> None:
    follower = await following(rig)
    await show(rig, *(n / 100 for n in range(101)), every=0.1)  # a tenth of the loop's pace
    assert rig.now == pytest.approx(10.1)
    assert follower.due == [n / 10 for n in range(1, 11)]
    assert follower.numbers == list(range(1, 11))
    (record,) = incarnation_of(follower).record.timers.values()
    assert (record.fired, record.missed) == (10, 0)
    assert record.rate(rig.system.loop.time()) == pytest.approx(1.0, rel=0.1)  # rates are those of the system's clock


async def test_timers_tick_on_simulated_time_faster_than_the_loop(rig: Rig) -> None:
    follower = await following(rig)
    await show(rig, *(n / 10 for n in range(1001)), every=0.001)
    assert rig.now == pytest.approx(1.001)
    assert len(follower.ticks) == 1000
    assert {tick.late for tick in follower.ticks} == {0.0}


async def test_a_paused_simulation_holds_up_timers_and_sleeps_but_no_call(rig: Rig) -> None:
    class Caller(Follower):
        @WORDS.on()
        async def ask(self, _: Any) -> None:
            try:
                await self.call(ADD, two(1, 2), timeout=2.0)
            except CallTimeout as late:
                self.heard.append(late)

    class Deaf(Node):
        @ADD.serve()
        async def add(self, _: Any) -> Any:
            await asyncio.Event().wait()

    await rig.start(Child(Caller, parameters=SIMULATED), Deaf)
    caller = rig.node(Caller)
    await show(rig, 1.0)
    ticks = len(caller.ticks)
    rig.publish(WORDS, word("ask"))
    await rig.advance(1.9)
    assert caller.heard == []
    await rig.advance(0.2)
    assert len(caller.heard) == 1
    assert len(caller.ticks) == ticks
    assert caller.clock.now() == 1.0


async def test_an_action_runs_at_the_pace_of_simulated_time(rig: Rig) -> None:
    class Counter(Follower):
        @COUNT.serve()
        async def count(self, goal: Fibonacci.Goal) -> Steps[Fibonacci.Feedback, Fibonacci.Result]:
            for _ in range(goal.order):
                await self.clock.sleep(1.0)
            yield Done(result(goal.order))

    await following(rig, Counter)
    goal = await rig.send_goal(COUNT, order(3))
    await rig.quiet()
    await show(rig, 1.0, 2.0, every=60.0)
    assert not goal.done
    await show(rig, 3.0)
    assert await goal == result(3)


# -- jumps -----------------------------------------------------------------------------------------------------------------------


async def test_a_jump_forward_gives_one_tick_and_goes_on_on_the_grid(rig: Rig) -> None:
    follower = await following(rig)
    await show(rig, 0.1, 0.2, 1.05, 1.09, 1.1)
    assert follower.due == [0.1, 0.2, 0.3, 1.1]
    assert follower.numbers == [1, 2, 3, 11]
    assert [round(tick.late, 6) for tick in follower.ticks] == [0.0, 0.0, 0.75, 0.0]
    (record,) = incarnation_of(follower).record.timers.values()
    assert (record.fired, record.missed) == (4, 7)


async def test_a_jump_forward_is_made_up_for_where_ticks_catch_up(rig: Rig) -> None:
    class Keen(Follower):
        @every(hz=10, late="catch_up")
        async def tick(self, tick: Tick) -> None:
            self.ticks.append(tick)

    keen = await following(rig, Keen)
    await show(rig, 0.1, 0.55)
    assert keen.due == [0.1, 0.2, 0.3, 0.4, 0.5]
    assert keen.numbers == [1, 2, 3, 4, 5]
    await show(
        rig, 1_700_000_000.0
    )  # the first time of a recording, say: a thousand and one ticks are made up for, not all
    assert len(keen.ticks) == 5 + 1001
    (record,) = incarnation_of(keen).record.timers.values()
    assert record.missed == 17_000_000_000 - 5 - 1001
    await show(rig, 1_700_000_000.1)
    assert keen.ticks[-1].k == 17_000_000_001


async def test_a_jump_forward_is_a_fault_where_ticks_must_not_be_missed(rig: Rig) -> None:
    class Strict(Follower):
        @every(hz=10, late="fault")
        async def tick(self, tick: Tick) -> None:
            self.ticks.append(tick)

    await following(rig, Strict)
    with rig.expect_failure(TickMissed):
        await show(rig, 0.1, 0.5)
    await rig.settled()
    assert rig.incarnation(Strict) == 2


async def test_a_jump_back_before_the_last_tick_starts_the_period_anew(rig: Rig) -> None:
    follower = await following(rig)
    await show(rig, 10.0, 10.1, 3.0, 3.05, 3.1, 3.2)
    assert follower.due == [0.1, 10.1, 3.1, 3.2]
    assert follower.numbers == [1, 101, 102, 103]
    assert follower.clock.now() == 3.2


async def test_a_short_jump_back_moves_no_tick(rig: Rig) -> None:
    follower = await following(rig)
    await show(rig, 0.1, 0.18, 0.12, 0.19, 0.2)
    assert follower.due == [0.1, 0.2]


async def test_a_tick_that_waits_while_time_goes_back_is_not_early(rig: Rig) -> None:
    class Busy(Follower):
        @WORDS.on()
        async def hear(self, _: Any) -> None:
            await asyncio.sleep(0.1)

    busy = await following(rig, Busy)
    rig.publish(WORDS, word("be busy"))
    await rig.quiet()
    await show(rig, 0.1, 0.05)
    await rig.advance(0.2)
    assert [(tick.due, tick.late) for tick in busy.ticks] == [(0.1, 0.0)]


async def test_ticks_of_one_step_come_in_the_order_in_which_they_were_due(rig: Rig) -> None:
    class Three(Follower):
        @every(hz=4)
        async def slow(self) -> None:
            self.heard.append("slow")

        @every(hz=5)
        async def quick(self) -> None:
            self.heard.append("quick")

        @every(period=0.05, late="catch_up")
        async def steady(self) -> None:
            self.heard.append("steady")

    three = await following(rig, Three)
    await show(rig, 0.25)
    assert three.heard == ["steady", "quick", "slow"] + 4 * ["steady"]


async def test_sleepers_wake_in_the_order_of_their_instants_and_wait_through_jumps(rig: Rig) -> None:
    follower = await following(rig)
    clock = follower.clock

    async def nap(instant: float) -> None:
        follower.heard.append((instant, await clock.sleep_until(instant)))

    await show(rig, 10.0)
    naps = [follower.create_task(nap(instant)) for instant in (12.0, 11.0, 9.0, 30.0, 11.5)]
    await show(rig, 10.5)
    assert follower.heard == [(9.0, True)]
    follower.heard.clear()
    await show(rig, 5.0, 10.9, every=100.0)
    assert follower.heard == []
    naps[-1].cancel()
    await show(rig, 20.0)
    assert follower.heard == [(11.0, True), (12.0, True)]


# -- switched on and off at run time -------------------------------------------------------------------------------------------------


async def test_switched_at_run_time_a_timer_waits_for_the_rest_of_its_period(rig: Rig) -> None:
    await rig.start(Child(Follower))
    follower = rig.node(Follower)
    await show(rig, 50.0, every=0.26)  # nobody follows yet
    assert follower.due == [0.1, 0.2]
    follower.set_parameter("use_sim_time", True)
    assert follower.clock.now() == 0.0
    await show(rig, 0.25, every=5.0)  # before the tick at 0.2, so as good as any other time
    follower.set_parameter("use_sim_time", False)
    assert follower.clock.now() == rig.now == pytest.approx(5.26)
    assert len(follower.ticks) == 2
    await rig.advance(0.049)
    assert len(follower.ticks) == 2
    await rig.advance(0.002)
    assert follower.due[2:] == [5.31]
    follower.set_parameter("use_sim_time", True)
    assert follower.clock.now() == 0.25  # the last that it knew
    await show(rig, 0.3, every=1.0)
    assert len(follower.ticks) == 3
    await show(rig, 0.35, 0.45, every=1.0)
    assert follower.numbers == [1, 2, 3, 4, 5]
    assert follower.due[3:] == [0.349, 0.449]


async def test_switched_on_it_waits_for_a_first_message_before_it_ticks(rig: Rig) -> None:
    await rig.start(Child(Follower))
    follower = rig.node(Follower)
    await rig.advance(100.05)
    follower.ticks.clear()
    follower.set_parameter("use_sim_time", True)
    await rig.advance(10.0)
    assert follower.ticks == []
    await show(rig, 7.0)  # before the last tick: the period begins anew
    assert follower.ticks == []
    await show(rig, 7.1)
    assert follower.due == [7.1]


async def test_switched_off_before_the_first_message_it_ticks_at_once(rig: Rig) -> None:
    follower = await following(rig)
    await rig.advance(3.21)
    follower.set_parameter("use_sim_time", False)
    await rig.advance(0.1)
    assert follower.due == [3.21, 3.31]


async def test_a_tick_that_waits_during_the_switch_counts_as_due_now(rig: Rig) -> None:
    class Keen(Follower):
        @every(hz=10, late="catch_up")
        async def tick(self, tick: Tick) -> None:
            self.ticks.append(tick)

        @WORDS.on()
        async def hear(self, _: Any) -> None:
            await asyncio.sleep(1.0)

    await rig.start(Child(Keen))
    keen = rig.node(Keen)
    await rig.advance(0.05)
    rig.publish(WORDS, word("be busy"))
    await rig.advance(0.3)
    keen.set_parameter("use_sim_time", True)
    await show(rig, 0.35)
    keen.set_parameter("use_sim_time", False)
    await rig.advance(0.8)
    assert keen.due[:3] == [0.35, 0.35, 0.35]
    assert keen.numbers[:3] == [1, 2, 3]
    assert all(tick.late >= 0.0 for tick in keen.ticks)


async def test_sleeps_under_simulated_time_end_when_it_is_switched_off(rig: Rig) -> None:
    follower = await following(rig)
    await show(rig, 5.0)
    clock = follower.clock

    async def nap(seconds: float) -> None:
        follower.heard.append(await clock.sleep(seconds))

    for seconds in (1.0, 2.0, 3.0, 0.0, -1.0):
        follower.create_task(nap(seconds))
    await rig.quiet()
    await show(rig, 6.0)
    assert follower.heard == [True, True, True]
    follower.set_parameter("use_sim_time", False)
    await rig.quiet()
    assert follower.heard[3:] == [False, False]
    assert follower.clock is clock
    assert await clock.sleep(1.5)  # now the system's seconds
    assert await clock.sleep_until(2.0)
    assert rig.now == clock.now() == 2.0
    assert clock.now_ns() == clock.wall_ns() == clock.wall_ns_at(2.0) == 2_000_000_000
    assert (clock.loop_time(2.0), repr(clock)) == (rig.system.clock.loop_time(2.0), repr(rig.system.clock))
    clock.shift_wall(100.0)
    assert clock.wall() == rig.system.clock.wall() == 102.0


async def test_a_sleep_that_began_on_the_system_s_clock_ends_on_it(rig: Rig) -> None:
    class Sleeper(Follower):
        @WORDS.on()
        async def hear(self, _: Any) -> None:
            self.heard.append(await self.clock.sleep(2.0))

    await rig.start(Child(Sleeper))
    sleeper = rig.node(Sleeper)
    rig.publish(WORDS, word("sleep"))
    await rig.quiet()
    sleeper.set_parameter("use_sim_time", True)
    await show(rig, 100.0, every=1.9)
    assert sleeper.heard == []
    await rig.advance(0.2)
    assert sleeper.heard == [True]


async def test_tools_switch_it_by_the_parameter_services(rig: Rig) -> None:
    from actors import Parameter
    from actors.parameters.messages import from_result, to_parameter

    follower = await following(rig)

    async def set_to(value: Any) -> Any:
        request = srv.SetParameters.Request(parameters=[to_parameter(Parameter("use_sim_time", value))])
        return from_result((await rig.call(SET, request)).results[0])

    def listeners() -> int:
        return len(rig.system.graph.topic("/clock").subscriptions)

    assert listeners() == 1
    assert (await set_to(False)).successful
    assert listeners() == 0
    refused = await set_to("yes")
    assert not refused.successful
    assert "bool" in refused.reason.lower()
    assert (await set_to(True)).successful
    assert (await set_to(True)).successful  # no change
    assert listeners() == 1
    await show(rig, 7.0)
    assert follower.clock.now() == 7.0
    assert isinstance(follower.clock, SimClock)


async def test_a_value_that_is_no_boolean_refuses_the_start(rig: Rig) -> None:
    from actors import StartFailed

    rig.expect_failure()
    with pytest.raises(StartFailed, match="use_sim_time"):
        await rig.start(Child(Follower, parameters={"use_sim_time": "true"}))


async def test_the_timers_of_a_lifecycle_node_begin_on_the_time_it_then_has(rig: Rig) -> None:
    class Managed(LifecycleNode):
        count = 0

        @every(hz=10)
        async def tick(self) -> None:
            self.count += 1

    await rig.start(Child(Managed, parameters=SIMULATED))
    node = rig.node(Managed)
    await show(rig, 5.0)
    await node.change_state("configure")
    await node.change_state("activate")
    await show(rig, 5.05, every=1.0)
    assert node.count == 0
    await show(rig, 5.1, 5.2, every=1.0)
    assert node.count == 2
    await node.change_state("deactivate")
    node.set_parameter("use_sim_time", False)
    await node.change_state("activate")
    await rig.advance(1.05)
    assert node.count == 12


# -- restarts and the end ------------------------------------------------------------------------------------------------------------


async def test_after_a_restart_the_follower_keeps_following(rig: Rig) -> None:
    class Frail(Follower):
        async def on_start(self) -> None:
            self.heard.append(self.clock.now())

    frail = await following(rig, Frail)
    await show(rig, 5.0, 5.1)
    rig.crash(Frail)
    await rig.settled()
    again = rig.node(Frail)
    assert again is not frail
    assert again.heard == [0.0]  # the first message is still to come
    await show(rig, 5.2, 5.3)
    assert (again.clock.now(), again.due, again.incarnation) == (5.3, [0.1, 5.3], 2)
    assert len(rig.system.graph.topic("/clock").subscriptions) == 1


async def test_time_goes_on_while_a_node_starts_and_stops(rig: Rig) -> None:
    class Slow(Follower):
        async def on_start(self) -> None:
            assert await self.clock.sleep(1.0)

        async def on_stop(self, reason: ExitReason) -> None:
            assert await self.clock.sleep(1.0)
            log.append(self.clock.now())

    log: list[float] = []
    tree = Supervisor("lab", children=[Child(ClockPublisher, args=(10.0,)), Child(Slow, parameters=SIMULATED)])
    await rig.start(tree)
    assert rig.now == pytest.approx(1.0)
    rig.node(Slow).stop()
    await rig.advance(2.0)
    assert log == [pytest.approx(2.0)]


async def test_who_sleeps_on_the_time_of_a_node_that_ends_is_woken(rig: Rig) -> None:
    from actors import temporary

    await rig.start(Child(Follower, parameters=SIMULATED, restart=temporary))
    node = rig.node(Follower)
    clock = node.clock
    nap = asyncio.ensure_future(clock.sleep(5.0))
    await rig.quiet()
    node.stop()
    assert not await nap
    assert not await clock.sleep(5.0)
    assert await clock.sleep(0.0)
    node.set_parameter("use_sim_time", False)
    assert len(rig.system.graph.topic("/clock").subscriptions) == 0


# -- jump callbacks ------------------------------------------------------------------------------------------------------------------


ANY = JumpThreshold(min_forward=Duration(nanoseconds=1), min_backward=Duration(nanoseconds=-1))


async def test_jump_callbacks_run_before_and_after_the_change(rig: Rig) -> None:
    await rig.start(Child(Follower))
    follower = rig.node(Follower)
    seen: list[Any] = []
    handle = follower.on_jump(
        ANY,
        pre=lambda: seen.append(follower.clock.now()),
        post=lambda jump: seen.append((jump.clock_change, jump.delta.seconds, follower.clock.now())),
    )
    follower.on_jump(JumpThreshold(min_forward=None, min_backward=Duration(seconds=-1.0), on_clock_change=False))
    await rig.advance(0.5)
    follower.set_parameter("use_sim_time", True)
    await show(rig, 2.0, 2.0, 1.5)
    follower.set_parameter("use_sim_time", False)
    assert seen == [
        0.5, (ClockChange.ROS_TIME_ACTIVATED, 0.0, 0.0), 0.0, (ClockChange.ROS_TIME_NO_CHANGE, 2.0, 2.0),
        2.0, (ClockChange.ROS_TIME_NO_CHANGE, -0.5, 1.5), 1.5, (ClockChange.ROS_TIME_DEACTIVATED, 0.0, 0.5),
    ]  # fmt: skip
    handle.remove()
    follower.set_parameter("use_sim_time", True)
    assert len(seen) == 8


async def test_a_threshold_says_which_jumps_are_told(rig: Rig) -> None:
    class Careful(Follower):
        async def on_start(self) -> None:
            backward = JumpThreshold(min_forward=None, min_backward=Duration(seconds=-1.0), on_clock_change=False)
            self.on_jump(backward, post=self.heard.append)

    careful = await following(rig, Careful)
    await show(rig, 100.0, 99.5, 98.0)
    (jump,) = careful.heard
    assert jump == TimeJump(ClockChange.ROS_TIME_NO_CHANGE, Duration(seconds=-1.5))


async def test_a_jump_callback_that_raises_is_its_node_s_failure(rig: Rig) -> None:
    class Frail(Follower):
        async def on_start(self) -> None:
            self.on_jump(ANY, post=self.fall)

        def fall(self, jump: TimeJump) -> None:
            raise OSError(f"no map for a time {jump.delta.seconds:g} s later")

    await following(rig, Frail)
    failure = rig.expect_failure(OSError, match="no map for a time 8 s later")
    rig.publish(CLOCK, at(8.0))  # does not raise
    await rig.settled()
    assert len(failure.errors) == 1
    assert rig.incarnation(Frail) == 2


async def test_a_jump_callback_may_switch_simulated_time_off(rig: Rig) -> None:
    class Doubting(Follower):
        async def on_start(self) -> None:
            self.on_jump(JumpThreshold(min_forward=Duration(seconds=1000.0), min_backward=None), post=self.doubt)

        def doubt(self, jump: TimeJump) -> None:
            if not jump.source_changed:
                self.set_parameter("use_sim_time", False)

    doubting = await following(rig, Doubting)
    await show(rig, 1.0, every=1.0)
    await show(rig, 5000.0)
    assert doubting.clock.now() == rig.now
    await rig.advance(0.25)
    assert len(doubting.ticks) == 1 + 3


# -- the publisher -------------------------------------------------------------------------------------------------------------------


async def test_a_clock_publisher_drives_its_followers(rig: Rig) -> None:
    class Timed(Follower):
        pass

    await rig.start(Child(ClockPublisher, args=(20.0,)), Child(Timed, parameters=SIMULATED))
    times = rig.probe(CLOCK)
    await rig.advance(2.0)
    assert len(times) == 40
    assert [round(time, 6) for time in times.times] == [n / 20 for n in range(1, 41)]
    assert times.last == at(2.0)
    assert rig.node(Timed).due == [n / 10 for n in range(1, 21)]


async def test_a_clock_publisher_never_follows_itself(rig: Rig) -> None:
    await rig.start(Child(ClockPublisher, parameters=SIMULATED))
    times = rig.probe(CLOCK)
    await rig.advance(1.0)
    assert len(times) == 40  # the rate of `ros2 bag play --clock`
    assert rig.node(ClockPublisher).clock.now() == pytest.approx(1.0)


@pytest.mark.parametrize("hz", [0.0, -1.0, float("nan"), 2e6])
def test_a_clock_publisher_refuses_rates_that_make_no_sense(hz: float) -> None:
    with pytest.raises(ValueError, match=r"ClockPublisher\(hz=.*must be above 0"):
        ClockPublisher(hz)
