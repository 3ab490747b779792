"""How well the robot walks, measured on the physics back end and held against three bounds a metric.

`python -m tests.figures walk`. The closed loop is the robot's own: sensors and drives as they are, motor delay, estimator, 200 Hz control.
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Iterator

from cli.command import UsageError
from robot.model.robot import ModelError
from robot.run.arguments import within
from robot.sim.model_file import find_model
from robot.testing import FAULTS, Conditions
from tests.figures import walk_gaits as gaits
from tests.figures import walk_measures as take
from tests.figures.fidelity import Fidelity, add_fidelity
from tests.figures.levels import Metric, of_metrics
from tests.figures.walk_ladder import ladder


def metrics(given: Conditions, minutes: float) -> tuple[Metric, ...]:
    """All lines, for what the robot has to cope with and a length of the endurance runs."""
    return (*_legs(), *_speeds(given), *_endurance(given, minutes), *_strength(given), *_cost(given), *_gaits(given))


def _legs() -> Iterator[Metric]:
    """The legs' kinematics against themselves."""
    yield Metric("leg: |FK(IK(p)) - p|", "m", (1e-9, 1e-9, 1e-9), take.point_error, quick=True)
    yield Metric("leg: |IK(FK(q)) - q|", "rad", (1e-9, 1e-9, 1e-9), take.inverse_error, quick=True)
    yield Metric("leg: Jacobian", "m/rad", (1e-6, 1e-6, 1e-6), take.jacobian_error, quick=True)


def _speeds(given: Conditions) -> Iterator[Metric]:
    """How exactly a velocity is walked."""

    def speed(vx: float, wz: float = 0.0) -> Callable[[int], float]:
        return lambda seed: take.speed_error(seed, given, (vx, 0.0, wz))

    yield Metric("speed rmse at 0.3 m/s", "m/s", (0.10, 0.05, 0.02), speed(0.3), quick=True)
    yield Metric("speed rmse at 0.6 m/s", "m/s", (0.10, 0.05, 0.02), speed(0.6), quick=True)
    yield Metric("speed rmse at 1.0 m/s", "m/s", (0.10, 0.05, 0.02), speed(1.0), quick=True)
    yield Metric("speed rmse at 1.6 m/s", "m/s", (None, None, 0.05), speed(1.6), quick=True)
    yield Metric("yaw rate rmse at 1.0 rad/s", "rad/s", (0.10, 0.03, 0.01), speed(0.0, 1.0), quick=True)


def _endurance(given: Conditions, minutes: float) -> Iterator[Metric]:
    """Falls in long runs."""
    seconds = 60.0 * minutes

    def endured(asked: float) -> float | None:
        """No falls, if the runs are as long as the column asks."""
        return 0.0 if minutes >= asked else None

    yield Metric(
        f"falls in {minutes:g} min of random commands",
        "",
        (endured(2.0), endured(10.0), None),
        lambda seed: take.falls(seed, given, seconds),
        quick=True,
    )
    yield Metric(
        f"falls in {minutes:g} min with 40 N s pushes",
        "",
        (None, None, endured(10.0)),
        lambda seed: take.falls(seed, given, seconds, 40.0),
    )


def _strength(given: Conditions) -> Iterator[Metric]:
    """What it withstands and climbs, and how fast it gets."""

    def push(x: float, y: float) -> Callable[[int], float]:
        return lambda seed: take.largest_push(seed, given, (x, y))

    def slope(direction: str) -> Callable[[int], float]:
        return lambda seed: take.steepest(seed, given, direction)

    yield Metric("push to the left, worst phase", "N s", (15.0, 30.0, 50.0), push(0.0, 1.0), True)
    yield Metric("push to the right, worst phase", "N s", (15.0, 30.0, 50.0), push(0.0, -1.0), True)
    yield Metric("push forward, worst phase", "N s", (30.0, 70.0, 90.0), push(1.0, 0.0), True)
    yield Metric("push back, worst phase", "N s", (30.0, 70.0, 90.0), push(-1.0, 0.0), True)
    yield Metric("slope up", "deg", (10.0, 20.0, 30.0), slope("up"), True)
    yield Metric("slope down", "deg", (10.0, 20.0, 30.0), slope("down"), True)
    yield Metric("slope across", "deg", (10.0, 20.0, 30.0), slope("across"), True)
    yield Metric("step up, blind", "m", (0.05, 0.10, 0.15), lambda seed: take.step_up(seed, given), True)
    yield Metric("box field", "m", (0.04, 0.08, 0.12), lambda seed: take.box_field(seed, given), True)
    yield Metric("top speed held 20 s", "m/s", (0.8, 1.3, 1.6), lambda seed: take.top_speed(seed, given), True)


def _cost(given: Conditions) -> Iterator[Metric]:
    """What walking costs, how far off the odometry is, and how long a control step takes."""
    yield Metric(
        "total cost of transport at 1.0 m/s",
        "",
        (1.8, 1.4, 1.1),
        lambda seed: take.cost_of_transport(seed, given, 1.0),
        quick=True,
    )
    yield Metric(
        "odometry error over 100 m", "%", (5.0, 1.5, 0.5), lambda seed: take.odometry_error(seed, given), quick=True
    )
    yield Metric(
        "odometry error over 100 m of rough floor",
        "%",
        (5.0, 1.5, 0.5),
        lambda seed: take.rough_odometry_error(seed, given),
    )
    yield Metric(
        "controller and estimator, one step",
        "ms",
        (None, None, None),
        lambda seed: take.control_cost(seed, given),
        quick=True,
    )


def _gaits(given: Conditions) -> Iterator[Metric]:
    """The gaits beside the trot, changes between gaits, slippery ground, failing sensors."""

    def error(gait: str, speed: float) -> Callable[[int], float]:
        return lambda seed: gaits.speed_error(seed, given, gait, speed)

    def sway(gait: str, speed: float) -> Callable[[int], float]:
        return lambda seed: gaits.sway(seed, given, gait, speed)

    unbound = (None, None, None)
    for gait, speeds in (("crawl", (0.1, 0.3)), ("pace", (0.3, 0.8)), ("bound", (0.3, 0.8)), ("pronk", (0.3, 0.8))):
        for speed in speeds:
            yield Metric(f"{gait}: speed error at {speed} m/s", "%", unbound, error(gait, speed))
        yield Metric(f"{gait}: roll or pitch sd at {speeds[1]} m/s", "deg", unbound, sway(gait, speeds[1]))
    yield Metric("falls in 20 gait switches", "", unbound, lambda seed: gaits.switch_falls(seed, given))
    yield Metric(
        "falls at friction 0.2, 0.6 m/s", "", unbound, lambda seed: gaits.slippery_falls(seed, given, 0.2, 0.6)
    )
    yield Metric(f"falls in {len(FAULTS)} sensor faults", "", unbound, lambda seed: gaits.fault_falls(seed, given))


def _metrics(asked: Namespace) -> tuple[Metric, ...]:
    if asked.robot is None:
        return metrics(Fidelity.of(asked).conditions(asked.delay / 1000.0), asked.minutes)
    try:
        model = find_model(asked.robot)
    except ModelError as error:
        raise UsageError(f"--robot: {error}") from None
    return tuple(ladder(Fidelity.of(asked).conditions(asked.delay / 1000.0, model), asked.minutes, model))


def _title(asked: Namespace) -> str:
    whose = "walking" if asked.robot is None else f"walking of {asked.robot}"
    return f"{whose}, motor delay {asked.delay:g} ms, {Fidelity.of(asked)}"


def _arguments(parser: ArgumentParser) -> None:
    parser.add_argument("--delay", type=within(0.0, 20.0, "milliseconds"), default=8.0, help="motor delay, ms")
    parser.add_argument(
        "--minutes", type=within(0.1, 600.0, "minutes"), default=2.0, help="length of each endurance run"
    )
    parser.add_argument(
        "--robot",
        metavar="NAME|FILE",
        help="measure this robot, spot, go2 or a MJCF or URDF file, by what does not depend on size and mass",
    )
    add_fidelity(parser)


MEASUREMENT = of_metrics(
    "walk",
    "speed, pushes, endurance, top speed, energy and odometry of the gait, in physics",
    "half an hour on an idle machine",
    _metrics,
    _title,
    settings=lambda asked: {"delay_ms": asked.delay, "robot": asked.robot, **Fidelity.of(asked).told},
    arguments=_arguments,
)
