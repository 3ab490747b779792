"""Over a hill and back: ramps as part of a world, with goals on top of it, behind it and before it.

`python -m robot evaluate ramps`. The whole robot in physics, sensors and drives as they are, on slippery ground; every seed has a landing and
a height of its own. A seed succeeds when all goals are reached without a fall.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from functools import partial
from typing import Any

import numpy as np

from robot.evaluate.fidelity import add_sensors
from robot.evaluate.room_worlds import Room
from robot.evaluate.rooms_run import Outcome, walk
from robot.evaluate.trials import circumstances, heading, trial_parser, trials
from robot.hardware.sensors import SensorKind
from robot.model.actuators import ActuatorDesign
from robot.run.arguments import whole, within
from robot.scenes.ramps import ramps
from robot.sim.ground import Ground
from robot.sim.physics import check_engine

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


def run(seed: int, degrees: float, friction: float, sight: bool, sensors: SensorKind) -> dict[str, Any]:
    """One seed, as JSON can hold how it went."""
    ground, drives = Ground(friction=friction), ActuatorDesign()
    return asdict(walk(hill(seed, degrees), seed, SPEED, sight=sight, sensors=sensors, ground=ground, actuators=drives))


def succeeded(one: Outcome) -> bool:
    """Whether all goals were reached without a fall."""
    return one.falls == 0 and one.reached == one.goals


def summary(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """The figures of all seeds together, as JSON can hold them."""
    return {
        "trials": len(outcomes),
        "successes": sum(succeeded(one) for one in outcomes),
        "falls": sum(one.falls for one in outcomes),
        "goals": sum(one.goals for one in outcomes),
        "reached": sum(one.reached for one in outcomes),
        "scraped": sum(bool(one.bumps) for one in outcomes),
        "metres": sum(one.walked for one in outcomes),
        "outcomes": [asdict(one) for one in outcomes],
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


def tell(held: Mapping[str, Any]) -> str:
    """One line of an outcome that JSON holds."""
    return Outcome(**held).line("hill")


def main(argv: Sequence[str] | None = None) -> int:
    """Print the figures; 0 if every seed succeeds, 1 otherwise. Raises `UsageError`, `BackendMissing`."""
    parser = trial_parser("ramps", (__doc__ or "").split("\n")[0], "half an hour on a core")
    parser.add_argument("--trials", type=whole(1, 10000), metavar="N", help=f"how many hills (default {TRIALS})")
    parser.add_argument("--degrees", type=within(1.0, 40.0, "degrees"), default=20.0, help="of both ramps (default 20)")
    parser.add_argument("--friction", type=within(0.05, 2.0, "(mu)"), default=0.6, metavar="MU", help="(default 0.6)")
    parser.add_argument("--blind", action="store_true", help="without depth cameras and elevation map")
    add_sensors(parser)
    asked = parser.parse_args(argv)
    check_engine()
    many, began = asked.trials or (TRIALS // 10 if asked.quick else TRIALS), time.monotonic()
    how = {"degrees": asked.degrees, "friction": asked.friction, "sight": not asked.blind, "sensors": asked.sensors}
    told = trials(
        partial(run, **how), range(asked.seed, asked.seed + many), jobs=asked.jobs, file=asked.resume, tell=tell,
        what=f"ramps of {asked.degrees:g} deg, friction {asked.friction:g}, sensors {asked.sensors}{', blind' if asked.blind else ''}",
    )  # fmt: skip
    result: dict[str, Any] = summary([Outcome(**held) for held in told]) | circumstances(asked, began) | how
    print(json.dumps(result, indent=2) if asked.json else show(result))
    return 0 if result["successes"] == many else 1


if __name__ == "__main__":
    from robot.evaluate.command import main as command

    raise SystemExit(command(["ramps", *sys.argv[1:]]))
