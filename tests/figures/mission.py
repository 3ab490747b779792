"""A mission of two hours: does the robot patrol, dock, charge and go on without help, and does it know what each leg will take?

`python -m tests.figures mission`. The whole robot on the virtual clock. Before each leg the energy is predicted from its planned path; the
prediction learns from the legs before.
"""

from __future__ import annotations

import statistics
from argparse import ArgumentParser, Namespace
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

from robot.assembly import BodyKind
from robot.hardware.sensors import SensorKind
from robot.run.arguments import within
from robot.scenes.worlds import WORLDS
from tests.figures.fidelity import Fidelity, add_fidelity
from tests.figures.measurement import heading
from tests.figures.mission_run import Leg, Outcome, mission
from tests.figures.trials import enough, of_trials

HOURS = 2.0
QUICK = 0.2
"""Hours of a mission with --quick."""
WITHIN = 3.0
"""Per cent by which a prediction may be wrong."""
ENOUGH = 95.0
"""Per cent of the legs for which it has to hold."""
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


def run(seed: int, hours: float, backend: BodyKind, world: str, sensors: SensorKind, actuators: SensorKind) -> Outcome:
    """One mission by its seed."""
    return mission(seed, 3600.0 * hours, backend, Fidelity(sensors, actuators), world)


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
            f"energy predicted within {WITHIN:g} %  {result['within']} of {result['predicted']} legs after the first {LEARNING}, wanted {ENOUGH:g} %{errors}",
        ]
    )


def tell(one: Outcome) -> str:
    """An outcome as a line."""
    reached = sum(leg["outcome"] == "succeeded" for leg in one.legs)
    return f"seed {one.seed}: {reached} of {len(one.legs)} legs, {one.charges} charges, {one.falls} falls, {one.walked:.0f} m"


def _how(asked: Namespace) -> dict[str, Any]:
    hours = asked.hours or (QUICK if asked.quick else HOURS)
    return {"hours": hours, "world": asked.world, "backend": asked.backend, **Fidelity.of(asked).told}


def _arguments(parser: ArgumentParser) -> None:
    parser.add_argument("--hours", type=within(0.01, 100.0, "hours"), help=f"of each (default {HOURS:g})")
    parser.add_argument(
        "--backend", choices=("physics", "kinematic"), default="physics", help="the body (default: physics)"
    )
    parser.add_argument("--world", choices=WORLDS, default=WORLDS[0], help=f"where (default {WORLDS[0]})")
    add_fidelity(parser)


MEASUREMENT = of_trials(
    "mission",
    "two hours of patrol with docking and charging: goals, falls, and the energy of each leg",
    "hours in physics, ten minutes kinematic",
    run=run,
    outcome=Outcome,
    how=_how,
    tell=tell,
    summary=summary,
    show=show,
    good=lambda told: (
        told["falls"] == 0 and told["reached"] == told["goals"] and enough(told["within"], told["predicted"], ENOUGH)
    ),
    arguments=_arguments,
    many=1,
    quick="a tenth of the time",
)
