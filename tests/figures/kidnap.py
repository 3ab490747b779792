"""A robot that is carried elsewhere while it stands: does it know where it is within ten seconds, or say that places are alike?

`python -m tests.figures kidnap`. The whole robot in physics, put down at random places of the built-in worlds and of random rooms. Where a
LiDAR without any error would see the same at another place of the world, the right answer is that it cannot know.
"""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import Any

from robot.hardware.sensors import SensorKind
from tests.figures.fidelity import Fidelity, add_fidelity
from tests.figures.kidnap_run import PLACES, WITHIN, Outcome, carry
from tests.figures.measurement import heading
from tests.figures.trials import of_trials

TRIALS = 20


def right(one: Outcome) -> bool:
    """Whether the robot knows where it is, or says that it cannot."""
    return not one.fallen and one.ended == ("alike" if one.alike else "found")


def summary(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """The figures of all robots together, as JSON can hold them."""
    ends = Counter(one.ended for one in outcomes)
    times = sorted(one.seconds for one in outcomes if one.seconds is not None)
    return {
        "trials": len(outcomes),
        "right": sum(right(one) for one in outcomes),
        "unique": sum(not one.alike for one in outcomes),
        "unique_found": sum(not one.alike and one.ended == "found" for one in outcomes),
        "ends": {end: ends[end] for end in ("found", "alike", "lost", "wrong")},
        "falls": sum(one.fallen for one in outcomes),
        "median_seconds": times[len(times) // 2] if times else None,
        "longest_seconds": times[-1] if times else None,
        "outcomes": [asdict(one) for one in outcomes],
    }


def run(seed: int, worlds: Sequence[str], sensors: SensorKind, actuators: SensorKind) -> Outcome:
    """One robot by its seed. The worlds take turns."""
    return carry(seed, worlds[seed % len(worlds)], Fidelity(sensors, actuators))


def show(result: Mapping[str, Any]) -> str:
    """What was measured, as text."""
    ends = result["ends"]
    times = "" if result["median_seconds"] is None else (
        f"; known after {result['median_seconds']:.1f} s (median), {result['longest_seconds']:.1f} s at most"
    )  # fmt: skip
    return "\n".join(
        [
            f"carried elsewhere in {', '.join(result['worlds'])}; sensors {result['sensors']}, actuators {result['actuators']}, back end physics",
            heading(result, result["trials"]),
            "",
            f"right within {WITHIN:g} s  {result['right']} of {result['trials']}{times}",
            f"places that no other is like  {result['unique']}, of which found {result['unique_found']}",
            f"found {ends['found']}, said to be alike {ends['alike']}, said to be lost {ends['lost']}, taken for another {ends['wrong']}; "
            f"falls {result['falls']}",
        ]
    )


def tell(one: Outcome) -> str:
    """An outcome as a line."""
    when = "" if one.seconds is None else f" after {one.seconds:.1f} s"
    others = f", {one.alike} places like it" if one.alike else ""
    return (
        f"seed {one.seed}: {one.world} at ({one.x:.2f}, {one.y:.2f}, {one.yaw:.2f}){others}: {one.ended}{when}, says {one.said}, "
        f"{one.error:.3f} m off{'' if right(one) else '  WRONG'}"
    )


def _how(asked: Namespace) -> dict[str, Any]:
    return {"worlds": list(asked.worlds), **Fidelity.of(asked).told}


def _arguments(parser: ArgumentParser) -> None:
    parser.add_argument("--worlds", choices=PLACES, nargs="+", default=PLACES, help="where (default: all, in turn)")
    add_fidelity(parser)


MEASUREMENT = of_trials(
    "kidnap",
    "a robot that is carried elsewhere: how soon it knows where it is, or says that places are alike",
    "four minutes on a core",
    run=run,
    outcome=Outcome,
    how=_how,
    tell=tell,
    summary=summary,
    show=show,
    good=lambda told: told["right"] == told["trials"],
    arguments=_arguments,
    many=TRIALS,
)
