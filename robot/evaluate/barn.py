"""BARN worlds: does the robot get through a narrow field that it has never seen, and how fast? `python -m robot evaluate barn FOLDER`.

Score of a run = success x OT / clip(t, 2 OT, 8 OT) with OT the reference path at 2 m/s: at most 0.5 (the rule of 2023 and later).
"""

from __future__ import annotations

import json
import statistics
import sys
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict
from datetime import date
from pathlib import Path
from typing import Any

from robot.evaluate.barn_run import Backend, Ended, Outcome, run
from robot.evaluate.barn_worlds import BarnWorld, find_worlds
from robot.evaluate.levels import Metric, machine
from robot.run.arguments import Parser, parse_seed
from robot.sim.physics import BackendMissing

__all__ = ["evaluate", "main", "show"]

_BOUNDS = {"kinematic": (0.25, 0.48, 0.495), "physics": (0.15, 0.32, 0.45)}
"""Of the score: acceptable, good, excellent."""
_ENDS: tuple[Ended, ...] = ("success", "collision", "fall", "time-out", "gave up")


def evaluate(worlds: Sequence[BarnWorld], backend: Backend, seeds: Sequence[int]) -> dict[str, Any]:
    """Walk every world once for each seed, saying on stderr how each run ended. Returns a dict that JSON can hold."""
    outcomes: list[Outcome] = []
    for seed in seeds:
        for world in worlds:
            outcome = run(world, backend, seed)
            outcomes.append(outcome)
            print(_line(outcome), file=sys.stderr, flush=True)
    ends = Counter(outcome.ended for outcome in outcomes)
    walked = [outcome.seconds for outcome in outcomes if outcome.ended == "success"]
    points = statistics.fmean(outcome.score for outcome in outcomes)
    return {
        "backend": backend,
        "seeds": list(seeds),
        "date": date.today().isoformat(),
        "machine": machine(),
        "runs": len(outcomes),
        "ends": {str(name): ends[name] for name in _ENDS},
        "success": ends["success"] / len(outcomes),
        "mean_seconds": statistics.fmean(walked) if walked else None,
        "score": points,
        "bounds": _BOUNDS[backend],
        "level": Metric("score", "", _BOUNDS[backend], lambda _: points, larger_is_better=True).level(points),
        "outcomes": [asdict(outcome) for outcome in outcomes],
    }


def show(result: dict[str, Any]) -> str:
    """The runs and their summary as text."""
    here, ends = result["machine"], result["ends"]
    lines = [f"{'world':>7}{'seed':>6}  {'ended':<11}{'seconds':>8}{'score':>8}"]
    lines += [_line(Outcome(**row)) for row in result["outcomes"]]
    least, good, best = result["bounds"]
    seconds = "" if result["mean_seconds"] is None else f", {result['mean_seconds']:.1f} s a success"
    return "\n".join(
        [
            *lines,
            "",
            f"BARN, back end {result['backend']}; pose: legs and IMU alone; map: LiDAR alone",
            f"seeds {', '.join(map(str, result['seeds']))}; {result['date']}; {here['processor']}, {here['cores']} cores, "
            f"Python {here['python']}, MuJoCo {here['mujoco']}",
            f"{result['runs']} runs: {ends['success']} successes ({100 * result['success']:.1f} %), {ends['collision']} collisions, "
            f"{ends['fall']} falls, {ends['time-out']} time-outs, {ends['gave up']} given up{seconds}",
            f"score {result['score']:.4f} of 0.5 (acceptable {least}, good {good}, excellent {best}): "
            f"{result['level'] or 'below acceptable'}",
        ]
    )


def _line(outcome: Outcome) -> str:
    what = f"  {outcome.touched}" if outcome.touched else ""
    return f"{outcome.world:>7}{outcome.seed:>6}  {outcome.ended:<11}{outcome.seconds:>8.1f}{outcome.score:>8.3f}{what}"


def main(argv: Sequence[str] | None = None) -> int:
    """Run the worlds of a folder; 0 if the score is at least acceptable, 1 if not, 3 without the physics back end. Raises `UsageError`."""
    parser = Parser(prog="python -m robot evaluate barn", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("folder", type=Path, help="folder with BARN worlds as JSON files, or one such file")
    parser.add_argument(
        "--backend", choices=("physics", "kinematic"), default="physics", help="the body (default: physics)"
    )
    parser.add_argument("--seeds", type=parse_seed, nargs="+", default=[1], help="each world once for every seed")
    parser.add_argument("--worlds", type=int, nargs="+", metavar="N", help="only the worlds with these indices")
    parser.add_argument("--json", action="store_true", help="print JSON instead of a table")
    asked = parser.parse_args(argv)
    worlds = find_worlds(asked.folder, asked.worlds)
    try:
        result = evaluate(worlds, asked.backend, asked.seeds)
    except BackendMissing as error:
        print(error, file=sys.stderr)
        return 3
    print(json.dumps(result, indent=2) if asked.json else show(result))
    return 0 if result["level"] else 1


if __name__ == "__main__":
    from robot.evaluate.command import main as command

    raise SystemExit(command(["barn", *sys.argv[1:]]))
