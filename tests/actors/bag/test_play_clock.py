"""The time of a bag while it is played."""

from __future__ import annotations

import pytest

from actors.bag.player import PlayClock, nanoseconds

S = 1_000_000_000


def test_it_runs_at_its_rate_from_where_it_began() -> None:
    clock = PlayClock(100.0, 5 * S, 2.0, paused=False)
    assert [clock.bag_ns(now) for now in (100.0, 101.0, 103.5)] == [5 * S, 7 * S, 12 * S]
    assert clock.instant(12 * S) == 103.5


def test_it_stands_still_while_paused_and_goes_on_from_there() -> None:
    clock = PlayClock(0.0, 0, 1.0, paused=True)
    assert clock.bag_ns(50.0) == 0
    clock.unpause(50.0)
    assert clock.bag_ns(53.0) == 3 * S
    clock.pause(53.0)
    clock.pause(60.0)
    assert clock.bag_ns(99.0) == 3 * S
    clock.unpause(99.0)
    assert clock.bag_ns(100.0) == 4 * S


def test_a_change_of_the_rate_makes_no_jump() -> None:
    clock = PlayClock(0.0, 0, 1.0, paused=False)
    clock.set_rate(10.0, 0.5)
    assert [clock.bag_ns(now) for now in (10.0, 12.0)] == [10 * S, 11 * S]
    for rate in (0.0, -1.0, float("inf"), float("nan")):
        with pytest.raises(ValueError, match="cannot be played at the rate"):
            clock.set_rate(12.0, rate)
    assert clock.rate == 0.5


def test_it_jumps_where_it_is_sent() -> None:
    clock = PlayClock(0.0, 0, 2.0, paused=False)
    clock.seek(5.0, 100 * S)
    assert clock.bag_ns(6.0) == 102 * S


def test_a_rate_beyond_all_measure_and_a_long_offset_are_no_overflow() -> None:
    clock = PlayClock(0.0, 5, 1.0, paused=False)
    clock.set_rate(0.0, 1e308)
    assert clock.bag_ns(10.0) > 10**16
    assert nanoseconds(1e300) > 10**16
    assert nanoseconds(1.5) == 1_500_000_000
