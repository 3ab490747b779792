"""When a reader comes for its samples: the earliest of its ticks counts, and samples are then asked for just before."""

from __future__ import annotations

import random

import pytest

from robot.link.phase import LEAD, TICKS, Phase


def begin_of(ticks: list[float], hz: float = 200.0) -> float:
    phase = Phase(hz)
    for tick in ticks:
        if (begin := phase.tick(tick)) is not None:
            assert begin > tick
            return begin
    raise AssertionError("it has not learned anything")


@pytest.mark.parametrize("seed", range(20))
def test_samples_are_taken_1_5_ms_before_a_reader_that_is_late_at_random(seed: int) -> None:
    rng = random.Random(seed)
    start = rng.uniform(0.0, 1e5)
    ticks = [start + k * 0.005 + rng.choice((0.0001, 0.0002, 0.0005, 0.002)) for k in range(TICKS + 1)]
    due = start + 0.0001 - LEAD
    off = (begin_of(ticks) - due + 0.0025) % 0.005 - 0.0025
    assert 0.0 - 1e-6 <= off <= 0.0002 or off == pytest.approx(0.0, abs=2e-4)


def test_several_looks_within_one_tick_count_as_one() -> None:
    phase = Phase(100.0)
    found = [phase.tick(0.01 * k + 0.0001 * look) for k in range(TICKS + 1) for look in range(3)]
    assert sum(one is not None for one in found) == 1
    assert found[3 * TICKS] is not None
