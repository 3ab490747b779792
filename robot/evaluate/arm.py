"""The arm: how exact its kinematics are, whether it ever exceeds a limit, how it stops, and whether cups get where they shall go.

`python -m robot evaluate arm`. Lines that depend on a body name it; the others are arithmetic.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence

from robot.evaluate import arm_measures as take
from robot.evaluate.levels import Bounds, Metric, conclude, measure, parser
from robot.sim.physics import BackendMissing

FREE: Bounds = (None, None, None)
EXACT: Bounds = (1e-9, 1e-9, 1e-9)
WITHIN: Bounds = (1.000001, None, None)
"""Shares of a limit: 1 is at the limit, the rest is rounding."""
END: Bounds = (1e-3, None, None)
REACHED: Bounds = (100.0, None, None)

TAKES = "ten minutes on an idle machine"
"""How long all of it takes, for those who wait."""


def metrics() -> tuple[Metric, ...]:
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


def main(argv: Sequence[str] | None = None) -> int:
    """Command line; 0 if every metric is at least acceptable, 1 if one is not, 3 without the physics back end. Raises `UsageError`."""
    asked = parser("arm", (__doc__ or "").split("\n")[0], takes=TAKES).parse_args(argv)
    try:
        result = measure(
            metrics(), asked.seeds, backend="physics and kinematic", quick=asked.quick, only=asked.only, takes=TAKES
        )
    except BackendMissing as error:
        print(error, file=sys.stderr)
        return 3
    return conclude("arm of 4 joints and 6.2 kg", result, as_json=asked.json)


if __name__ == "__main__":
    from robot.evaluate.command import main as command

    raise SystemExit(command(["arm", *sys.argv[1:]]))
