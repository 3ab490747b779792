"""Random rooms with things on the floor that no map shows: does the robot see what it would walk into, or fall into?

`python -m tests.figures rooms`. The whole robot in physics, with sight: depth cameras and LiDAR with their noise. Each room has three goals; a
goal counts that was reached within a minute.
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Mapping, Sequence
from typing import Any

from robot.hardware.sensors import SensorKind
from robot.run.arguments import within
from tests.figures.fidelity import add_sensors
from tests.figures.measurement import heading
from tests.figures.room_worlds import room
from tests.figures.rooms_run import Outcome, walk
from tests.figures.trials import enough, of_trials, totals

ROOMS = 100
SPEED = 1.0
ENOUGH = 97.0
"""Per cent of the goals that have to be reached."""


def summary(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """The figures of all rooms together, as JSON can hold them."""
    return {
        "rooms": len(outcomes),
        "contacts": sum(bool(one.bumps) for one in outcomes),
        "fastest": max(one.fastest for one in outcomes),
        **totals(outcomes),
    }


def run(seed: int, speed: float, sight: bool, sensors: SensorKind) -> Outcome:
    """One room by its seed."""
    return walk(room(seed), seed, speed, sight=sight, sensors=sensors)


def show(result: Mapping[str, Any]) -> str:
    """What was measured, as text."""
    return "\n".join(
        [
            f"rooms, at up to {result['speed']:g} m/s, {'with' if result['sight'] else 'without'} sight, sensors {result['sensors']}, back end physics",
            heading(result, result["rooms"]),
            "",
            f"rooms {result['rooms']}; walked {result['metres']:.0f} m; highest true speed over half a second {result['fastest']:.2f} m/s",
            f"goals reached  {result['reached']} of {result['goals']} ({result['reached_percent']:.1f} %, wanted {ENOUGH:g})",
            f"falls          {result['falls']}",
            f"rooms in which anything but a foot touched anything  {result['contacts']}",
        ]
    )


def tell(one: Outcome) -> str:
    """An outcome as a line."""
    return one.line("room")


def _how(asked: Namespace) -> dict[str, Any]:
    return {"speed": asked.speed, "sight": not asked.blind, "sensors": asked.sensors}


def _arguments(parser: ArgumentParser) -> None:
    parser.add_argument(
        "--speed", type=within(0.1, 1.6, "m/s"), default=SPEED, help="the fastest walk, m/s (default 1)"
    )
    parser.add_argument("--blind", action="store_true", help="without depth cameras and elevation map, to compare")
    add_sensors(parser)


MEASUREMENT = of_trials(
    "rooms",
    "rooms with things of 5 cm to 2 m, holes and steps down that no map shows, in physics",
    "twenty minutes on a core",
    run=run,
    outcome=Outcome,
    how=_how,
    tell=tell,
    summary=summary,
    show=show,
    good=lambda told: told["falls"] == told["contacts"] == 0 and enough(told["reached"], told["goals"], ENOUGH),
    arguments=_arguments,
    many=ROOMS,
)
