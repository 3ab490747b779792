"""The arm: how exact its kinematics are, whether it ever exceeds a limit, how it stops, and whether cups get where they shall go.

`python -m tests.figures arm`. Lines that depend on a body name it; the others are arithmetic.
"""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable

from tests.figures import arm_measures as take
from tests.figures.levels import Bounds, Metric, of_metrics

FREE: Bounds = (None, None, None)
EXACT: Bounds = (1e-9, 1e-9, 1e-9)
WITHIN: Bounds = (1.000001, None, None)
"""Shares of a limit: 1 is at the limit, the rest is rounding."""
END: Bounds = (1e-3, None, None)
REACHED: Bounds = (100.0, None, None)


def metrics(asked: Namespace | None = None) -> tuple[Metric, ...]:
    """All lines."""

    def share(kind: take.Kind) -> Callable[[int], float]:
        return lambda seed: take.limit_share(seed, kind)

    def fetched(backend: take.Backend) -> tuple[Metric, ...]:
        return (
            Metric(
                f"cup carried, {backend}", "%", REACHED,
                lambda seed: 100.0 * take.carried(seed, backend).success, larger_is_better=True,
            ),
            Metric(f"cup off its place, {backend}", "m", (0.05, None, None), lambda seed: take.carried(seed, backend).off),
            Metric(f"fetch and carry takes, {backend}", "s", FREE, lambda seed: take.carried(seed, backend).seconds),
        )  # fmt: skip

    return (
        Metric("|FK(IK(p)) - p|, 5000 poses", "m", EXACT, take.tip_error, quick=True),
        Metric("|IK(FK(q)) - q|, 5000 poses", "rad", EXACT, take.angle_error, quick=True),
        Metric("largest share of speed limit", "", WITHIN, share("speed"), quick=True),
        Metric("largest share of acceleration limit", "", WITHIN, share("acceleration"), quick=True),
        Metric("largest share of jerk limit", "", WITHIN, share("jerk"), quick=True),
        Metric("longest stop after a cancel", "s", FREE, take.stopping_time, quick=True),
        Metric("duration / shortest possible", "", FREE, take.duration_ratio, quick=True),
        Metric("end error, kinematic", "rad", END, lambda seed: take.end_error(seed, "kinematic"), quick=True),
        Metric("end error, physics", "rad", END, lambda seed: take.end_error(seed, "physics"), quick=True),
        Metric(
            "speed rmse at 0.5 m/s, arm stowed, physics",
            "m/s",
            FREE,
            lambda seed: take.walked_with_arm(seed, moving=False),
        ),
        Metric(
            "speed rmse at 0.5 m/s, arm moving, physics",
            "m/s",
            FREE,
            lambda seed: take.walked_with_arm(seed, moving=True),
        ),
        *fetched("kinematic"),
        *fetched("physics"),
    )


MEASUREMENT = of_metrics(
    "arm",
    "the arm's kinematics and limits, how it stops, walking with it, and cups fetched and carried",
    "ten minutes on an idle machine",
    metrics,
    lambda asked: "arm of 4 joints and 6.2 kg",
    backend="physics and kinematic",
)
