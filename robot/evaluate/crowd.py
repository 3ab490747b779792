"""Goals among ten people who walk about: does the robot reach them, and whom does it touch by its own doing?

`python -m robot evaluate crowd`. The whole robot in physics, with sight. People walk straight lines at 0.5 to 1.5 m/s, stop for a robot that
stands right before them, and go another way after two seconds. A contact is the robot's doing when in the half second before it, by its
middle or by a turn, came towards the other faster than 0.05 m/s.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from functools import partial
from typing import Any

from robot.evaluate.crowd_run import WALKERS, Outcome, walk
from robot.evaluate.fidelity import add_sensors
from robot.evaluate.trials import circumstances, heading, trial_parser, trials
from robot.hardware.sensors import SensorKind
from robot.run.arguments import whole
from robot.sim.physics import check_engine

TRIALS = 10
SECONDS = 120.0
"""Of one trial: ten of them are twenty minutes."""
ENOUGH = 95.0
"""Per cent of the goals that have to be reached."""


def summary(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """The figures of all trials together, as JSON can hold them."""
    goals, reached = sum(one.goals for one in outcomes), sum(one.reached for one in outcomes)
    return {
        "trials": len(outcomes),
        "minutes": sum(one.seconds for one in outcomes) / 60.0,
        "goals": goals,
        "reached": reached,
        "reached_percent": 100.0 * reached / goals if goals else 0.0,
        "falls": sum(one.falls for one in outcomes),
        "contacts": sum(len(one.contacts) for one in outcomes),
        "caused": sum(one.caused for one in outcomes),
        "metres": sum(one.walked for one in outcomes),
        "outcomes": [asdict(one) for one in outcomes],
    }


def run(seed: int, seconds: float, sensors: SensorKind) -> dict[str, Any]:
    """One trial by its seed, as JSON can hold how it went."""
    return asdict(walk(seed, seconds, sensors=sensors))


def show(result: Mapping[str, Any]) -> str:
    """What was measured, as text."""
    return "\n".join(
        [
            f"crowd of {WALKERS}, 0.5 to 1.5 m/s, sensors {result['sensors']}, back end physics",
            heading(result, result["trials"]),
            "",
            f"{result['minutes']:.1f} minutes, walked {result['metres']:.0f} m",
            f"goals reached  {result['reached']} of {result['goals']} ({result['reached_percent']:.1f} %, wanted {ENOUGH:g})",
            f"falls          {result['falls']}",
            f"contacts       {result['contacts']}, of which the robot caused {result['caused']}",
        ]
    )


def tell(held: Mapping[str, Any]) -> str:
    """One line of an outcome that JSON holds."""
    one = Outcome(**held)
    touched = "".join(f"; {c['who']} at {c['at']:g} s, towards it {c['towards']:g} m/s" for c in one.contacts)
    failures = "".join(f"; {reason}" for reason in one.failures)
    return f"seed {one.seed}: {one.reached} of {one.goals} goals in {one.seconds:.0f} s, {one.falls} falls{touched}{failures}"


def main(argv: Sequence[str] | None = None) -> int:
    """Print the figures; 0 without a fall or a contact that the robot caused and with enough goals, 1 otherwise. Raises `UsageError`, `BackendMissing`."""
    parser = trial_parser("crowd", (__doc__ or "").split("\n")[0], "a quarter of an hour on an idle core")
    parser.add_argument(
        "--trials", type=whole(1, 10000), metavar="N", help=f"how many of {SECONDS:g} s (default {TRIALS})"
    )
    add_sensors(parser)
    asked = parser.parse_args(argv)
    check_engine()
    many, began = asked.trials or (TRIALS // 10 if asked.quick else TRIALS), time.monotonic()
    told = trials(
        partial(run, seconds=SECONDS, sensors=asked.sensors), range(asked.seed, asked.seed + many), jobs=asked.jobs, file=asked.resume,
        tell=tell, what=f"crowd of {WALKERS}, {SECONDS:g} s, sensors {asked.sensors}",
    )  # fmt: skip
    result: dict[str, Any] = (
        summary([Outcome(**held) for held in told]) | circumstances(asked, began) | {"sensors": asked.sensors}
    )
    print(json.dumps(result, indent=2) if asked.json else show(result))
    good = result["falls"] == result["caused"] == 0 and result["reached_percent"] >= ENOUGH
    return 0 if good else 1


if __name__ == "__main__":
    from robot.evaluate.command import main as command

    raise SystemExit(command(["crowd", *sys.argv[1:]]))
