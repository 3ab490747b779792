"""How well the robot knows where it is, on the physics back end: odometry from legs and IMU, the pose on the map, and the gyro's calibration.

`python -m tests.figures odometry`. The loop is the robot's own: sensors and drives as they are, estimator, 200 Hz control; the truth is only compared with.
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from functools import partial

from robot.run.arguments import within
from tests.figures import odometry_measures as take
from tests.figures import walk_measures
from tests.figures.fidelity import Fidelity, add_fidelity
from tests.figures.levels import Metric, of_metrics
from tests.figures.odometry_run import astray
from tests.figures.pose_run import patrol


def metrics(delay: float, distance: float, seconds: float, fidelity: Fidelity) -> tuple[Metric, ...]:
    """All lines, for a motor delay (s), the length of the walks without a map (m) and of the patrol with one (s)."""
    given = fidelity.conditions(delay)
    far_enough = distance >= 100.0
    nothing = (None, None, None)
    return (
        Metric(
            f"odometry error over {distance:g} m, no map",
            "%",
            (5.0, 1.5, 0.5) if far_enough else nothing,
            lambda seed: walk_measures.odometry_error(seed, given, distance),
        ),
        Metric(
            f"odometry error over {distance:g} m of rough floor, no map", "%", (5.0, 1.5, 0.5) if far_enough else nothing,
            lambda seed: walk_measures.rough_odometry_error(seed, given, distance),
        ),
        *(
            Metric(
                f"odometry error over {distance:g} m of a hall{', rough floor' if rough else ''}, no map, {words}",
                "%", (5.0, 1.5, 0.5) if far_enough else nothing,
                partial(astray, delay=delay, fidelity=fidelity, distance=distance, rough=rough, scans=scans),
            )
            for rough in (False, True)
            for scans, words in ((True, "with LiDAR"), (False, "without"))
        ),
        Metric("speed rmse of the estimate", "m/s", nothing, lambda seed: take.walk(seed, given).speed, quick=True),
        Metric("roll and pitch rmse", "deg", nothing, lambda seed: take.walk(seed, given).tilt, quick=True),
        Metric("height rmse", "m", nothing, lambda seed: take.walk(seed, given).height, quick=True),
        Metric("yaw drift", "deg/min", nothing, lambda seed: take.walk(seed, given).yaw_drift, quick=True),
        Metric(
            f"pose error with map, {seconds:g} s patrol", "m", (0.10, 0.03, 0.01),
            lambda seed: patrol(seed, delay, seconds, fidelity).place, quick=True,
        ),
        Metric(
            f"largest pose error with map, {seconds:g} s patrol", "m", nothing,
            lambda seed: patrol(seed, delay, seconds, fidelity).worst, quick=True,
        ),
        Metric(
            f"heading error with map, {seconds:g} s patrol", "deg", nothing,
            lambda seed: patrol(seed, delay, seconds, fidelity).heading, quick=True,
        ),
        Metric(
            f"distance walked in the {seconds:g} s patrol", "m", nothing,
            lambda seed: patrol(seed, delay, seconds, fidelity).walked, quick=True,
        ),
        Metric(
            "gyro bias error, calibrated lying", "rad/s", (3e-4, 3e-4, 3e-4),
            lambda seed: take.calibration_error(seed, delay, fidelity, standing=False), quick=True,
        ),
        Metric(
            "gyro bias error, calibrated standing", "rad/s", (1e-3, 5e-4, 3e-4),
            lambda seed: take.calibration_error(seed, delay, fidelity, standing=True), quick=True,
        ),
    )  # fmt: skip


def _metrics(asked: Namespace) -> tuple[Metric, ...]:
    return metrics(asked.delay / 1000.0, asked.distance, asked.seconds, Fidelity.of(asked))


def _arguments(parser: ArgumentParser) -> None:
    parser.add_argument("--delay", type=within(0.0, 20.0, "milliseconds"), default=4.0, help="motor delay, ms")
    parser.add_argument(
        "--distance", type=within(1.0, 10_000.0, "metres"), default=100.0, help="length of the walk without a map, m"
    )
    parser.add_argument(
        "--seconds", type=within(1.0, 3600.0, "seconds"), default=60.0, help="length of the patrol with a map"
    )
    add_fidelity(parser)


MEASUREMENT = of_metrics(
    "odometry",
    "odometry without a map, pose with one, and the gyro's calibration, in physics",
    "an hour on an idle machine",
    _metrics,
    lambda asked: f"where the robot is, motor delay {asked.delay:g} ms, {Fidelity.of(asked)}",
    settings=lambda asked: {"delay_ms": asked.delay, **Fidelity.of(asked).told},
    arguments=_arguments,
)
