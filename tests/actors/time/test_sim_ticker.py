"""Periodic callbacks on ROS time, without a node: due times, steps, cancelling."""

from __future__ import annotations

from actors.time.ros_clock import RosClock
from actors.time.sim_ticker import SimTick, SimTicker


class Bench:
    """A ticker on simulated time, and what it delivers."""

    def __init__(self) -> None:
        self.ros = RosClock(lambda: 0)
        self.ros.activate()
        self.ticker = SimTicker(self.ros)
        self.seen: list[tuple[str, int, float]] = []

    def add(self, name: str, hz: float, start: float | None = None, k: int = 0) -> SimTick:
        return self.ticker.add(hz, lambda k, due: self.seen.append((name, k, due)), start, k)

    def set(self, seconds: float) -> list[tuple[str, int, float]]:
        self.seen.clear()
        self.ros.set(round(seconds * 1e9))
        self.ticker.deliver()
        return self.seen


def test_ticks_are_due_one_period_after_the_start_and_then_on_the_grid() -> None:
    bench = Bench()
    bench.add("a", 4.0)
    assert bench.set(0.24) == []
    assert bench.set(0.25) == [("a", 1, 0.25)]
    bench.add("b", 2.0, start=0.125, k=7)
    assert bench.set(0.625) == [("a", 2, 0.5), ("b", 8, 0.625)]
    assert bench.set(1.0) == [("a", 3, 0.75), ("a", 4, 1.0)]


def test_a_period_is_a_whole_number_of_nanoseconds_as_in_ros() -> None:
    bench = Bench()
    bench.add("third", 3.0)
    assert bench.set(0.333333333) == [("third", 1, 0.333333333)]
    bench.add("quickest", 1e12)
    assert bench.set(0.333333334) == [("quickest", 1, 0.333333334)]


def test_a_callback_may_skip_what_it_has_missed() -> None:
    bench = Bench()
    ticks: list[int] = []

    def callback(k: int, due: float) -> None:
        ticks.append(k)
        assert tick.skip_missed() == 3
        assert tick.skip_missed() == 0

    tick = bench.ticker.add(10.0, callback)
    bench.set(0.4)
    assert (ticks, tick.k) == ([1], 4)


def test_a_tick_may_be_canceled_also_while_ticks_are_delivered() -> None:
    bench = Bench()
    ticks: list[str] = []

    def first(k: int, due: float) -> None:
        ticks.append("first")
        one.cancel()
        other.cancel()

    one = bench.ticker.add(10.0, first)
    other = bench.ticker.add(10.0, lambda k, due: ticks.append("other"))
    bench.add("third", 10.0)
    assert repr(bench.ticker).startswith("<SimTicker with 3 periodic callbacks on RosClock(")
    assert bench.set(0.2) == [("third", 1, 0.1), ("third", 2, 0.2)]
    assert ticks == ["first"]
    one.cancel()  # twice is fine
    bench.set(9.0)
    assert ticks == ["first"]
    assert repr(bench.ticker).startswith("<SimTicker with 1 periodic callbacks on RosClock(")


def test_a_tick_shows_itself() -> None:
    bench = Bench()
    tick = bench.ticker.add(10.0, Bench.add)  # type: ignore[arg-type]
    assert repr(tick) == "<SimTick Bench.add, 0 ticks so far, TimerGrid(every 100000000 ns, next at 100000000 ns)>"
