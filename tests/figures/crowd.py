"""Goals among ten people who walk about: does the robot reach them, and whom does it touch by its own doing?

`python -m tests.figures crowd`. The whole robot in physics, with sight. People walk straight lines at 0.5 to 1.5 m/s, stop for a robot that
stands right before them, and go another way after two seconds. A contact is the robot's doing when in the half second before it, by its
middle or by a turn, came towards the other faster than 0.05 m/s.
"""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Mapping, Sequence
from typing import Any

from robot.hardware.sensors import SensorKind
from tests.figures.crowd_run import WALKERS, Outcome, walk
from tests.figures.fidelity import add_sensors
from tests.figures.measurement import heading
from tests.figures.trials import enough, of_trials, totals

TRIALS = 10
SECONDS = 120.0
"""Of one trial: ten of them are twenty minutes."""
ENOUGH = 95.0
"""Per cent of the goals that have to be reached."""


def summary(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """The figures of all trials together, as JSON can hold them."""
    return {
        "trials": len(outcomes),
        "minutes": sum(one.seconds for one in outcomes) / 60.0,
        "contacts": sum(len(one.contacts) for one in outcomes),
        "caused": sum(one.caused for one in outcomes),
        **totals(outcomes),
    }


def run(seed: int, sensors: SensorKind) -> Outcome:
    """One trial by its seed."""
    return walk(seed, SECONDS, sensors=sensors)


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


def tell(one: Outcome) -> str:
    """An outcome as a line."""
    touched = "".join(f"; {c['who']} at {c['at']:g} s, towards it {c['towards']:g} m/s" for c in one.contacts)
    failures = "".join(f"; {reason}" for reason in one.failures)
    return f"seed {one.seed}: {one.reached} of {one.goals} goals in {one.seconds:.0f} s, {one.falls} falls{touched}{failures}"


def _how(asked: Namespace) -> dict[str, Any]:
    return {"sensors": asked.sensors}


MEASUREMENT = of_trials(
    "crowd",
    "goals among ten people who walk about, in physics: whom the robot touches",
    "a quarter of an hour on an idle core",
    run=run,
    outcome=Outcome,
    how=_how,
    tell=tell,
    summary=summary,
    show=show,
    good=lambda told: told["falls"] == told["caused"] == 0 and enough(told["reached"], told["goals"], ENOUGH),
    arguments=add_sensors,
    many=TRIALS,
)
