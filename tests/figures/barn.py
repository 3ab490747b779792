"""BARN worlds: does the robot get through a narrow field that it has never seen, and how fast? `python -m tests.figures barn FOLDER`.

Score of a run = success x OT / clip(t, 2 OT, 8 OT) with OT the reference path at 2 m/s: at most 0.5 (the rule of 2023 and later).
"""

from __future__ import annotations

import statistics
import sys
from argparse import ArgumentParser, Namespace
from collections import Counter
from collections.abc import Mapping, Sequence
from contextlib import closing
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

from robot.run.arguments import parse_seed
from tests.figures.barn_run import Backend, Ended, Outcome, run
from tests.figures.barn_worlds import BarnWorld, find_worlds
from tests.figures.fidelity import IDEAL, Fidelity, add_fidelity
from tests.figures.levels import Metric
from tests.figures.measurement import Measurement, Result, add_running, heading
from tests.figures.trials import each
from tests.figures.unmapped import SHEET, WALKING, Tuning

_BOUNDS = {"kinematic": (0.25, 0.48, 0.495), "physics": (0.15, 0.32, 0.45)}
"""Of the score: acceptable, good, excellent."""
HULLS: Mapping[str, Tuning] = {"sheet": SHEET, "walking": WALKING}
"""Outlines that may be kept clear of things."""
_ENDS: tuple[Ended, ...] = ("success", "collision", "fall", "time-out", "gave up")


def evaluate(
    worlds: Sequence[BarnWorld],
    backend: Backend,
    seeds: Sequence[int],
    *,
    fidelity: Fidelity = IDEAL,
    hull: str | None = None,
    jobs: int = 1,
    file: Path | None = None,
) -> dict[str, Any]:
    """Walk every world once for each seed, saying on stderr how each run ended. Returns a dict that JSON can hold.

    `hull` is one of `HULLS`, without it the one that goes with the body; `file` keeps the outcomes.
    """
    hull = hull or ("sheet" if backend == "kinematic" else "walking")
    outcomes: list[Outcome] = []
    cases = [(world, seed) for seed in seeds for world in worlds]
    walked = partial(_walked, backend=backend, hull=hull, fidelity=fidelity)
    what = f"BARN, {backend}, hull {hull}, {fidelity}"
    with closing(each(walked, cases, jobs=jobs, file=file, what=what, name=_name)) as told:
        for held in told:
            outcomes.append(Outcome(**held))
            print(_line(outcomes[-1]), file=sys.stderr, flush=True)
    ends = Counter(outcome.ended for outcome in outcomes)
    times = [outcome.seconds for outcome in outcomes if outcome.ended == "success"]
    points = statistics.fmean(outcome.score for outcome in outcomes)
    return {
        "backend": backend,
        "hull": hull,
        **fidelity.told,
        "seeds": list(seeds),
        "runs": len(outcomes),
        "ends": {str(name): ends[name] for name in _ENDS},
        "success": ends["success"] / len(outcomes),
        "mean_seconds": statistics.fmean(times) if times else None,
        "score": points,
        "bounds": _BOUNDS[backend],
        "level": Metric("score", "", _BOUNDS[backend], lambda _: points, larger_is_better=True).level(points),
        "outcomes": [asdict(outcome) for outcome in outcomes],
    }


def _walked(case: tuple[BarnWorld, int], backend: Backend, hull: str, fidelity: Fidelity) -> dict[str, Any]:
    world, seed = case
    return asdict(run(world, backend, seed, HULLS[hull], fidelity))


def _name(case: tuple[BarnWorld, int]) -> list[int]:
    return [case[0].index, case[1]]


def show(result: Mapping[str, Any]) -> str:
    """The runs and their summary as text."""
    ends = result["ends"]
    lines = [f"{'world':>7}{'seed':>6}  {'ended':<11}{'seconds':>8}{'score':>8}"]
    lines += [_line(Outcome(**row)) for row in result["outcomes"]]
    least, good, best = result["bounds"]
    seconds = "" if result["mean_seconds"] is None else f", {result['mean_seconds']:.1f} s a success"
    return "\n".join(
        [
            *lines,
            "",
            f"BARN, back end {result['backend']}, sensors {result['sensors']}, actuators {result['actuators']}, "
            f"hull {result['hull']}; pose: legs and IMU alone; map: LiDAR alone",
            f"seeds {', '.join(map(str, result['seeds']))}; {heading(result)}",
            f"{result['runs']} runs: {ends['success']} successes ({100 * result['success']:.1f} %), {ends['collision']} collisions, "
            f"{ends['fall']} falls, {ends['time-out']} time-outs, {ends['gave up']} given up{seconds}",
            f"score {result['score']:.4f} of 0.5 (acceptable {least}, good {good}, excellent {best}): "
            f"{result['level'] or 'below acceptable'}",
        ]
    )


def _line(outcome: Outcome) -> str:
    what = f"  {outcome.touched}" if outcome.touched else ""
    return f"{outcome.world:>7}{outcome.seed:>6}  {outcome.ended:<11}{outcome.seconds:>8.1f}{outcome.score:>8.3f}{what}"


def _take(asked: Namespace) -> Result:
    worlds = find_worlds(asked.folder, asked.worlds)
    result = evaluate(
        worlds, asked.backend, asked.seeds, fidelity=Fidelity.of(asked), hull=asked.hull, jobs=asked.jobs, file=asked.resume
    )  # fmt: skip
    return Result(result, show, bool(result["level"]))


def _arguments(parser: ArgumentParser) -> None:
    parser.add_argument("folder", type=Path, help="folder with BARN worlds as JSON files, or one such file")
    parser.add_argument(
        "--backend", choices=("physics", "kinematic"), default="physics", help="the body (default: physics)"
    )
    parser.add_argument("--seeds", type=parse_seed, nargs="+", default=[1], help="each world once for every seed")
    parser.add_argument("--worlds", type=int, nargs="+", metavar="N", help="only the worlds with these indices")
    parser.add_argument(
        "--hull", choices=tuple(HULLS), help="outline that is kept clear: the data sheet's 1.1 x 0.5 m, or what walking legs sweep"
        " (default: walking in physics, else sheet)",
    )  # fmt: skip
    add_fidelity(parser)
    add_running(parser)


MEASUREMENT = Measurement(
    "barn",
    "BARN worlds: through narrow fields never seen before, without a map and without the true pose",
    "a minute a world",
    _arguments,
    _take,
)
