"""Random rooms with things on the floor that no map shows: does the robot see what it would walk into, or fall into?

`python -m robot evaluate rooms`. The whole robot in physics, with sight: depth cameras and LiDAR with their noise. Each room has three goals; a
goal counts that was reached within a minute.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from functools import partial
from typing import Any

from robot.evaluate.fidelity import add_sensors
from robot.evaluate.room_worlds import room
from robot.evaluate.rooms_run import Outcome, walk
from robot.evaluate.trials import circumstances, heading, trial_parser, trials
from robot.hardware.sensors import SensorKind
from robot.run.arguments import whole, within
from robot.sim.physics import check_engine

ROOMS = 100
SPEED = 1.0
ENOUGH = 97.0
"""Per cent of the goals that have to be reached."""


def summary(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """The figures of all rooms together, as JSON can hold them."""
    goals, reached = sum(one.goals for one in outcomes), sum(one.reached for one in outcomes)
    return {
        "rooms": len(outcomes),
        "goals": goals,
        "reached": reached,
        "reached_percent": 100.0 * reached / goals,
        "falls": sum(one.falls for one in outcomes),
        "contacts": sum(bool(one.bumps) for one in outcomes),
        "metres": sum(one.walked for one in outcomes),
        "fastest": max(one.fastest for one in outcomes),
        "outcomes": [asdict(one) for one in outcomes],
    }


def run(seed: int, speed: float, sight: bool, sensors: SensorKind) -> dict[str, Any]:
    """One room by its seed, as JSON can hold how it went."""
    return asdict(walk(room(seed), seed, speed, sight=sight, sensors=sensors))


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


def tell(held: Mapping[str, Any]) -> str:
    """One line of an outcome that JSON holds."""
    return Outcome(**held).line("room")


def main(argv: Sequence[str] | None = None) -> int:
    """Print the figures; 0 without a fall or a contact and with enough goals, 1 otherwise. Raises `UsageError`, `BackendMissing`."""
    parser = trial_parser("rooms", (__doc__ or "").split("\n")[0], "twenty minutes on a core")
    parser.add_argument("--rooms", type=whole(1, 10000), metavar="N", help=f"how many (default {ROOMS})")
    parser.add_argument(
        "--speed", type=within(0.1, 1.6, "m/s"), default=SPEED, help="the fastest walk, m/s (default 1)"
    )
    parser.add_argument("--blind", action="store_true", help="without depth cameras and elevation map, to compare")
    add_sensors(parser)
    asked = parser.parse_args(argv)
    check_engine()
    many, began = asked.rooms or (ROOMS // 10 if asked.quick else ROOMS), time.monotonic()
    told = trials(
        partial(run, speed=asked.speed, sight=not asked.blind, sensors=asked.sensors), range(asked.seed, asked.seed + many),
        jobs=asked.jobs, file=asked.resume, tell=tell,
        what=f"rooms at {asked.speed:g} m/s, sensors {asked.sensors}{', blind' if asked.blind else ''}",
    )  # fmt: skip
    how = {"speed": asked.speed, "sight": not asked.blind, "sensors": asked.sensors}
    result: dict[str, Any] = summary([Outcome(**held) for held in told]) | circumstances(asked, began) | how
    print(json.dumps(result, indent=2) if asked.json else show(result))
    good = result["falls"] == result["contacts"] == 0 and result["reached_percent"] >= ENOUGH
    return 0 if good else 1


if __name__ == "__main__":
    from robot.evaluate.command import main as command

    raise SystemExit(command(["rooms", *sys.argv[1:]]))
