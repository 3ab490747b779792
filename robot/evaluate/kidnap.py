"""A robot that is carried elsewhere while it stands: does it know where it is within ten seconds, or say that places are alike?

`python -m robot evaluate kidnap`. The whole robot in physics, put down at random places of the built-in worlds and of random rooms. Where a
LiDAR without any error would see the same at another place of the world, the right answer is that it cannot know.
"""

from __future__ import annotations

import json
import sys
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from functools import partial
from typing import Any

from robot.evaluate.fidelity import Fidelity, add_fidelity
from robot.evaluate.kidnap_run import PLACES, WITHIN, Outcome, carry
from robot.evaluate.trials import circumstances, heading, trial_parser, trials
from robot.run.arguments import whole
from robot.sim.physics import check_engine

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


def run(seed: int, worlds: Sequence[str], fidelity: Fidelity) -> dict[str, Any]:
    """One robot by its seed, as JSON can hold how it went. The worlds take turns."""
    return asdict(carry(seed, worlds[seed % len(worlds)], fidelity))


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


def tell(held: Mapping[str, Any]) -> str:
    """One line of an outcome that JSON holds."""
    one = Outcome(**held)
    when = "" if one.seconds is None else f" after {one.seconds:.1f} s"
    others = f", {one.alike} places like it" if one.alike else ""
    return (
        f"seed {one.seed}: {one.world} at ({one.x:.2f}, {one.y:.2f}, {one.yaw:.2f}){others}: {one.ended}{when}, says {one.said}, "
        f"{one.error:.3f} m off{'' if right(one) else '  WRONG'}"
    )


def main(argv: Sequence[str] | None = None) -> int:
    """Print the figures; 0 if every robot is right, 1 otherwise. Raises `UsageError`, `BackendMissing`."""
    parser = trial_parser("kidnap", (__doc__ or "").split("\n")[0], "four minutes on a core")
    parser.add_argument("--trials", type=whole(1, 10000), metavar="N", help=f"how many robots (default {TRIALS})")
    parser.add_argument("--worlds", choices=PLACES, nargs="+", default=PLACES, help="where (default: all, in turn)")
    add_fidelity(parser)
    asked = parser.parse_args(argv)
    check_engine()
    many, began, fidelity = (
        asked.trials or (TRIALS // 10 if asked.quick else TRIALS),
        time.monotonic(),
        Fidelity.of(asked),
    )
    told = trials(
        partial(run, worlds=tuple(asked.worlds), fidelity=fidelity), range(asked.seed, asked.seed + many), jobs=asked.jobs,
        file=asked.resume, tell=tell, what=f"kidnap in {' '.join(asked.worlds)}, {fidelity}",
    )  # fmt: skip
    how = {"worlds": list(asked.worlds), **fidelity.told}
    result: dict[str, Any] = summary([Outcome(**held) for held in told]) | circumstances(asked, began) | how
    print(json.dumps(result, indent=2) if asked.json else show(result))
    return 0 if result["right"] == result["trials"] else 1


if __name__ == "__main__":
    from robot.evaluate.command import main as command

    raise SystemExit(command(["kidnap", *sys.argv[1:]]))
