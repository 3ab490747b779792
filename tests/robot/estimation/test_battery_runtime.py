"""The run time left: within 5 % of the simulated truth after two minutes of steady load, above 20 % of charge."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robot.estimation.battery_runtime import MeanLoad, RuntimeEstimator
from robot.model.battery import PackDesign
from robot.sim.battery import Pack


def settle(estimator: RuntimeEstimator, pack: Pack, load: float, seconds: int) -> None:
    for _ in range(seconds):
        pack.step(1.0, load)
        estimator.update(1.0, load)


def truth(pack: Pack, load: float) -> float:
    seconds = 0
    while pack.state.gauge_voltage >= 10.0:
        pack.step(1.0, load)
        seconds += 1
    return float(seconds)


@pytest.mark.parametrize("before", [202.0, 330.0, 561.0])
@pytest.mark.parametrize("load", [80.0, 202.0, 330.0, 424.0, 561.0])
@pytest.mark.parametrize("percent", [25.0, 60.0])
def test_estimate_is_within_5_percent_after_two_minutes_of_steady_load(
    before: float, load: float, percent: float
) -> None:
    pack = Pack(percent)
    estimator = RuntimeEstimator(pack.design)
    settle(estimator, Pack(percent), before, 300)  # what the robot did before, on another charge
    settle(estimator, pack, load, 120)
    assert pack.state.percent > 20.0
    assert estimator.seconds(pack.state) == pytest.approx(truth(pack, load), rel=0.05)


@pytest.mark.parametrize("load", [202.0, 403.0, 561.0])
def test_estimate_holds_for_the_sheet_pack_and_in_the_cold(load: float) -> None:
    pack = Pack(70.0, series_cells=14, ambient=5.0)
    estimator = RuntimeEstimator(pack.design, ambient=5.0)
    settle(estimator, pack, load, 120)
    assert estimator.seconds(pack.state) == pytest.approx(truth(pack, load), rel=0.05)


def test_estimate_knows_a_relaxing_pack() -> None:
    pack = Pack(50.0, design=PackDesign(relaxation=True))
    estimator = RuntimeEstimator(pack.design)
    settle(estimator, pack, 403.0, 120)
    assert estimator.seconds(pack.state) == pytest.approx(truth(pack, 403.0), rel=0.05)


def test_before_any_load_the_typical_403_w_is_assumed() -> None:
    pack = Pack(100.0)
    assert RuntimeEstimator(pack.design).seconds(pack.state) / 60.0 == pytest.approx(83.6, abs=1.0)


def test_a_short_burst_is_averaged_away_and_a_lasting_change_is_followed() -> None:
    mean = MeanLoad(403.0)
    for _ in range(600):
        mean.update(1.0, 300.0)
    assert mean.watts == pytest.approx(300.0, rel=1e-3)
    for _ in range(5):
        mean.update(1.0, 600.0)
    assert mean.watts < 330.0
    for _ in range(120):
        mean.update(1.0, 600.0)
    assert mean.watts == pytest.approx(600.0, rel=0.03)


@settings(deadline=None)
@given(st.lists(st.tuples(st.floats(0.0, 5.0), st.floats(0.0, 2000.0)), max_size=100))
def test_the_mean_stays_between_what_it_has_seen(samples: list[tuple[float, float]]) -> None:
    mean = MeanLoad(403.0)
    seen = [403.0, *(load for _, load in samples)]
    for dt, load in samples:
        assert min(seen) - 1e-9 <= mean.update(dt, load) <= max(seen) + 1e-9


def test_an_empty_pack_has_no_time_left_and_no_load_has_no_end() -> None:
    estimator = RuntimeEstimator(PackDesign())
    assert estimator.seconds(Pack(5.0).state) == 0.0
    for _ in range(100):
        estimator.update(600.0, 0.0)
    assert estimator.load.watts < 1e-9 or math.isinf(estimator.seconds(Pack(50.0).state))
