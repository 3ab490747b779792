"""Simulated time: nodes with `use_sim_time` live on `/clock`, paused, slower or faster than the loop, through jumps and restarts."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest

from actors import CallTimeout, Child, Done, LifecycleNode, Node, Steps, Stop, Supervisor, Tick, TickMissed, every
from actors.clock_publisher import ClockPublisher
from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.rcl_interfaces import srv
from actors.interfaces.rosgraph_msgs.msg import Clock
from actors.ros_clock import ClockChange, JumpThreshold, TimeJump
from actors.sim_time import CLOCK, SimClock
from actors.supervision.reasons import ExitReason
from actors.system import system_here
from actors.testing import Rig
from actors.time import Duration
from tests.stage import ADD, COUNT, WORDS, events, order, result, two, word
from actors import QoS, Service, Topic

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
    assert repr(follower.core.sim).startswith("<ROS time of /follower: RosClock(")


async def test_T_19_stamps_follow_the_simulated_clock_to_the_nanosecond(rig: Rig) -> None:
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
    class Plain(Follower):
        pass

    await rig.start(Child(Follower, parameters=SIMULATED), Child(Plain, parameters={"use_sim_time": False}))
    await show(rig, 100.0)
    plain = rig.node(Plain)
    assert plain.clock is rig.system.clock
    assert plain.core.sim is None
    assert plain.clock.now() == 0.0
    assert rig.node(Follower).clock.now() == 100.0


async def test_time_is_there_as_soon_as_it_is_published_also_within_a_handler(rig: Rig) -> None:
    class Sleeper(Follower):
        @WORDS.on()
        async def hear(self, _: Any) -> None:
            self.heard.append((self.clock.now(), await self.clock.sleep(1.0), self.clock.now()))

    sleeper = await following(rig, Sleeper)
    await show(rig, 5.0)
    rig.publish(WORDS, word("go"))
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


# -- paused, slower, faster ------------------------------------------------------------------------------------------------------


async def test_timers_tick_on_simulated_time_slower_than_the_loop(rig: Rig) -> None:
    follower = await following(rig)
    await show(rig, *(n / 100 for n in range(101)), every=0.1)  # a tenth of the loop's pace
    assert rig.now == pytest.approx(10.1)
    assert follower.due == [n / 10 for n in range(1, 11)]
    assert follower.numbers == list(range(1, 11))
    (record,) = follower.core.mailbox.timers.values()
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
    goal = await rig.start_goal(COUNT, order(3))
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
    (record,) = follower.core.mailbox.timers.values()
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
    await show(rig, 1_700_000_000.0)  # the first time of a recording, say: a thousand and one ticks are made up for, not all
    assert len(keen.ticks) == 5 + 1001
    (record,) = keen.core.mailbox.timers.values()
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
    naps = [follower.spawn(nap(instant)) for instant in (12.0, 11.0, 9.0, 30.0, 11.5)]
    await show(rig, 10.5)
    assert follower.heard == [(9.0, True)]
    follower.heard.clear()
    naps[-1].cancel()
    await show(rig, 5.0, 10.9, every=100.0)
    assert follower.heard == []
    await show(rig, 20.0)
    assert follower.heard == [(11.0, True), (12.0, True)]


# -- switched on and off at run time -------------------------------------------------------------------------------------------------


async def test_switched_on_the_timer_waits_for_the_rest_of_its_period(rig: Rig) -> None:
    await rig.start(Child(Follower))
    follower = rig.node(Follower)
    follower.set_parameter("use_sim_time", True)
    await show(rig, 2.0, every=0.0)
    follower.set_parameter("use_sim_time", False)
    assert follower.clock.now() == rig.now
    await rig.advance(0.35)  # ticks were due since the switch
    follower.ticks.clear()
    wait = follower.ticks_wait() if hasattr(follower, "ticks_wait") else None
    assert wait is None


async def test_non_boolean_values_are_refused(rig: Rig) -> None:
    follower = await following(rig)
    refused = follower.set_parameter("use_sim_time", 1)
    assert not refused.successful
    assert isinstance(follower.clock, SimClock)
    await show(rig, 7.0)
    assert follower.clock.now() == 7.0
