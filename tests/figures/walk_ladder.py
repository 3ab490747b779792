"""How well another robot walks: what `walk --robot NAME` measures, in numbers that do not depend on its size and mass."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from robot.model.robot import RobotModel
from robot.testing import Conditions
from tests.figures import walk_measures as take
from tests.figures.levels import Metric

FROUDE = 0.3
"""Of the walk whose speed and cost are measured: 1.15 m/s of the reference body."""


def ladder(given: Conditions, minutes: float, model: RobotModel) -> Iterator[Metric]:
    """From standing up to the top speed. Bounds are those of the reference body's table, divided by its mass, leg and sqrt(g h)."""
    speed, whole = model.froude(FROUDE), model.froude(1.0)

    def push(x: float, y: float) -> Callable[[int], float]:
        return lambda seed: take.largest_push(seed, given, (x, y), model=model) / model.mass

    yield Metric("stands up", "s", (5.0, None, None), lambda seed: take.rise(seed, given, model), quick=True)
    yield Metric(
        f"speed rmse at Froude {FROUDE}", "%", (5.0, 2.0, 1.0),
        lambda seed: 100.0 * take.speed_error(seed, given, (speed, 0.0, 0.0), model) / speed, quick=True,
    )  # fmt: skip
    yield Metric(
        f"cost of transport at Froude {FROUDE}", "", (1.8, 1.4, 1.1),
        lambda seed: take.cost_of_transport(seed, given, speed, model), quick=True,
    )  # fmt: skip
    yield Metric(
        f"falls in {minutes:g} min of random commands", "", (0.0, None, None),
        lambda seed: take.falls(seed, given, 60.0 * minutes, model=model), quick=True,
    )  # fmt: skip
    yield Metric("push to the left, worst phase", "N s/kg", (0.46, 0.92, 1.5), push(0.0, 1.0), True)
    yield Metric("push forward, worst phase", "N s/kg", (0.92, 2.2, 2.8), push(1.0, 0.0), True)
    yield Metric(
        "slope up", "deg", (10.0, 20.0, 30.0), lambda seed: take.steepest(seed, given, "up", model=model), True
    )
    yield Metric(
        "step up, blind", "legs", (0.08, 0.15, 0.23), lambda seed: take.step_up(seed, given, model=model) / model.leg, True
    )  # fmt: skip
    yield Metric(
        "top speed held 20 s", "Fr", (0.14, 0.38, 0.58),
        lambda seed: (take.top_speed(seed, given, model=model) / whole) ** 2, True,
    )  # fmt: skip
