"""Timers that a node makes while it runs, and `Rate`: on an exact grid, canceled, started again, retimed, on either clock."""

from __future__ import annotations

import asyncio
import inspect
from functools import partial
from typing import Any

import pytest

from actors import Child, LifecycleNode, Node, Tick, transient
from actors.errors import Ended, TickMissed
from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.rosgraph_msgs.msg import Clock
from actors.lifecycle import bring_up
from actors.runtime.incarnation import incarnation_of
from actors.runtime.sim_time import CLOCK
from actors.runtime.timers import Timer
from actors.testing import Rig


class Alarm(Node):
    """Notes the times of its ticks."""

    def __init__(self) -> None:
        self.at: list[float] = []
        self.ticks: list[Tick] = []

    def ring(self) -> None:
        self.at.append(self.clock.now())

    def count(self, tick: Tick) -> None:
        self.ticks.append(tick)

    async def doze(self, seconds: float) -> None:
        self.ring()
        await asyncio.sleep(seconds)


async def alarm(rig: Rig) -> Alarm:
    await rig.start(Alarm)
    return rig.node(Alarm)


async def test_a_timer_made_in_the_middle_of_a_run_ticks_one_period_later_and_so_on(rig: Rig) -> None:
    node = await alarm(rig)
    await rig.advance(0.25)
    timer = node.create_timer(0.5, node.ring)
    await rig.advance(1.75)
    assert node.at == [0.75, 1.25, 1.75]
    assert (timer.fired, timer.missed, timer.canceled, timer.period) == (3, 0, False, 0.5)
    assert repr(timer) == "<timer /alarm timer Alarm.ring, every 0.5 s: 3 ticks>"


async def test_a_timer_with_once_ticks_once_and_again_after_a_reset(rig: Rig) -> None:
    node = await alarm(rig)
    timer = node.create_timer(0.5, node.ring, once=True)
    assert repr(timer).endswith("once: 0 ticks>")
    await rig.advance(3.0)
    assert node.at == [0.5] and timer.canceled and timer.remaining is None
    timer.reset()
    await rig.advance(3.0)
    assert node.at == [0.5, 3.5]
    assert incarnation_of(node).timers.made == {}


async def test_a_canceled_timer_ticks_no_more_until_it_is_reset(rig: Rig) -> None:
    node = await alarm(rig)
    timer = node.create_timer(1.0, node.ring)
    await rig.advance(1.5)
    timer.cancel()
    timer.cancel()
    await rig.advance(1.0)
    assert node.at == [1.0] and repr(timer).endswith("canceled: 1 ticks>") and timer.missed == 0
    timer.reset()
    await rig.advance(1.0)
    assert node.at == [1.0, 3.5]


async def test_a_reset_puts_off_the_next_tick_as_of_a_watchdog(rig: Rig) -> None:
    node = await alarm(rig)
    watchdog = node.create_timer(1.0, node.ring, once=True)
    for _ in range(5):
        await rig.advance(0.9)
        watchdog.reset()
    assert node.at == []
    await rig.advance(2.0)
    assert node.at == [5.5]


async def test_a_timer_that_is_started_again_and_again_leaves_none_behind(rig: Rig) -> None:
    node = await alarm(rig)
    watchdog = node.create_timer(1.0, node.ring)
    for _ in range(100):
        watchdog.reset()
    timers: Any = incarnation_of(node)._timers
    assert len(timers.made) == 1
    watchdog.cancel()
    assert len(timers.made) == 0


async def test_without_autostart_it_begins_when_it_is_told(rig: Rig) -> None:
    node = await alarm(rig)
    timer = node.create_timer(1.0, node.ring, autostart=False)
    await rig.advance(5.0)
    assert node.at == [] and timer.canceled
    timer.reset()
    await rig.advance(1.0)
    assert node.at == [6.0]


async def test_a_new_period_holds_from_the_moment_in_which_it_is_set(rig: Rig) -> None:
    node = await alarm(rig)
    timer = node.create_timer(1.0, node.ring)
    await rig.advance(1.5)
    timer.period = 0.25
    await rig.advance(0.5)
    assert node.at == [1.0, 1.75, 2.0] and timer.period == 0.25
    timer.cancel()
    timer.period = 2.0
    await rig.advance(3.0)
    assert timer.canceled and len(node.at) == 3


async def test_it_tells_how_long_it_is_until_the_next_tick(rig: Rig) -> None:
    node = await alarm(rig)
    timer = node.create_timer(1.0, node.ring)
    assert timer.remaining == 1.0
    await rig.advance(0.75)
    assert timer.remaining == 0.25
    await rig.advance(0.5)
    assert timer.remaining == 0.75


async def test_a_tick_that_waits_is_forgotten_when_the_timer_is_canceled(rig: Rig) -> None:
    node = await alarm(rig)
    timer = node.create_timer(1.0, node.ring)
    node.create_timer(0.9, partial(node.doze, 0.5), once=True)
    await rig.advance(1.2)
    timer.cancel()
    await rig.advance(2.0)
    assert node.at == [0.9]


async def test_a_tick_that_waits_is_forgotten_when_the_timer_is_started_again(rig: Rig) -> None:
    node = await alarm(rig)
    timer = node.create_timer(1.0, node.ring)
    node.create_timer(0.9, partial(node.doze, 0.5), once=True)
    await rig.advance(1.2)
    timer.reset()
    await rig.advance(1.0)
    assert node.at == [0.9, 2.2]


async def test_ticks_that_a_busy_node_misses_are_counted_or_kept_or_a_fault(rig: Rig) -> None:
    node = await alarm(rig)
    skipping = node.create_timer(0.1, node.count)
    keeping = node.create_timer(0.1, node.ring, late="catch_up")
    node.create_timer(0.35, partial(node.doze, 0.4), once=True)
    await rig.advance(1.05)
    assert [tick.k for tick in node.ticks] == [1, 2, 3, 4, 8, 9, 10] and skipping.missed == 3
    assert keeping.fired == 10 and keeping.missed == 0
    with rig.expect_failure(TickMissed):
        node.create_timer(0.1, node.count, late="fault")
        node.create_timer(0.15, partial(node.doze, 0.4), once=True)
        await rig.advance(1.0)


@pytest.mark.parametrize("callback", ["plain", "takes_tick", "optional", "partial", "callable", "builtin", "any"])
async def test_a_callback_gets_the_tick_if_it_takes_an_argument(rig: Rig, callback: str) -> None:
    node = await alarm(rig)
    seen: list[Any] = []

    class Called:
        def __call__(self) -> None:
            seen.append("called")

    callbacks: dict[str, tuple[Any, Any]] = {
        "plain": (lambda: seen.append("plain"), "plain"),
        "takes_tick": (lambda tick: seen.append(tick.k), 1),
        "optional": (lambda tick=None: seen.append(tick), None),
        "partial": (partial(seen.append, "partial"), "partial"),
        "callable": (Called(), "called"),
        "builtin": (partial(lambda *them: seen.append(them)), ()),
        "any": (lambda *them: seen.append(them), ()),
    }
    called, expected = callbacks[callback]
    node.create_timer(1.0, called, once=True)
    await rig.advance(1.0)
    assert seen == [expected]


async def test_a_callback_that_does_not_show_what_it_takes_is_given_nothing(rig: Rig) -> None:
    node = await alarm(rig)
    unspoken = {"a": 1}.update  # `inspect` has no signature for it
    with pytest.raises(ValueError, match="no signature"):
        inspect.signature(unspoken)
    timer = node.create_timer(1.0, unspoken)
    await rig.advance(2.0)
    assert timer.fired == 2 and rig.incarnation(Alarm) == 1


async def test_a_timer_ends_with_the_life_of_its_node(rig: Rig) -> None:
    class Starter(Alarm):
        async def on_start(self) -> None:
            self.timer = self.create_timer(1.0, self.ring)

    await rig.start(Child(Starter, restart=transient))
    first = rig.node(Starter)
    await rig.advance(2.0)
    rig.crash(Starter)
    await rig.settled()
    again = rig.system.clock.now()
    await rig.advance(1.0)
    assert first.at == [1.0, 2.0] and rig.node(Starter).at == [again + 1.0]
    assert first.timer.fired == 2
    with pytest.raises(Ended):
        first.timer.reset()
    with pytest.raises(Ended):
        first.create_timer(1.0, first.ring)


async def test_an_error_of_a_callback_ends_the_node(rig: Rig) -> None:
    def fail() -> None:
        raise OSError("no bell")

    await rig.start(Child(Alarm, restart=transient))
    with rig.expect_failure(OSError):
        rig.node(Alarm).create_timer(1.0, fail)
        await rig.advance(1.5)
    assert rig.incarnation(Alarm) == 2


@pytest.mark.parametrize("period", [0.0, -1.0, float("nan"), float("inf"), 1e-7, True, "1"])
async def test_what_is_no_period_is_refused(rig: Rig, period: Any) -> None:
    node = await alarm(rig)
    with pytest.raises(ValueError, match=r"/alarm timer Alarm.ring: a period of .* s; it must be a number of seconds"):
        node.create_timer(period, node.ring)
    timer: Timer = node.create_timer(1.0, node.ring)
    with pytest.raises(ValueError, match="a period of"):
        timer.period = period
    assert timer.period == 1.0


class Managed(LifecycleNode):
    """Counts in every state."""

    async def on_configure(self, previous: object) -> None:
        self.count = 0
        self.create_timer(1.0, self.tick)

    def tick(self) -> None:
        self.count += 1


async def test_a_made_timer_of_a_lifecycle_node_ticks_in_every_state(rig: Rig) -> None:
    await rig.start(Managed)
    await bring_up(rig.system)
    node = rig.node(Managed)
    await rig.advance(2.0)
    await node.change_state("deactivate")
    await rig.advance(2.0)
    assert node.count == 4


# -- simulated time -------------------------------------------------------------------------------------------------------------


def at(seconds: float) -> Clock:
    return Clock(clock=Time(sec=int(seconds), nanosec=round(seconds % 1 * 1e9)))


async def test_under_simulated_time_a_timer_ticks_by_it_also_when_it_was_made_before(rig: Rig) -> None:
    node = await alarm(rig)
    before = node.create_timer(1.0, node.ring)
    node.set_parameter("use_sim_time", True)
    rig.publish(CLOCK, at(100.0))
    after = node.create_timer(0.5, node.count)
    await rig.advance(10.0)
    assert (before.fired, after.fired) == (1, 0)
    for tenth in range(1001, 1011):
        rig.publish(CLOCK, at(tenth / 10))
        await rig.settled()
    assert (before.fired, after.fired) == (2, 2)
    node.set_parameter("use_sim_time", False)
    await rig.advance(2.0)
    assert (before.fired, after.fired) == (4, 6)
    before.cancel()
    await rig.advance(2.0)
    assert before.fired == 4


# -- Rate -----------------------------------------------------------------------------------------------------------------------


class Looping(Node):
    """A loop in a task, with work that takes a while."""

    def __init__(self) -> None:
        self.at: list[float] = []

    async def loop(self, hz: float, work: list[float]) -> None:
        rate = self.create_rate(hz)
        for seconds in work:
            await asyncio.sleep(seconds)
            await rate.sleep()
            self.at.append(round(self.clock.now(), 9))


async def test_a_rate_keeps_a_loop_on_its_grid_and_leaves_out_what_has_passed(rig: Rig) -> None:
    await rig.start(Looping)
    node = rig.node(Looping)
    await rig.advance(0.03)
    node.create_task(node.loop(10, [0.0, 0.05, 0.0, 0.25, 0.0, 0.1]))
    await rig.advance(2.0)
    assert node.at == [0.13, 0.23, 0.33, 0.63, 0.73, 0.93]
    assert repr(node.create_rate(4)) == "<rate of 4 Hz>" and node.create_rate(4).period == 0.25


@pytest.mark.parametrize("hz", [3.0, 7.0, 30.0, 1000.0 / 3.0])
async def test_a_rate_that_is_no_round_number_has_neither_double_nor_lost_instants(rig: Rig, hz: float) -> None:
    await rig.start(Looping)
    node = rig.node(Looping)
    node.create_task(node.loop(hz, [0.0] * 200))
    await rig.advance(201 / hz)
    assert node.at == [pytest.approx(k / hz, abs=1e-6) for k in range(1, 201)]


async def test_a_rate_follows_simulated_time_also_back(rig: Rig) -> None:
    node = await alarm(rig)
    node.set_parameter("use_sim_time", True)
    rig.publish(CLOCK, at(50.0))
    rate = node.create_rate(1.0)

    async def woken_at(*times: float) -> float:
        waiting = asyncio.ensure_future(rate.sleep())
        for seconds in times:
            await rig.settled()
            assert not waiting.done()
            rig.publish(CLOCK, at(seconds))
        await rig.settled()
        assert waiting.done()
        return node.clock.now()

    assert await woken_at(50.5, 51.0) == 51.0
    assert await woken_at(51.5, 52.0) == 52.0
    rig.publish(CLOCK, at(10.25))
    assert await woken_at(10.5, 11.0) == 11.0
    assert await woken_at(12.0) == 12.0


@pytest.mark.parametrize("hz", [0, -1.0, float("nan"), 1e7, "10"])
async def test_what_is_no_rate_is_refused(rig: Rig, hz: Any) -> None:
    node = await alarm(rig)
    with pytest.raises(ValueError, match=r"a rate of .* Hz: it must be more than 0 and at most 1e\+06"):
        node.create_rate(hz)
