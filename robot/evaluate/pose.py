"""How far the pose on the map is from the truth on a patrol: the whole robot in physics, with a LiDAR that turns while the body walks.

`python -m robot evaluate pose`. Every pose that the localizer publishes, 50 a second, is held against the true one of its instant.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from functools import partial
from math import sqrt
from typing import Any

from robot.evaluate.fidelity import Fidelity, add_fidelity
from robot.evaluate.pose_run import OnMap, patrol
from robot.evaluate.trials import circumstances, heading, trial_parser, trials
from robot.model.actuators import MOTOR_DELAY
from robot.run.arguments import whole, within
from robot.scenes.worlds import WORLDS
from robot.sim.physics import check_engine

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


def run(seed: int, seconds: float, world: str, fidelity: Fidelity) -> dict[str, Any]:
    """One patrol by its seed, as JSON can hold how it went."""
    return asdict(patrol(seed, MOTOR_DELAY, seconds, fidelity, world))


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


def tell(held: Mapping[str, Any]) -> str:
    """One line of an outcome that JSON holds."""
    one = OnMap(**held)
    said = f"; said {', '.join(one.said)}" if one.said else ""
    return (
        f"seed {one.seed}: rms {1000 * one.place:.1f} mm, worst {1000 * one.worst:.1f} mm, {one.walked:.0f} m, "
        f"{one.goals} goals, {one.falls} falls{said}"
    )


def main(argv: Sequence[str] | None = None) -> int:
    """Print the figures; 0 within both bounds and without a fall, 1 otherwise. Raises `UsageError`, `BackendMissing`."""
    parser = trial_parser("pose", (__doc__ or "").split("\n")[0], "twenty minutes on an idle core")
    parser.add_argument("--trials", type=whole(1, 10000), metavar="N", help=f"how many patrols (default {TRIALS})")
    parser.add_argument(
        "--seconds", type=within(1.0, 3600.0, "seconds"), default=SECONDS, help=f"of each (default {SECONDS:g})"
    )
    parser.add_argument("--world", choices=WORLDS, default=WORLDS[0], help=f"whose patrol (default {WORLDS[0]})")
    add_fidelity(parser)
    asked = parser.parse_args(argv)
    check_engine()
    many, began, fidelity = (
        asked.trials or (TRIALS // 10 if asked.quick else TRIALS),
        time.monotonic(),
        Fidelity.of(asked),
    )
    told = trials(
        partial(run, seconds=asked.seconds, world=asked.world, fidelity=fidelity), range(asked.seed, asked.seed + many),
        jobs=asked.jobs, file=asked.resume, tell=tell, what=f"pose in {asked.world}, {asked.seconds:g} s, {fidelity}",
    )  # fmt: skip
    how = {"world": asked.world, "seconds": asked.seconds, **fidelity.told}
    result: dict[str, Any] = summary([OnMap(**held) for held in told]) | circumstances(asked, began) | how
    print(json.dumps(result, indent=2) if asked.json else show(result))
    return 0 if result["rms"] <= RMS and result["worst"] <= WORST and result["falls"] == 0 else 1


if __name__ == "__main__":
    from robot.evaluate.command import main as command

    raise SystemExit(command(["pose", *sys.argv[1:]]))
