"""Many independent trials: in several processes if wanted, and not run again when an earlier command has kept how they went."""

from __future__ import annotations

import json
import sys
import time
from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from datetime import date
from multiprocessing import get_context
from pathlib import Path
from typing import Any, TypeAlias, TypeVar

from cli.command import UsageError
from cli.parsing import Parser
from robot.evaluate.machine import machine
from robot.run.arguments import parse_seed, whole

C = TypeVar("C")

Outcome: TypeAlias = dict[str, Any]
"""How one trial went, as JSON can hold it."""


def trial_parser(
    name: str,
    description: str,
    takes: str,
    *,
    quick: str = "a tenth of it",
    seed: str = "of the first trial; the next have the next",
) -> Parser:
    """A command line for `python -m robot evaluate NAME` with --seed, --jobs, --resume, --quick and --json."""
    made = Parser(prog=f"robactor evaluate {name}", description=description, epilog=f"All of it takes {takes}.")
    made.add_argument("--seed", type=parse_seed, default=1, help=f"{seed} (default 1)")
    made.add_argument("--quick", action="store_true", help=quick)
    add_running(made)
    made.add_argument("--json", action="store_true", help="print JSON instead of text")
    return made


def add_running(parser: ArgumentParser) -> None:
    """Add --jobs and --resume."""
    parser.add_argument("--jobs", type=whole(1, 256), default=1, metavar="N", help="processes (default 1)")
    parser.add_argument(
        "--resume", type=Path, metavar="FILE", help="keep each outcome here, and do not run again what is kept"
    )


def trials(
    run: Callable[[int], Outcome],
    seeds: Sequence[int],
    *,
    jobs: int,
    file: Path | None,
    tell: Callable[[Outcome], str],
    what: str,
) -> list[Outcome]:
    """The outcomes of all seeds, in their order, as `each` has them; each is told on stderr as soon as it is there."""
    found: list[Outcome] = []
    for number, outcome in enumerate(each(run, seeds, jobs=jobs, file=file, what=what), start=1):
        found.append(outcome)
        print(f"[{number}/{len(seeds)}] {tell(outcome)}", file=sys.stderr, flush=True)
    return found


def each(
    run: Callable[[C], Outcome],
    cases: Sequence[C],
    *,
    jobs: int,
    file: Path | None,
    what: str,
    name: Callable[[C], Any] = lambda case: case,
) -> Generator[Outcome]:
    """The outcome of each case, in their order: from `run`, or as `file` has kept it.

    `file` keeps them, a line of JSON each, for the same `what`: a text that says what is run. `name` gives what JSON can hold of a case; no
    two of a command have the same. Raises `UsageError` for a file of something else.
    """
    done = _kept(file, what)
    keys = [json.dumps(name(case)) for case in cases]
    missing = [case for case, key in zip(cases, keys, strict=True) if key not in done]
    with _results(run, missing, jobs) as outcomes:
        for key in keys:
            outcome = done.get(key)
            if outcome is None:
                outcome = next(outcomes)
                if file is not None:
                    with file.open("a", encoding="utf-8") as out:
                        out.write(json.dumps({"what": what, "case": json.loads(key), "outcome": outcome}) + "\n")
            yield outcome


def circumstances(asked: Namespace, began: float) -> dict[str, Any]:
    """What belongs to figures of physics that JSON holds: seed, date, machine, and the wall time since `began` (s, `time.monotonic`)."""
    return {
        "backend": "physics", "seed": asked.seed, "date": date.today().isoformat(), "machine": machine(),
        "wall_seconds": round(time.monotonic() - began, 1),
    }  # fmt: skip


def heading(result: Mapping[str, Any], many: int | None = None) -> str:
    """The circumstances as a line; with the seeds, where there are so `many` trials of one each."""
    here = result["machine"]
    seeds = "" if many is None else f"seeds {result['seed']} to {result['seed'] + many - 1}; "
    return (
        f"{seeds}{result['date']}; {here['processor']}, {here['cores']} cores, Python {here['python']}, MuJoCo {here['mujoco']}; "
        f"{result['wall_seconds']:.0f} s"
    )


def _kept(file: Path | None, what: str) -> dict[str, Outcome]:
    if file is None or not file.exists():
        return {}
    try:
        lines = [json.loads(line) for line in file.read_text(encoding="utf-8").splitlines()]
        return {json.dumps(line["case"]): line["outcome"] for line in lines if line["what"] == what}
    except (OSError, ValueError, TypeError, KeyError) as error:
        raise UsageError(
            f"--resume {file}: these are no outcomes of an earlier run: {error}; name another file, or remove this one"
        ) from error


@contextmanager
def _results(run: Callable[[C], Outcome], cases: Sequence[C], jobs: int) -> Generator[Iterator[Outcome]]:
    """The outcomes of cases, in their order: in so many processes, or in this one."""
    if jobs == 1:
        yield map(run, cases)
        return
    with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
        yield pool.map(run, cases)
