"""What each number of navigation decides: every one 20 % down and up, one at a time, on worlds that none was chosen on.

`python -m tests.figures sensitivity`. The kinematic body walks the same worlds with the same sensor noise for each value, so outcomes are
compared world by world. The worlds are `field_world(9001)` and on: seeds that nothing else in the repository uses.
"""

from __future__ import annotations

import os
import statistics
import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, replace
from math import sqrt
from multiprocessing import get_context
from types import MappingProxyType
from typing import Any, Final, TypeAlias

from cli.command import UsageError
from robot.run.arguments import whole
from tests.figures.barn_run import LIMIT, Outcome, run
from tests.figures.field_worlds import PASSAGE, field_world
from tests.figures.measurement import Measurement, Result
from tests.figures.unmapped import SHEET

FIRST_SEED: Final = 9001
"""Of the held-out worlds; the tests' are below 1000."""
SHARE: Final = 0.2
"""By how much a number is changed, of itself."""
NOISE_SEED: Final = 1
"""Of the sensors, in every run."""
CONFIDENCE: Final = statistics.NormalDist().inv_cdf(0.975)
"""Standard deviations to each side of an interval that covers 95 %."""

_FOLLOWING = {
    "comfort": "m", "touch": "m", "squeeze": "m", "tight": "m", "tight_turn": "rad", "tight_look": "m", "insistence": "m",
    "offered_over": "m", "ease": "m", "flutter": "m", "rounding": "m", "spacing": "m", "search_back": "m", "search_ahead": "m",
    "lookahead": "m", "lookahead_time": "s", "turn_from": "rad", "turn_until": "rad", "turn_gain": "1/s", "side_gain": "1/s",
    "bend": "", "least_share": "", "braking": "m/s2", "usual_room": "m", "least_braking": "m", "approach": "m",
    "approach_speed": "m/s", "approach_gain": "1/s", "threading_gain": "1/s", "threading_speed": "m/s", "yaw_gain": "",
    "yaw_length": "m/rad", "pose_ahead": "m", "price_over": "m", "closeness_price": "m", "off_price": "", "turn_price": "m/rad",
    "change_price": "s",
}  # fmt: skip
_NAVIGATOR = {
    "side_room": "m", "contact": "m", "look": "m", "gain": "", "off_path": "m", "pause": "s", "relaxed_pause": "s",
    "poses_pause": "s", "release": "s", "patience": "s", "held": "s", "recovered": "m", "latency": "s",
}  # fmt: skip
THRESHOLDS: Final[Mapping[str, str]] = MappingProxyType(
    {
        "margins.roomy": "m",
        "margins.tight": "m",
        "limits.creep": "m/s",
        "limits.eagerness": "1/s",
        "limits.acceleration": "m/s2",
        "limits.turn_acceleration": "rad/s2",
    }
    | {f"config.following.{name}": unit for name, unit in _FOLLOWING.items()}
    | {f"config.{name}": unit for name, unit in _NAVIGATOR.items()}
)
"""What is varied, as attributes of a `Tuning`, and its unit."""
LEFT_OUT: Final[Mapping[str, str]] = MappingProxyType(
    {
        "config.misfits": "a count",
        "config.near_goal": "for goals inside of things only",
        "config.most_walked": "for goals that are never reached",
        "config.aside": "for goals that are never reached",
        "config.most_recoveries": "a count",
        "config.following.poses_searched": "a count",
        "config.following.price_ahead": "a count",
        "config.following.fan_turns": "a count",
        "config.following.slower": "a list",
        "config.following.fan": "a list",
        "config.following.no_way": "no division by zero",
        "config.following.no_speed": "no division by zero",
        "config.straight_look": "for straight ways only",
        "config.braking": "for straight ways only",
        "config.sight": "with depth cameras only",
        "config.sight_room": "with depth cameras only",
        "config.groping_speed": "with depth cameras only",
        "config.step_speed": "with depth cameras only",
        "config.step_ahead": "with depth cameras only",
        "config.slope_speed": "where the map shows slopes only",
        "config.slope_ahead": "where the map shows slopes only",
        "config.first_step": "for the first period only",
        "config.longest_step": "for late periods only",
        "config.usual_pace": "for the display only",
    }
)
"""What is not varied, and why."""

Numbers: TypeAlias = Sequence[float]


# --- arithmetic ----------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Interval:
    """An estimate and the interval that covers the true value in 95 of 100 cases."""

    value: float
    low: float
    high: float


def wilson(successes: int, trials: int) -> Interval:
    """A share, and its interval after Wilson (1927): it stays within 0 and 1, and has a width at 0 and 1, too."""
    z, share = CONFIDENCE, successes / trials
    spread = 1.0 + z * z / trials
    middle = (share + z * z / (2.0 * trials)) / spread
    half = z / spread * sqrt(share * (1.0 - share) / trials + z * z / (4.0 * trials * trials))
    return Interval(share, max(middle - half, 0.0), min(middle + half, 1.0))


def difference(changed: Numbers, before: Numbers) -> Interval:
    """The mean of the differences, pair by pair, and its interval: normal, from their standard deviation; of one pair there is none."""
    gaps = [a - b for a, b in zip(changed, before, strict=True)]
    mean = statistics.fmean(gaps)
    half = CONFIDENCE * statistics.stdev(gaps) / sqrt(len(gaps)) if len(gaps) > 1 else float("inf")
    return Interval(mean, mean - half, mean + half)


def value_of(settings: Any, path: str) -> float:
    """The number at a path of attributes divided by dots."""
    for name in path.split("."):
        settings = getattr(settings, name)
    return float(settings)


def scaled(settings: Any, path: str, factor: float) -> Any:
    """`settings` with the number at this path multiplied."""
    name, _, rest = path.partition(".")
    value = getattr(settings, name)
    return replace(settings, **{name: scaled(value, rest, factor) if rest else value * factor})


# --- walking -------------------------------------------------------------------------------------------------------


def _walk(seed: int, path: str, factor: float) -> Outcome:
    """Through the world of this seed; without a path, with every number as it is."""
    return run(field_world(seed), "kinematic", NOISE_SEED, scaled(SHEET, path, factor) if path else SHEET)


@contextmanager
def _walkers(jobs: int) -> Generator[Callable[[Sequence[tuple[int, str, float]]], Iterator[Outcome]]]:
    """What walks many runs, in their order: in so many processes, or in this one."""
    if jobs == 1:
        yield lambda runs: (_walk(*one) for one in runs)
        return
    with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
        yield lambda runs: pool.map(_walk, *zip(*runs, strict=True))


def vary(names: Sequence[str], seeds: Sequence[int], jobs: int) -> dict[str, Any]:
    """Walk every world as is, then once for each number and direction; says on stderr how far it is. A dict that JSON can hold."""
    factors = (1.0 - SHARE, 1.0 + SHARE)
    runs = [(seed, "", 1.0) for seed in seeds]
    runs += [(seed, name, factor) for name in names for factor in factors for seed in seeds]
    rows: list[dict[str, Any]] = []
    with _walkers(jobs) as walk:
        outcomes = walk(runs)
        usual = _summary([next(outcomes) for _ in seeds])
        for number, name in enumerate(names, start=1):
            down, up = (_summary([next(outcomes) for _ in seeds]) for _ in factors)
            rows.append({
                "name": name, "unit": THRESHOLDS[name], "value": value_of(SHEET, name), "down": down, "up": up,
            })  # fmt: skip
            print(f"[{number}/{len(names)}] {_row(rows[-1], usual)}", file=sys.stderr, flush=True)
    return {
        "backend": "kinematic", "share": SHARE, "worlds": list(seeds), "seed": NOISE_SEED, "passage": PASSAGE,
        "usual": usual, "thresholds": rows,
    }  # fmt: skip


def _summary(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    through = [outcome.ended == "success" for outcome in outcomes]
    return {
        "successes": sum(through),
        "scores": [outcome.score for outcome in outcomes],
        "seconds": [outcome.seconds if good else LIMIT for outcome, good in zip(outcomes, through, strict=True)],
    }


# --- telling -------------------------------------------------------------------------------------------------------


def show(result: Mapping[str, Any]) -> str:
    """What `vary` gave, as text."""
    here, usual, seeds = result["machine"], result["usual"], result["worlds"]
    rows = result["thresholds"]
    counts = {usual["successes"], *(row[way]["successes"] for row in rows for way in ("down", "up"))}
    legend = (f"{count}: {_percent(wilson(count, len(seeds)))}" for count in sorted(counts, reverse=True))
    return "\n".join(
        [
            f"navigation, each number {100 * result['share']:.0f} % down and up, back end {result['backend']}",
            f"{len(seeds)} worlds a value, field_world({seeds[0]}) to ({seeds[-1]}); {result['date']}; {here['processor']}, "
            f"{here['cores']} cores, Python {here['python']}",
            "",
            f"{'threshold':<30}{'value':>7} {'unit':<7}{'through':>12}{'seconds':>20}{'score':>24}{'score, down':>18} {'score, up':>18}",
            *(_row(row, usual) for row in rows),
            "",
            f"through: of {len(seeds)} worlds, down / as is / up; 95 % (Wilson) of {', '.join(legend)}",
            f"seconds, score: means, down / as is / up; a failure counts {LIMIT:.0f} s and 0",
            "score, down and up: difference from as is, world by world, with its 95 % interval; * where that leaves out 0",
        ]
    )


def _row(row: Mapping[str, Any], usual: Mapping[str, Any]) -> str:
    three = (row["down"], usual, row["up"])
    through = " / ".join(str(one["successes"]) for one in three)
    seconds = " / ".join(f"{statistics.fmean(one['seconds']):.1f}" for one in three)
    score = " / ".join(f"{statistics.fmean(one['scores']):.3f}" for one in three)
    changes = "".join(f"{_change(difference(one['scores'], usual['scores'])):>19}" for one in (three[0], three[2]))
    name = row["name"].removeprefix("config.")
    return f"{name:<30}{row['value']:>7.4g} {row['unit']:<7}{through:>12}{seconds:>20}{score:>24}{changes}"


def _change(gap: Interval) -> str:
    clear = gap.low > 0.0 or gap.high < 0.0
    return f"{gap.value:+.3f} +- {gap.high - gap.value:.3f}{'*' if clear else ' '}"


def _percent(share: Interval) -> str:
    return f"{100 * share.low:.0f} .. {100 * share.high:.0f} %"


def _take(asked: Namespace) -> Result:
    for part in asked.only:
        if not any(part in name for name in THRESHOLDS):
            known = ", ".join(name.removeprefix("config.") for name in THRESHOLDS)
            raise UsageError(f"--only {part}: no threshold's name contains that; there are: {known}")
    names = [name for name in THRESHOLDS if any(part in name for part in asked.only)]
    return Result(vary(names, range(FIRST_SEED, FIRST_SEED + asked.worlds), asked.jobs), show)


def _arguments(parser: ArgumentParser) -> None:
    parser.add_argument("--worlds", type=whole(1, 1000), default=20, metavar="N", help="worlds a value (default 20)")
    parser.add_argument(
        "--only", nargs="+", default=[""], metavar="NAME", help="only thresholds whose names contain one of these"
    )
    cores = os.cpu_count() or 1
    parser.add_argument("--jobs", type=whole(1, 256), default=cores, metavar="N", help=f"processes (default {cores})")


MEASUREMENT = Measurement(
    "sensitivity",
    "what each number of navigation decides: every one 20 % down and up, on worlds that none was chosen on",
    "two hours on an idle core",
    _arguments,
    _take,
)
