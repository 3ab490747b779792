"""The gaits as a table, and the clock that runs through them."""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot.control.gait_controller import GaitController
from robot.control.gaits import GAITS, Gait, GaitClock

NAMES = sorted(GAITS)
names = st.sampled_from(NAMES)


def lifts(clock: GaitClock, seconds: float, dt: float = 0.001) -> list[tuple[float, int]]:
    """When which leg lifts, from now on."""
    found: list[tuple[float, int]] = []
    was = [clock.swing(leg) >= 0.0 for leg in range(4)]
    for step in range(round(seconds / dt)):
        clock.advance(dt)
        now = [clock.swing(leg) >= 0.0 for leg in range(4)]
        found += [((step + 1) * dt, leg) for leg in range(4) if now[leg] and not was[leg]]
        was = now
    return found


def test_the_names_of_gaits_are_known() -> None:
    assert set(GAITS) == {"trot", "crawl", "pace", "bound", "pronk"}
    assert GaitController(gait="bound").gait == "bound"


@pytest.mark.parametrize("name", NAMES)
def test_each_foot_stands_for_its_duty(name: str) -> None:
    clock = GaitClock(GAITS[name])
    steps = 1000
    standing = [0] * 4
    for _ in range(steps):
        clock.advance(clock.period / steps)
        for leg in range(4):
            standing[leg] += clock.swing(leg) < 0.0
    assert all(abs(count / steps - GAITS[name].duty) <= 0.002 for count in standing)


@pytest.mark.parametrize(
    ("name", "pairs"),
    [("trot", ((0, 3), (1, 2))), ("pace", ((0, 2), (1, 3))), ("bound", ((0, 1), (2, 3))), ("pronk", ((0, 1), (2, 3)))],
)
def test_the_pairs_of_a_gait_move_together(name: str, pairs: tuple[tuple[int, int], ...]) -> None:
    clock = GaitClock(GAITS[name])
    for _ in range(50):
        clock.advance(0.01)
        for one, other in pairs:
            assert clock.swing(one) == pytest.approx(clock.swing(other))


def test_a_crawl_steps_in_the_lateral_sequence_one_foot_at_a_time() -> None:
    fl, fr, rl, rr = range(4)
    order = [leg for _, leg in lifts(GaitClock(GAITS["crawl"]), 3.0)]
    first = order.index(rl)
    assert order[first : first + 4] == [rl, fl, rr, fr]
    clock = GaitClock(GAITS["crawl"])
    for _ in range(1000):
        clock.advance(0.003)
        assert sum(clock.swing(leg) >= 0.0 for leg in range(4)) <= 1


@pytest.mark.parametrize("name", NAMES)
def test_every_leg_lifts_once_in_every_period(name: str) -> None:
    events = lifts(GaitClock(GAITS[name]), 4 * GAITS[name].period)
    for leg in range(4):
        times = [time for time, who in events if who == leg]
        assert len(times) == 4
        assert [b - a for a, b in pairwise(times)] == pytest.approx([GAITS[name].period] * 3, abs=0.002)


@given(name=names, phase=st.floats(0.0, 0.999), leg=st.integers(0, 3), ahead=st.floats(-1.0, 1.0))
def test_to_look_ahead_is_to_have_advanced(name: str, phase: float, leg: int, ahead: float) -> None:
    seen, there = GaitClock(GAITS[name]), GaitClock(GAITS[name])
    seen.phase = there.phase = phase
    there.advance(ahead)
    difference = abs(seen.leg_phase(leg, ahead) - there.leg_phase(leg))
    assert min(difference, 1.0 - difference) < 1e-9
    assert seen.phase == phase


@given(name=names, phase=st.floats(0.0, 0.999), leg=st.integers(0, 3))
def test_a_swing_is_the_rest_of_the_phase_after_the_stance(name: str, phase: float, leg: int) -> None:
    clock = GaitClock(GAITS[name])
    clock.phase = phase
    mine, duty = (phase + GAITS[name].offsets[leg]) % 1.0, GAITS[name].duty
    expected = (mine - duty) / (1.0 - duty) if mine >= duty else -1.0
    assert clock.swing(leg) == pytest.approx(expected, abs=1e-12)
    assert clock.swing(leg) < 1.0


@pytest.mark.parametrize("name", NAMES)
def test_stance_and_swing_make_up_the_period(name: str) -> None:
    clock = GaitClock(GAITS[name])
    clock.hurry(10.0)
    assert clock.stance_time + clock.swing_time == pytest.approx(clock.period)
    assert clock.stance_time / clock.period == pytest.approx(GAITS[name].duty)


@pytest.mark.parametrize("name", NAMES)
def test_a_walk_begins_with_all_feet_down_just_before_the_first_lifts(name: str) -> None:
    clock = GaitClock(GAITS[name])
    clock.restart()
    assert all(clock.swing(leg) < 0.0 for leg in range(4))
    first, _ = lifts(clock, GAITS[name].period)[0]
    assert first == pytest.approx(0.02 * GAITS[name].period, abs=0.002)


@pytest.mark.parametrize("first", range(4))
@pytest.mark.parametrize("name", NAMES)
def test_the_leg_that_is_to_lift_first_does(name: str, first: int) -> None:
    clock = GaitClock(GAITS["trot"])
    clock.restart(GAITS[name], first)
    assert clock.gait is GAITS[name]
    assert clock.period == GAITS[name].period
    assert clock.swing(first) < 0.0
    when = next(time for time, leg in lifts(clock, GAITS[name].period) if leg == first)
    assert when == pytest.approx(0.02 * GAITS[name].period, abs=0.002)


def test_a_walk_that_settles_lifts_its_first_foot_so_much_later() -> None:
    clock = GaitClock(GAITS["crawl"])
    clock.restart(first=2, settle=0.1)
    when = next(time for time, leg in lifts(clock, 1.0) if leg == 2)
    assert when == pytest.approx(0.1 + 0.02, abs=0.002)


@pytest.mark.parametrize("name", NAMES)
def test_a_hurried_gait_steps_faster_and_within_its_bounds(name: str) -> None:
    gait = GAITS[name]
    slow, fast = gait.hurry
    clock, periods = GaitClock(gait), []
    for speed in (0.0, slow, 0.5 * (slow + fast), fast, 3.0):
        clock.hurry(speed)
        periods.append(clock.period)
    middle = 0.5 * (gait.period + gait.shortest)
    assert periods == pytest.approx([gait.period, gait.period, middle, gait.shortest, gait.shortest])


def test_hurrying_does_not_move_a_foot_at_once() -> None:
    clock = GaitClock(Gait("test", 0.5, 0.6, (0.0, 0.5, 0.5, 0.0)))
    clock.advance(0.2)
    before = clock.phase
    clock.hurry(2.0)
    assert clock.phase == before
    clock.advance(0.035)
    assert clock.phase == pytest.approx(before + 0.035 / 0.35)


@pytest.mark.parametrize("name", [name for name in NAMES if GAITS[name].entry is not None])
def test_a_gait_is_entered_at_speeds_that_it_is_good_for(name: str) -> None:
    entry, most = GAITS[name].entry, GAITS[name].most
    assert entry is not None
    assert most is not None
    for velocity in ((entry.forward, entry.sideways, entry.turn), (-entry.backward, -entry.sideways, -entry.turn)):
        assert most.allows(velocity)
