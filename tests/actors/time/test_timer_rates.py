"""Setting the parameter behind `@every(hz="rate")`: the timer ticks at the new rate from that moment on, on either clock."""

from __future__ import annotations

import math
from typing import Any

import pytest

from actors import Child, DeclarationError, LifecycleNode, Node, SetResult, StartFailed, Tick, every, parameter
from actors.errors import TickMissed
from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.rosgraph_msgs.msg import Clock
from actors.lifecycle import bring_up
from actors.runtime.declarations import Late
from actors.runtime.sim_time import CLOCK
from actors.testing import Rig
from tests.facts import lacks


class Beat(Node):
    """Ticks ten times a second, unless told otherwise, and twice a second whatever it is told."""

    rate = parameter(10.0)

    def __init__(self) -> None:
        self.ticks: list[Tick] = []
        self.steady = 0

    @every(hz="rate")
    def beat(self, tick: Tick) -> None:
        self.ticks.append(tick)

    @every(hz=2)
    def hold(self) -> None:
        self.steady += 1

    def due(self) -> list[float]:
        return [tick.due for tick in self.ticks]


async def test_the_timer_ticks_on_an_exact_grid_from_the_moment_of_the_change(rig: Rig) -> None:
    await rig.start(Beat)
    beat = rig.node(Beat)
    start = rig.loop.time()
    await rig.advance(0.25)
    changed = rig.loop.time()
    assert beat.set_parameter("rate", 50.0) == SetResult()
    await rig.advance(0.1)
    assert beat.due() == [start + 1 / 10, start + 2 / 10, *(changed + k / 50 for k in range(1, 6))]
    assert [tick.k for tick in beat.ticks] == [1, 2, 3, 4, 5, 6, 7]
    beat.set_parameter("rate", 1.0)
    slower = rig.loop.time()
    beat.ticks.clear()
    await rig.advance(2.0)
    assert beat.due() == [slower + 1.0, slower + 2.0]
    assert [tick.k for tick in beat.ticks] == [8, 9]
    assert beat.steady == 4


async def test_a_set_to_the_same_rate_leaves_the_grid_as_it_is(rig: Rig) -> None:
    await rig.start(Beat)
    beat = rig.node(Beat)
    start = rig.loop.time()
    await rig.advance(0.15)
    assert beat.set_parameter("rate", 10.0).successful
    await rig.advance(0.1)
    assert beat.due() == [start + 1 / 10, start + 2 / 10]


@pytest.mark.parametrize("rate", [0.0, -1.0, math.nan, math.inf, 1e6])
async def test_what_is_no_rate_is_refused_with_a_reason_and_the_timer_goes_on(rig: Rig, rate: float) -> None:
    await rig.start(Beat)
    beat = rig.node(Beat)
    answer = beat.set_parameter("rate", rate)
    assert not answer.successful
    assert lacks(answer.reason, f"Beat.beat rate 0 million {rate!r}") == []
    await rig.advance(1.0)
    assert len(beat.ticks) == 10 and beat.rate == 10.0


async def test_a_start_with_what_is_no_rate_fails_with_the_reason(rig: Rig) -> None:
    with pytest.raises(
        StartFailed, match=r"node /beat cannot start with rate = 0\.0: Beat\.beat ticks by rate: the rate must be"
    ):
        await rig.start(Child(Beat, parameters={"rate": 0.0}))


@pytest.mark.parametrize(
    ("declared", "said"),
    [
        (
            parameter(0.0),
            "Pilot.beat: @every(hz='rate') names <parameter 'rate': DOUBLE = 0.0>: the rate must be above 0",
        ),
        (
            parameter(-1),
            "Pilot.beat: @every(hz='rate') names <parameter 'rate': INTEGER = -1>: the rate must be above 0",
        ),
        (
            parameter("fast"),
            "Pilot.beat: @every(hz='rate') names <parameter 'rate': STRING = 'fast'>, which is no number",
        ),
        (parameter(True), "Pilot.beat: @every(hz='rate') names <parameter 'rate': BOOL = True>, which is no number"),
    ],
)
def test_a_default_that_is_no_rate_is_refused_at_the_class(declared: Any, said: str) -> None:
    with pytest.raises(DeclarationError) as refused:

        class Pilot(Node):
            rate = declared

            @every(hz="rate")
            def beat(self) -> None: ...

    assert str(refused.value).startswith(said)


class Blunt(Node):
    """Sets its own rate in its tick, and may be held up by a topic of its own."""

    rate = parameter(10)

    def __init__(self) -> None:
        self.at: list[float] = []

    @every(hz="rate")
    def beat(self) -> None:
        self.at.append(round(self.clock.now(), 6))
        self.set_parameter("rate", self.rate * 2)


async def test_a_timer_may_set_its_own_rate_in_its_tick(rig: Rig) -> None:
    await rig.start(Blunt)
    await rig.advance(0.19)
    assert rig.node(Blunt).at == [0.1, 0.15, 0.175, 0.1875]


def busy(late: Late) -> type[Node]:
    """A node whose first tick sleeps for 0.5 s, in which it is told to tick faster."""

    class Busy(Node):
        rate = parameter(10.0)

        def __init__(self) -> None:
            self.ticks: list[tuple[int, float]] = []

        @every(hz="rate", late=late)
        async def beat(self, tick: Tick) -> None:
            self.ticks.append((tick.k, round(tick.due, 6)))
            if tick.k == 1:
                await self.clock.sleep(0.5)

    return Busy


async def test_the_late_policy_skip_is_kept(rig: Rig) -> None:
    kind = busy("skip")
    await rig.start(Child(kind, name="busy"))
    await rig.advance(0.35)
    rig.node(kind).set_parameter("rate", 20.0)
    await rig.advance(0.4)
    assert rig.node(kind).ticks[:3] == [(1, 0.1), (2, 0.2), (9, 0.65)]  # type: ignore[attr-defined]


async def test_the_late_policy_catch_up_is_kept_and_every_tick_has_its_number(rig: Rig) -> None:
    kind = busy("catch_up")
    await rig.start(Child(kind, name="busy"))
    await rig.advance(0.35)
    rig.node(kind).set_parameter("rate", 20.0)
    await rig.advance(0.31)
    wanted = [0.1, 0.2, 0.3, 0.4, 0.45, 0.5, 0.55, 0.6, 0.65]
    assert rig.node(kind).ticks == list(enumerate(wanted, start=1))  # type: ignore[attr-defined]


async def test_the_late_policy_fault_is_kept_and_names_the_tick(rig: Rig) -> None:
    kind = busy("fault")
    await rig.start(Child(kind, name="busy"))
    await rig.advance(0.15)
    rig.node(kind).set_parameter("rate", 20.0)
    with rig.expect_failure(TickMissed, match=r"more tick\(s\) were due before tick 2 had begun"):
        await rig.advance(0.6)


def at(seconds: float) -> Clock:
    sec, nanosec = divmod(round(seconds * 1e9), 1_000_000_000)
    return Clock(clock=Time(sec=sec, nanosec=nanosec))


async def test_under_simulated_time_the_new_rate_counts_in_that_time(rig: Rig) -> None:
    await rig.start(Child(Beat, parameters={"use_sim_time": True}))
    beat = rig.node(Beat)

    async def time(seconds: float) -> None:
        rig.publish(CLOCK, at(seconds))
        await rig.advance(0.0)

    await time(100.0)
    for tenth in range(1, 3):
        await time(100.0 + tenth / 10)
    beat.ticks.clear()
    await time(100.25)
    assert beat.set_parameter("rate", 50.0).successful
    await rig.advance(60.0)  # the loop's clock does not count
    assert beat.ticks == []
    for step in range(1, 6):
        await time(100.25 + step / 50)
    assert [round(tick.due, 9) for tick in beat.ticks] == [100.27, 100.29, 100.31, 100.33, 100.35]
    numbers = [tick.k for tick in beat.ticks]
    assert numbers == list(range(numbers[0], numbers[0] + 5))
    assert not beat.set_parameter("rate", 0.0).successful
    beat.set_parameter("use_sim_time", False)
    beat.ticks.clear()
    await rig.advance(1.0)
    assert len(beat.ticks) == 50
    assert beat.ticks[0].k == numbers[-1] + 1


class Managed(LifecycleNode):
    """Ticks while it is active."""

    rate = parameter(10.0)

    def __init__(self) -> None:
        self.count = 0

    @every(hz="rate")
    def beat(self) -> None:
        self.count += 1


async def test_a_timer_that_rests_ticks_at_the_new_rate_when_its_node_is_active(rig: Rig) -> None:
    await rig.start(Managed)
    managed = rig.node(Managed)
    assert managed.set_parameter("rate", 20.0).successful
    await rig.advance(1.0)
    assert managed.count == 0
    await bring_up(rig.system)
    await rig.advance(1.0)
    assert managed.count == 20


async def test_the_record_of_the_timer_knows_the_new_rate(rig: Rig) -> None:
    await rig.start(Beat)
    await rig.advance(1.0)
    rig.node(Beat).set_parameter("rate", 40.0)
    await rig.advance(1.0)
    record = rig.state(Beat).timers["beat"]
    assert (record.hz, record.fired, record.missed) == (40.0, 50, 0)
    assert record.rate(rig.loop.time()) == pytest.approx(25.0, rel=0.05)
