"""How well the battery is known, held against three bounds a metric: the gauge's contract, the run time estimate, the levels.

`python -m tests.figures battery`. The truth is the simulated pack itself, run until its voltage is below 10.0 V; the estimate is the one
that the battery node publishes. No body is involved.
"""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable
from math import inf, sqrt
from random import Random

from robot.estimation.battery_gauge import BatteryGauge, health, percentage, runtime_minutes
from robot.estimation.battery_levels import LevelMonitor
from robot.estimation.battery_runtime import RuntimeEstimator
from robot.hardware.battery import SupplyStatus
from robot.model.battery import EMPTY_VOLTAGE, PackDesign
from robot.model.power import HOTEL_LOAD
from robot.sim.battery import Pack
from tests.figures.levels import Metric, of_metrics

CONTRACT = ((13.2, 100.0, "good"), (12.6, 100.0, "good"), (12.4, 240.0 / 2.6, "good"), (11.3, 50.0, "low"), (10.52, 20.0, "critical"),
            (10.5, 50.0 / 2.6, "critical"), (10.0, 0.0, "critical"), (9.0, 0.0, "critical"))  # fmt: skip
"""Volts, per cent, health: the table of the tutorial's service."""
STEADY = 120.0
"""Seconds of steady load after which the estimate counts."""
DRAWS = 12
"""Loads and charges per seed; the worst of them is the figure."""
LOADS, CHARGES = (150.0, 600.0), (22.0, 100.0)
"""W and per cent; the load of before is drawn from the same range."""
ERROR = (10.0, 5.0, 2.0)


def metrics(asked: Namespace | None = None) -> tuple[Metric, ...]:
    """All lines; each is quick."""

    def runtime(
        *, noise: float = 0.0, ambient: float = 25.0, cells: int = 3, relaxation: bool = False
    ) -> Callable[[int], float]:
        return lambda seed: runtime_error(seed, noise, ambient, PackDesign(series_cells=cells, relaxation=relaxation))

    def line(name: str, take: Callable[[int], float]) -> Metric:
        return Metric(f"run time error, {name}", "%", ERROR, take, quick=True)

    return (
        Metric("formula contract, largest error", "points", (1e-9, 1e-9, 1e-9), formula_error, quick=True),
        line("steady load", runtime()),
        line("load that trembles by 20 %", runtime(noise=0.2)),
        line("pack of 14 cells", runtime(cells=14)),
        line("pack that relaxes", runtime(relaxation=True)),
        line("air of 5 degrees", runtime(ambient=5.0)),
        Metric("voltage gauge against count at 403 W", "points", (None, None, None), gauge_error, quick=True),
        Metric("charge from 10 to 100 %, robot sitting", "min", (None, None, None), charge_minutes, quick=True),
        Metric("level changes at a trembling border", "", (None, None, None), level_changes, quick=True),
    )


def formula_error(seed: int) -> float:
    """Largest deviation from ``(V - 10) / 2.6 * 100`` in 0..100 over the table and 1,000 random voltages; infinite for a wrong health."""
    gauge, random = BatteryGauge(), Random(seed)
    worst = 0.0
    for voltage, percent, word in CONTRACT:
        reading = gauge.read("robot_01", voltage)
        if reading.health_status != word or abs(reading.estimated_runtime_minutes - 1.2 * percent) > 1e-6:
            return inf
        worst = max(worst, abs(reading.percentage - percent))
    for voltage in (random.uniform(8.0, 14.0) for _ in range(1000)):
        exact = min(100.0, max(0.0, (voltage - 10.0) / 2.6 * 100.0))
        worst = max(worst, abs(percentage(voltage) - exact), abs(runtime_minutes(exact) - 1.2 * exact))
        if health(exact) != ("good" if exact > 50.0 else "low" if exact > 20.0 else "critical"):
            return inf
    return worst


def runtime_error(seed: int, noise: float, ambient: float, design: PackDesign) -> float:
    """Worst error of the estimate two minutes after a change of load, per cent of the true run time.

    `noise` is the standard deviation of each tenth of a second's load, as a share of it; `ambient` in degrees Celsius.
    """
    random = Random(seed)
    return max(_one_error(random, noise, ambient, design) for _ in range(DRAWS))


def _one_error(random: Random, noise: float, ambient: float, design: PackDesign) -> float:
    before, load = random.uniform(*LOADS), random.uniform(*LOADS)
    pack = Pack(random.uniform(*CHARGES), ambient=ambient, design=design)
    estimator = RuntimeEstimator(design, ambient=ambient)
    for _ in range(600):
        estimator.update(1.0, before)
    for _ in range(round(STEADY / 0.1)):
        watts = max(HOTEL_LOAD, random.gauss(load, noise * load))
        pack.step(0.1, watts)
        estimator.update(0.1, watts)
    estimate, truth = estimator.seconds(pack.state), 0.0
    while pack.state.gauge_voltage >= EMPTY_VOLTAGE:
        pack.step(1.0, load)
        truth += 1.0
    return 100.0 * abs(estimate - truth) / truth


def gauge_error(seed: int) -> float:
    """Root mean square of the voltage gauge's distance from the true charge under 403 W, points: why decisions use the count."""
    pack, squares = Pack(100.0), list[float]()
    while pack.state.soc > 0.02:
        pack.step(10.0, 403.0)
        squares.append((percentage(pack.state.gauge_voltage) - pack.state.percent) ** 2)
    return sqrt(sum(squares) / len(squares))


def charge_minutes(seed: int) -> float:
    """Minutes on the dock from 10 % until the charger says full, with the robot sitting: nothing but the hotel load of 120 W."""
    pack, seconds = Pack(10.0), 0.0
    while pack.state.status is not SupplyStatus.FULL:
        pack.step(1.0, HOTEL_LOAD, charging=True)
        seconds += 1.0
    return seconds / 60.0


def level_changes(seed: int) -> float:
    """Changes of level while the charge trembles by one point about the borders of 30 and 10 %: one each is right."""
    random, monitor = Random(seed), LevelMonitor()
    changes, level = 0, monitor.level
    for border in (30.0, 10.0):
        for _ in range(1000):
            new = monitor.update(1.0, Pack(border + random.uniform(-1.0, 1.0)).state)
            changes += new is not level
            level = new
    return changes


MEASUREMENT = of_metrics(
    "battery",
    "the gauge's formula, the run time estimate, charging and levels, against the simulated pack",
    "a minute",
    metrics,
    lambda asked: "Battery",
    backend="battery model, no body",
)
