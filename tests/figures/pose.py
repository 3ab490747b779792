"""How far the pose on the map is from the truth on a patrol: the whole robot in physics, with a LiDAR that turns while the body walks.

`python -m tests.figures pose`. Every pose that the localizer publishes, 50 a second, is held against the true one of its instant.
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from math import sqrt
from typing import Any

from robot.hardware.sensors import SensorKind
from robot.model.actuators import MOTOR_DELAY
from robot.run.arguments import within
from robot.scenes.worlds import WORLDS
from tests.figures.fidelity import Fidelity, add_fidelity
from tests.figures.measurement import heading
from tests.figures.pose_run import OnMap, patrol
from tests.figures.trials import of_trials

TRIALS = 10
SECONDS = 120.0
"""Of one patrol."""
RMS, WORST = 0.02, 0.05
"""What the error may be, m."""


def summary(outcomes: Sequence[OnMap]) -> dict[str, Any]:
    """The figures of all patrols together, as JSON can hold them: m and degrees."""
    poses = sum(one.poses for one in outcomes)
    return {
        "trials": len(outcomes),
        "poses": poses,
        "rms": sqrt(sum(one.poses * one.place**2 for one in outcomes) / poses),
        "worst": max(one.worst for one in outcomes),
        "heading_rms": sqrt(sum(one.poses * one.heading**2 for one in outcomes) / poses),
        "heading_worst": max(one.worst_heading for one in outcomes),
        "metres": sum(one.walked for one in outcomes),
        "goals": sum(one.goals for one in outcomes),
        "falls": sum(one.falls for one in outcomes),
        "said": sum(len(one.said) for one in outcomes),
        "outcomes": [asdict(one) for one in outcomes],
    }


def run(seed: int, seconds: float, world: str, sensors: SensorKind, actuators: SensorKind) -> OnMap:
    """One patrol by its seed."""
    return patrol(seed, MOTOR_DELAY, seconds, Fidelity(sensors, actuators), world)


def show(result: Mapping[str, Any]) -> str:
    """What was measured, as text."""
    return "\n".join(
        [
            f"pose on the map, patrol of {result['world']}, sensors {result['sensors']}, actuators {result['actuators']}, back end physics",
            heading(result, result["trials"]),
            "",
            f"patrols {result['trials']}; walked {result['metres']:.0f} m, goals {result['goals']}, falls {result['falls']}; poses {result['poses']}",
            f"error in place    rms {1000 * result['rms']:.1f} mm, worst {1000 * result['worst']:.1f} mm"
            f" (wanted {1000 * RMS:g} and {1000 * WORST:g} mm)",
            f"error in heading  rms {result['heading_rms']:.2f} deg, worst {result['heading_worst']:.2f} deg",
            f"changes of what the localizer said of itself  {result['said']}",
        ]
    )


def tell(one: OnMap) -> str:
    """An outcome as a line."""
    said = f"; said {', '.join(one.said)}" if one.said else ""
    return (
        f"seed {one.seed}: rms {1000 * one.place:.1f} mm, worst {1000 * one.worst:.1f} mm, {one.walked:.0f} m, "
        f"{one.goals} goals, {one.falls} falls{said}"
    )


def _how(asked: Namespace) -> dict[str, Any]:
    return {"world": asked.world, "seconds": asked.seconds, **Fidelity.of(asked).told}


def _arguments(parser: ArgumentParser) -> None:
    parser.add_argument(
        "--seconds", type=within(1.0, 3600.0, "seconds"), default=SECONDS, help=f"of each (default {SECONDS:g})"
    )
    parser.add_argument("--world", choices=WORLDS, default=WORLDS[0], help=f"whose patrol (default {WORLDS[0]})")
    add_fidelity(parser)


MEASUREMENT = of_trials(
    "pose",
    "how far the pose on the map is from the truth, on a patrol in physics",
    "twenty minutes on an idle core",
    run=run,
    outcome=OnMap,
    how=_how,
    tell=tell,
    summary=summary,
    show=show,
    good=lambda told: told["rms"] <= RMS and told["worst"] <= WORST and told["falls"] == 0,
    arguments=_arguments,
    many=TRIALS,
)
