"""What `tests.figures battery` computes: on gauges, packs and levels whose error is known."""

from __future__ import annotations

from math import inf, sqrt

import numpy as np
import pytest

from robot.estimation.battery_gauge import percentage
from robot.model.battery import PackDesign
from robot.sim.battery import Pack
from tests.figures import battery


def test_the_gauge_keeps_its_formula_and_one_that_does_not_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    assert battery.formula_error(1) < 1e-9
    monkeypatch.setattr(battery, "percentage", lambda volts: percentage(volts) + 0.25)
    assert battery.formula_error(1) == pytest.approx(0.25)


def test_a_wrong_word_of_health_is_infinitely_wrong(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(battery, "health", lambda percent: "good")
    assert battery.formula_error(1) == inf


def test_an_estimate_that_is_a_fifth_too_long_is_twenty_per_cent_off(monkeypatch: pytest.MonkeyPatch) -> None:
    class TooLong(battery.RuntimeEstimator):
        def seconds(self, state: object) -> float:
            return 1.2 * super().seconds(state)  # type: ignore[arg-type]

    monkeypatch.setattr(battery, "DRAWS", 2)
    exact = battery.runtime_error(1, 0.0, 25.0, PackDesign())
    monkeypatch.setattr(battery, "RuntimeEstimator", TooLong)
    assert exact < 2.0
    assert battery.runtime_error(1, 0.0, 25.0, PackDesign()) == pytest.approx(20.0, abs=1.2 * exact)


def test_the_gauge_error_is_the_root_of_the_mean_square() -> None:
    pack, gaps = Pack(100.0), list[float]()
    while pack.state.soc > 0.02:
        pack.step(10.0, 403.0)
        shown = np.clip((pack.state.gauge_voltage - 10.0) / 2.6 * 100.0, 0.0, 100.0)
        gaps.append(float(shown) - pack.state.percent)
    assert battery.gauge_error(1) == pytest.approx(sqrt(np.mean(np.square(gaps))))


def test_the_levels_change_once_at_each_border_however_the_charge_trembles() -> None:
    assert battery.level_changes(1) == 2.0


def test_charging_takes_as_long_as_the_charger_says() -> None:
    minutes = battery.charge_minutes(1)
    pack = Pack(10.0)
    for _ in range(round(60 * minutes) - 60):
        pack.step(1.0, 120.0, charging=True)
    assert pack.state.percent > 99.0
    assert 60.0 < minutes < 240.0


def test_every_line_is_quick_and_has_a_name_of_its_own() -> None:
    lines = battery.metrics()
    assert len({line.name for line in lines}) == len(lines) == 9
    assert all(line.quick for line in lines)
