"""How well the robot walks, measured on the physics back end and held against three bounds a metric.

`python -m robot evaluate walk`. The closed loop is the robot's own: knee torque curve, motor delay, noisy sensors, estimator,
200 Hz control.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence

from robot.evaluate import walk_gaits as gaits
from robot.evaluate import walk_measures as take
from robot.evaluate.levels import Metric, conclude, measure, parser
from robot.run.arguments import within
from robot.sim.physics import BackendMissing

__all__ = ["main", "metrics"]

TAKES = "half an hour on an idle machine"
"""How long all of it takes, for those who wait."""


def metrics(delay: float, minutes: float) -> tuple[Metric, ...]:
    """All lines, for a motor delay (s) and a length of the endurance runs."""
    return (*_legs(), *_speeds(delay), *_endurance(delay, minutes), *_strength(delay), *_cost(delay), *_gaits(delay))


def _legs() -> Iterator[Metric]:
    """The legs' kinematics against themselves."""
    yield Metric("leg: |FK(IK(p)) - p|", "m", (1e-9, 1e-9, 1e-9), take.point_error, quick=True)
    yield Metric("leg: |IK(FK(q)) - q|", "rad", (1e-9, 1e-9, 1e-9), take.inverse_error, quick=True)
    yield Metric("leg: Jacobian", "m/rad", (1e-6, 1e-6, 1e-6), take.jacobian_error, quick=True)


def _speeds(delay: float) -> Iterator[Metric]:
    """How exactly a velocity is walked."""

    def speed(vx: float, wz: float = 0.0) -> Callable[[int], float]:
        return lambda seed: take.speed_error(seed, delay, (vx, 0.0, wz))

    yield Metric("speed rmse at 0.3 m/s", "m/s", (0.10, 0.05, 0.02), speed(0.3), quick=True)
    yield Metric("speed rmse at 0.6 m/s", "m/s", (0.10, 0.05, 0.02), speed(0.6), quick=True)
    yield Metric("speed rmse at 1.0 m/s", "m/s", (0.10, 0.05, 0.02), speed(1.0), quick=True)
    yield Metric("speed rmse at 1.6 m/s", "m/s", (None, None, 0.05), speed(1.6), quick=True)
    yield Metric("yaw rate rmse at 1.0 rad/s", "rad/s", (0.10, 0.03, 0.01), speed(0.0, 1.0), quick=True)


def _endurance(delay: float, minutes: float) -> Iterator[Metric]:
    """Falls in long runs."""
    seconds = 60.0 * minutes

    def endured(asked: float) -> float | None:
        """No falls, if the runs are as long as the column asks."""
        return 0.0 if minutes >= asked else None

    yield Metric(
        f"falls in {minutes:g} min of random commands",
        "",
        (endured(2.0), endured(10.0), None),
        lambda seed: take.falls(seed, delay, seconds),
        quick=True,
    )
    yield Metric(
        f"falls in {minutes:g} min with 40 N s pushes",
        "",
        (None, None, endured(10.0)),
        lambda seed: take.falls(seed, delay, seconds, 40.0),
    )


def _strength(delay: float) -> Iterator[Metric]:
    """What it withstands and climbs, and how fast it gets."""

    def push(x: float, y: float) -> Callable[[int], float]:
        return lambda seed: take.largest_push(seed, delay, (x, y))

    def slope(direction: str) -> Callable[[int], float]:
        return lambda seed: take.steepest(seed, delay, direction)

    yield Metric("push to the left, worst phase", "N s", (15.0, 30.0, 50.0), push(0.0, 1.0), True)
    yield Metric("push to the right, worst phase", "N s", (15.0, 30.0, 50.0), push(0.0, -1.0), True)
    yield Metric("push forward, worst phase", "N s", (30.0, 70.0, 90.0), push(1.0, 0.0), True)
    yield Metric("push back, worst phase", "N s", (30.0, 70.0, 90.0), push(-1.0, 0.0), True)
    yield Metric("slope up", "deg", (10.0, 20.0, 30.0), slope("up"), True)
    yield Metric("slope down", "deg", (10.0, 20.0, 30.0), slope("down"), True)
    yield Metric("slope across", "deg", (10.0, 20.0, 30.0), slope("across"), True)
    yield Metric("step up, blind", "m", (0.05, 0.10, 0.15), lambda seed: take.step_up(seed, delay), True)
    yield Metric("box field", "m", (0.04, 0.08, 0.12), lambda seed: take.box_field(seed, delay), True)
    yield Metric("top speed held 20 s", "m/s", (0.8, 1.3, 1.6), lambda seed: take.top_speed(seed, delay), True)


def _cost(delay: float) -> Iterator[Metric]:
    """What walking costs, how far off the odometry is, and how long a control step takes."""
    yield Metric(
        "total cost of transport at 1.0 m/s",
        "",
        (1.8, 1.4, 1.1),
        lambda seed: take.cost_of_transport(seed, delay, 1.0),
        quick=True,
    )
    yield Metric(
        "odometry error over 100 m", "%", (5.0, 1.5, 0.5), lambda seed: take.odometry_error(seed, delay), quick=True
    )
    yield Metric(
        "controller and estimator, one step",
        "ms",
        (None, None, None),
        lambda seed: take.control_cost(seed, delay),
        quick=True,
    )


def _gaits(delay: float) -> Iterator[Metric]:
    """The gaits beside the trot, changes between gaits, slippery ground, failing sensors."""

    def error(gait: str, speed: float) -> Callable[[int], float]:
        return lambda seed: gaits.speed_error(seed, delay, gait, speed)

    def sway(gait: str, speed: float) -> Callable[[int], float]:
        return lambda seed: gaits.sway(seed, delay, gait, speed)

    unbound = (None, None, None)
    for gait, speeds in (("crawl", (0.1, 0.3)), ("pace", (0.3, 0.8)), ("bound", (0.3, 0.8)), ("pronk", (0.3, 0.8))):
        for speed in speeds:
            yield Metric(f"{gait}: speed error at {speed} m/s", "%", unbound, error(gait, speed))
        yield Metric(f"{gait}: roll or pitch sd at {speeds[1]} m/s", "deg", unbound, sway(gait, speeds[1]))
    yield Metric("falls in 20 gait switches", "", unbound, lambda seed: gaits.switch_falls(seed, delay))
    yield Metric(
        "falls at friction 0.2, 0.6 m/s", "", unbound, lambda seed: gaits.slippery_falls(seed, delay, 0.2, 0.6)
    )
    yield Metric("falls in 11 sensor faults", "", unbound, lambda seed: gaits.fault_falls(seed, delay))


def main(argv: Sequence[str] | None = None) -> int:
    """Command line; 0 if every metric is at least acceptable, 1 if one is not, 3 without the physics back end. Raises `UsageError`."""
    line = parser("walk", (__doc__ or "").split("\n")[0], takes=TAKES)
    line.add_argument("--delay", type=within(0.0, 20.0, "milliseconds"), default=8.0, help="motor delay, ms")
    line.add_argument("--minutes", type=within(0.1, 600.0, "minutes"), default=2.0, help="length of each endurance run")
    asked = line.parse_args(argv)
    chosen = metrics(asked.delay / 1000.0, asked.minutes)
    try:
        result = measure(
            chosen,
            asked.seeds,
            backend="physics",
            quick=asked.quick,
            only=asked.only,
            takes=TAKES,
            delay_ms=asked.delay,
        )
    except BackendMissing as error:
        print(error, file=sys.stderr)
        return 3
    title = f"walking, motor delay {asked.delay:g} ms, knee torque curve, noisy estimator"
    return conclude(title, result, as_json=asked.json)


if __name__ == "__main__":
    from robot.evaluate.command import main as command

    raise SystemExit(command(["walk", *sys.argv[1:]]))
