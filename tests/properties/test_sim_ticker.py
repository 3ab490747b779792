"""Ticks on simulated time, whatever steps it takes."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from actors.time.ros_clock import RosClock
from actors.time.sim_ticker import SimTick, SimTicker

NS = 1_000_000_000
RATES = st.sampled_from([0.5, 1.0, 3.0, 10.0, 200.0])


def ticking(hz: float) -> tuple[RosClock, SimTicker, SimTick, list[tuple[int, float]]]:
    ros = RosClock(lambda: 0)
    ros.activate()
    ticker = SimTicker(ros)
    seen: list[tuple[int, float]] = []
    return ros, ticker, ticker.add(hz, lambda k, due: seen.append((k, due))), seen


@given(RATES, st.lists(st.integers(0, NS // 4), max_size=20))
def test_while_time_goes_forward_every_tick_comes_once_and_on_the_grid(hz: float, steps: list[int]) -> None:
    ros, ticker, tick, seen = ticking(hz)
    period = round(NS / hz)
    for step in steps:
        ros.set(ros.now_ns() + step)
        ticker.deliver()
        assert seen == [(k, k * period / 1e9) for k in range(1, ros.now_ns() // period + 1)]
    assert tick.k == len(seen)


@given(RATES, st.lists(st.integers(0, 2**31 * NS), max_size=30))
def test_after_any_step_the_next_tick_is_at_most_one_period_away(hz: float, times: list[int]) -> None:
    ros = RosClock(lambda: 0)
    ros.activate()
    ticker = SimTicker(ros)
    numbers: list[int] = []

    def callback(k: int, due: float) -> None:
        numbers.append(k)
        tick.skip_missed()

    tick = ticker.add(hz, callback)
    for time in times:
        ros.set(time)
        before = len(numbers)
        ticker.deliver()
        assert len(numbers) - before <= 1
        assert 0 < tick.wait(time) <= round(NS / hz)
    assert numbers == sorted(set(numbers))
