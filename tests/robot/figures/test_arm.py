"""`python -m tests.figures arm`: its arithmetic lines, and the shortest duration that it compares with."""

from __future__ import annotations

import json

import numpy as np
import pytest

from tests.figures import arm_measures
from tests.figures.__main__ import main
from tests.figures.arm_measures import _shortest_of_one


@pytest.fixture(autouse=True)
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(arm_measures, "MOTIONS", 6)
    monkeypatch.setattr(arm_measures, "POSES", 200)


def test_the_quick_lines_are_within_their_bounds(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["arm", "--only", "share", "--seeds", "7", "--json"]) == 0
    report = json.loads(capsys.readouterr().out)
    assert report["backend"] == "physics and kinematic"
    assert [row["name"] for row in report["metrics"]] == [
        "largest share of speed limit",
        "largest share of acceleration limit",
        "largest share of jerk limit",
    ]
    assert all(0.3 < row["median"] <= 1.000001 for row in report["metrics"])
    assert arm_measures.tip_error(7) < 1e-9
    assert arm_measures.angle_error(7) < 1e-9
    assert 0.05 < arm_measures.stopping_time(7) < 0.5
    assert 1.0 < arm_measures.duration_ratio(7) < 1.5


@pytest.mark.parametrize("way", [0.001, 0.02, 0.4, 3.0])
def test_the_shortest_duration_is_that_of_full_jerk_full_acceleration_full_speed(way: float) -> None:
    v, a, j = 2.0, 8.0, 80.0
    duration = _shortest_of_one(way, v, a, j)
    # the same profile, integrated: jerk +, 0, - up to the middle, and its mirror image after it
    ramp = min(a / j, duration / 4)
    hold = min(v / (a if ramp == a / j else j * ramp) - ramp, duration / 2 - 2 * ramp) if ramp == a / j else 0.0
    times = np.linspace(0.0, duration / 2, 200_001)
    jerk = np.where(times < ramp, j, np.where(times < ramp + hold, 0.0, np.where(times < 2 * ramp + hold, -j, 0.0)))
    step = times[1] - times[0]
    speed = np.cumsum(np.cumsum(jerk) * step) * step
    assert speed.max() <= v + 1e-3
    assert 2.0 * speed.sum() * step == pytest.approx(way, rel=1e-3)
