"""A mission of two hours: does the robot patrol, dock, charge and go on without help, and does it know what each leg will take?

`python -m robot evaluate mission`. The whole robot on the virtual clock. Before each leg the energy is predicted from its planned path; the
prediction learns from the legs before.
"""

from __future__ import annotations

import json
import statistics
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from functools import partial
from typing import Any

from robot.assembly import BodyKind
from robot.evaluate.fidelity import Fidelity, add_fidelity
from robot.evaluate.mission_run import Leg, Outcome, mission
from robot.evaluate.trials import circumstances, heading, trial_parser, trials
from robot.run.arguments import whole, within
from robot.scenes.worlds import WORLDS
from robot.sim.physics import check_engine

HOURS = 2.0
QUICK = 0.2
"""Hours of a mission with --quick."""
WITHIN = 3.0
"""Per cent by which a prediction may be wrong."""
LEARNING = 6
"""Legs of the first lap, from which the prediction learns; they are told, and not counted."""


def summary(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """The figures of all missions together, as JSON can hold them."""
    legs = [[Leg(**leg) for leg in one.legs] for one in outcomes]
    goals = [leg for mission_legs in legs for leg in mission_legs if not leg.to_dock]
    docks = [leg for mission_legs in legs for leg in mission_legs if leg.to_dock]
    errors = [
        abs(leg.error)
        for mission_legs in legs
        for leg in [one for one in mission_legs if not one.to_dock and one.outcome == "succeeded"][LEARNING:]
    ]
    return {
        "trials": len(outcomes),
        "hours": sum(one.seconds for one in outcomes) / 3600.0,
        "goals": len(goals),
        "reached": sum(leg.outcome == "succeeded" for leg in goals),
        "docked": sum(leg.outcome == "succeeded" for leg in docks),
        "docking_failed": sum(leg.outcome != "succeeded" for leg in docks),
        "charges": sum(one.charges for one in outcomes),
        "falls": sum(one.falls for one in outcomes),
        "metres": sum(one.walked for one in outcomes),
        "predicted": len(errors),
        "within": sum(error <= WITHIN for error in errors),
        "median_error": statistics.median(errors) if errors else None,
        "worst_error": max(errors, default=None),
        "mean_error": statistics.fmean(errors) if errors else None,
        "cost": statistics.fmean(one.cost for one in outcomes),
        "outcomes": [asdict(one) for one in outcomes],
    }


def run(seed: int, seconds: float, backend: BodyKind, fidelity: Fidelity, world: str) -> dict[str, Any]:
    """One mission by its seed, as JSON can hold how it went."""
    return asdict(mission(seed, seconds, backend, fidelity, world))


def show(result: Mapping[str, Any]) -> str:
    """Every leg, and what was measured, as text."""
    lines = [
        f"{'at s':>8}  {'leg':<12}{'outcome':<12}{'m':>7}{'rad':>7}{'predicted':>11}{'used Wh':>9}{'error %':>9}{'charge %':>10}"
    ]
    for outcome in result["outcomes"]:
        for held in outcome["legs"]:
            leg = Leg(**held)
            lines.append(
                f"{leg.at:>8.0f}  {leg.name:<12}{leg.outcome:<12}{leg.length:>7.1f}{leg.turn:>7.1f}{leg.predicted:>11.3f}{leg.used:>9.3f}"
                f"{leg.error:>+9.1f}{leg.percent:>10.1f}"
            )
    errors = "" if result["median_error"] is None else (
        f"; median {result['median_error']:.2f} %, mean {result['mean_error']:.2f} %, worst {result['worst_error']:.2f} %"
    )  # fmt: skip
    return "\n".join(
        [
            *lines,
            "",
            f"missions in {result['world']}, sensors {result['sensors']}, actuators {result['actuators']}, back end {result['backend']}",
            f"{heading(result, result['trials'])}, {result['cost']:.2f} s of it for a second of a mission",
            "",
            f"missions {result['trials']}, {result['hours']:.2f} h; walked {result['metres']:.0f} m; falls {result['falls']}",
            f"goals reached  {result['reached']} of {result['goals']}",
            f"docked {result['docked']} times, charged {result['charges']} times; dockings that failed {result['docking_failed']}",
            f"energy predicted within {WITHIN:g} %  {result['within']} of {result['predicted']} legs after the first {LEARNING}{errors}",
        ]
    )


def tell(held: Mapping[str, Any]) -> str:
    """One line of an outcome that JSON holds."""
    one = Outcome(**held)
    reached = sum(leg["outcome"] == "succeeded" for leg in one.legs)
    return f"seed {one.seed}: {reached} of {len(one.legs)} legs, {one.charges} charges, {one.falls} falls, {one.walked:.0f} m"


def main(argv: Sequence[str] | None = None) -> int:
    """Print the legs and the figures; 0 without a fall, with every goal reached and every leg predicted, 1 otherwise.

    Raises `UsageError`, `BackendMissing`.
    """
    parser = trial_parser(
        "mission",
        (__doc__ or "").split("\n")[0],
        "hours in physics, ten minutes kinematic",
        quick="a tenth of the time",
    )
    parser.add_argument("--trials", type=whole(1, 1000), default=1, metavar="N", help="how many missions (default 1)")
    parser.add_argument("--hours", type=within(0.01, 100.0, "hours"), help=f"of each (default {HOURS:g})")
    parser.add_argument(
        "--backend", choices=("physics", "kinematic"), default="physics", help="the body (default: physics)"
    )
    parser.add_argument("--world", choices=WORLDS, default=WORLDS[0], help=f"where (default {WORLDS[0]})")
    add_fidelity(parser)
    asked = parser.parse_args(argv)
    fidelity, began = Fidelity.of(asked), time.monotonic()
    if asked.backend == "physics":
        check_engine()
    hours = asked.hours or (QUICK if asked.quick else HOURS)
    told = trials(
        partial(run, seconds=3600.0 * hours, backend=asked.backend, fidelity=fidelity, world=asked.world),
        range(asked.seed, asked.seed + asked.trials), jobs=asked.jobs, file=asked.resume, tell=tell,
        what=f"mission in {asked.world}, {hours:g} h, {asked.backend}, {fidelity}",
    )  # fmt: skip
    result: dict[str, Any] = summary([Outcome(**held) for held in told]) | circumstances(asked, began)
    result |= {"world": asked.world, "backend": asked.backend, **fidelity.told}
    print(json.dumps(result, indent=2) if asked.json else show(result))
    good = result["falls"] == 0 and result["reached"] == result["goals"] and result["within"] == result["predicted"]
    return 0 if good else 1


if __name__ == "__main__":
    from robot.evaluate.command import main as command

    raise SystemExit(command(["mission", *sys.argv[1:]]))
