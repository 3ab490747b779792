"""Over a hill and back: ramps as part of a world, with goals on top of it, behind it and before it.

`python -m tests.figures ramps`. The whole robot in physics, sensors and drives as they are, on slippery ground; every seed has a landing and
a height of its own. A seed succeeds when all goals are reached without a fall.
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from robot.hardware.sensors import SensorKind
from robot.model.actuators import ActuatorDesign
from robot.run.arguments import within
from robot.scenes.ramps import ramps
from robot.sim.ground import Ground
from tests.figures.fidelity import add_sensors
from tests.figures.measurement import heading
from tests.figures.room_worlds import Room
from tests.figures.rooms_run import Outcome, walk
from tests.figures.trials import of_trials, totals

TRIALS = 20
SPEED = 0.7
"""The fastest walk, m/s: that of navigation."""
HEIGHTS, LANDINGS = (0.5, 1.0), (1.6, 3.0)
"""Between which the hill's height and the length of its top are drawn, m."""


def hill(seed: int, degrees: float) -> Room:
    """The world of a seed and its goals: the top, behind the hill, and the start."""
    random = np.random.default_rng([seed, 20])
    scene = ramps(degrees, height=float(random.uniform(*HEIGHTS)), landing=float(random.uniform(*LANDINGS)))
    return Room(scene, (scene.places["top"], scene.places["behind"], scene.places["start"]))


def run(seed: int, degrees: float, friction: float, sight: bool, sensors: SensorKind) -> Outcome:
    """One seed."""
    ground, drives = Ground(friction=friction), ActuatorDesign()
    return walk(hill(seed, degrees), seed, SPEED, sight=sight, sensors=sensors, ground=ground, actuators=drives)


def succeeded(one: Outcome) -> bool:
    """Whether all goals were reached without a fall."""
    return one.falls == 0 and one.reached == one.goals


def summary(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """The figures of all seeds together, as JSON can hold them."""
    return {
        "trials": len(outcomes),
        "successes": sum(succeeded(one) for one in outcomes),
        "scraped": sum(bool(one.bumps) for one in outcomes),
        **totals(outcomes),
    }


def show(result: Mapping[str, Any]) -> str:
    """What was measured, as text."""
    return "\n".join(
        [
            f"ramps of {result['degrees']:g} deg, friction {result['friction']:g}, {'with' if result['sight'] else 'without'} sight, "
            f"sensors {result['sensors']}, drives as they are, back end physics",
            heading(result, result["trials"]),
            "",
            f"over the hill and back  {result['successes']} of {result['trials']}; walked {result['metres']:.0f} m",
            f"goals reached           {result['reached']} of {result['goals']}",
            f"falls                   {result['falls']}",
            f"seeds in which anything but a foot touched anything  {result['scraped']}",
        ]
    )


def tell(one: Outcome) -> str:
    """An outcome as a line."""
    return one.line("hill")


def _how(asked: Namespace) -> dict[str, Any]:
    return {"degrees": asked.degrees, "friction": asked.friction, "sight": not asked.blind, "sensors": asked.sensors}


def _arguments(parser: ArgumentParser) -> None:
    parser.add_argument("--degrees", type=within(1.0, 40.0, "degrees"), default=20.0, help="of both ramps (default 20)")
    parser.add_argument("--friction", type=within(0.05, 2.0, "(mu)"), default=0.6, metavar="MU", help="(default 0.6)")
    parser.add_argument("--blind", action="store_true", help="without depth cameras and elevation map")
    add_sensors(parser)


MEASUREMENT = of_trials(
    "ramps",
    "over ramps of 20 degrees, friction 0.6, to goals on them and behind them and back, in physics",
    "half an hour on a core",
    run=run,
    outcome=Outcome,
    how=_how,
    tell=tell,
    summary=summary,
    show=show,
    good=lambda told: told["successes"] == told["trials"],
    arguments=_arguments,
    many=TRIALS,
)
