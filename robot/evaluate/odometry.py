"""How well the robot knows where it is, on the physics back end: odometry from legs and IMU, the pose on the map, and the gyro's calibration.

`python -m robot evaluate odometry`. The loop is the robot's own: noisy sensors, estimator, 200 Hz control; the truth is only compared with.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

from robot.evaluate import odometry_measures as take
from robot.evaluate import walk_measures
from robot.evaluate.levels import Metric, conclude, measure, parser
from robot.run.arguments import within
from robot.sim.physics import BackendMissing

__all__ = ["main", "metrics"]

TAKES = "half an hour on an idle machine"
"""How long all of it takes, for those who wait."""


def metrics(delay: float, distance: float, seconds: float) -> tuple[Metric, ...]:
    """All lines, for a motor delay (s), the length of the walk without a map (m) and of the patrol with one (s)."""
    far_enough = distance >= 100.0
    nothing = (None, None, None)
    return (
        Metric(
            f"odometry error over {distance:g} m, no map",
            "%",
            (5.0, 1.5, 0.5) if far_enough else nothing,
            lambda seed: walk_measures.odometry_error(seed, delay, distance),
        ),
        Metric("speed rmse of the estimate", "m/s", nothing, lambda seed: take.walk(seed, delay).speed, quick=True),
        Metric("roll and pitch rmse", "deg", nothing, lambda seed: take.walk(seed, delay).tilt, quick=True),
        Metric("height rmse", "m", nothing, lambda seed: take.walk(seed, delay).height, quick=True),
        Metric("yaw drift", "deg/min", nothing, lambda seed: take.walk(seed, delay).yaw_drift, quick=True),
        Metric(
            f"pose error with map, {seconds:g} s patrol", "m", (0.10, 0.03, 0.01),
            lambda seed: take.patrol(seed, delay, seconds).place, quick=True,
        ),
        Metric(
            f"heading error with map, {seconds:g} s patrol", "deg", nothing,
            lambda seed: take.patrol(seed, delay, seconds).heading, quick=True,
        ),
        Metric(
            f"distance walked in the {seconds:g} s patrol", "m", nothing,
            lambda seed: take.patrol(seed, delay, seconds).walked, quick=True,
        ),
        Metric(
            "gyro bias error, calibrated lying", "rad/s", (3e-4, 3e-4, 3e-4),
            lambda seed: take.calibration_error(seed, delay, standing=False), quick=True,
        ),
        Metric(
            "gyro bias error, calibrated standing", "rad/s", (3e-4, 3e-4, 3e-4),
            lambda seed: take.calibration_error(seed, delay, standing=True), quick=True,
        ),
    )  # fmt: skip


def main(argv: Sequence[str] | None = None) -> int:
    """Command line; 0 if every metric is at least acceptable, 1 if one is not, 3 without the physics back end. Raises `UsageError`."""
    line = parser("odometry", (__doc__ or "").split("\n")[0], takes=TAKES)
    line.add_argument("--delay", type=within(0.0, 20.0, "milliseconds"), default=4.0, help="motor delay, ms")
    line.add_argument(
        "--distance", type=within(1.0, 10_000.0, "metres"), default=100.0, help="length of the walk without a map, m"
    )
    line.add_argument(
        "--seconds", type=within(1.0, 3600.0, "seconds"), default=60.0, help="length of the patrol with a map"
    )
    asked = line.parse_args(argv)
    delay = asked.delay / 1000.0
    try:
        result = measure(
            metrics(delay, asked.distance, asked.seconds),
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
    return conclude(f"where the robot is, motor delay {asked.delay:g} ms, noisy sensors", result, as_json=asked.json)
