"""Many independent trials: in several processes if wanted, and not run again when an earlier command has kept how they went."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context
from pathlib import Path
from typing import Any, TypeAlias

from robot.run.arguments import Parser, parse_seed, whole
from robot.run.errands import UsageError

__all__ = ["Outcome", "trial_parser", "trials"]


Outcome: TypeAlias = dict[str, Any]
"""How one trial went, as JSON can hold it; under ``seed`` the trial's own: no two of a command have the same."""


def trial_parser(name: str, description: str, takes: str) -> Parser:
    """A command line for `python -m robot evaluate NAME` with --seed, --jobs, --resume, --quick and --json."""
    made = Parser(prog=f"python -m robot evaluate {name}", description=description, epilog=f"All of it takes {takes}.")
    made.add_argument(
        "--seed", type=parse_seed, default=1, help="of the first trial; the next have the next (default 1)"
    )
    made.add_argument("--quick", action="store_true", help="a tenth of it")
    made.add_argument("--jobs", type=whole(1, 256), default=1, metavar="N", help="processes (default 1)")
    made.add_argument(
        "--resume", type=Path, metavar="FILE", help="keep each outcome here, and do not run again what is kept"
    )
    made.add_argument("--json", action="store_true", help="print JSON instead of text")
    return made


def trials(
    run: Callable[[int], Outcome],
    seeds: Sequence[int],
    *,
    jobs: int,
    file: Path | None,
    tell: Callable[[Outcome], str],
    what: str,
) -> list[Outcome]:
    """The outcomes of all seeds, in their order; each is told on stderr as soon as it is there.

    `file` keeps them, a line of JSON each, for the same `what`: a text that says what is run. Raises `UsageError` for a file of something else.
    """
    done = _kept(file, what)
    found: list[Outcome] = []
    with _pool(jobs) as pool:
        outcomes = pool(run, [seed for seed in seeds if seed not in done])
        for number, seed in enumerate(seeds, start=1):
            outcome = done.get(seed)
            if outcome is None:
                outcome = next(outcomes)
                if file is not None:
                    with file.open("a", encoding="utf-8") as out:
                        out.write(json.dumps({"what": what, "outcome": outcome}) + "\n")
            found.append(outcome)
            print(f"[{number}/{len(seeds)}] {tell(outcome)}", file=sys.stderr, flush=True)
    return found


def _kept(file: Path | None, what: str) -> dict[int, Outcome]:
    if file is None or not file.exists():
        return {}
    try:
        lines = [json.loads(line) for line in file.read_text(encoding="utf-8").splitlines()]
        return {line["outcome"]["seed"]: line["outcome"] for line in lines if line["what"] == what}
    except (OSError, ValueError, TypeError, KeyError) as error:
        raise UsageError(f"--resume {file}: these are no outcomes of an earlier run: {error}") from error


@contextmanager
def _pool(jobs: int) -> Generator[Callable[[Callable[[int], Outcome], Sequence[int]], Iterator[Outcome]]]:
    """What runs many, in their order: in so many processes, or in this one."""
    if jobs == 1:
        yield map
        return
    with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
        yield pool.map
