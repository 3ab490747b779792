"""Runs vector files against the check modules of the same name and counts what came out."""

from __future__ import annotations

import importlib
import importlib.util
import sys
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import TextIO

from tests.conformance.checks.common import Case, Skip
from tests.conformance.decisions import DECISIONS

CHECKS = "tests.conformance.checks"


@dataclass
class Outcome:
    """What came of one vector file. `skipped_file` says why none of its cases could be run."""

    name: str
    passed: int = 0
    failures: list[tuple[str, str]] = field(default_factory=list)
    edges: list[tuple[str, str]] = field(default_factory=list)
    skipped: list[tuple[str, str]] = field(default_factory=list)
    skipped_file: str | None = None

    def __str__(self) -> str:
        if self.skipped_file:
            return f"{self.name:<28} skipped: {self.skipped_file}"
        counts = f"{self.passed:5} passed {len(self.failures):5} failed {len(self.skipped):5} skipped"
        return f"{self.name:<28}{counts} {len(self.edges):5} edge cases not met"


OURS = "_ours"
"""Vectors of our own stand beside those of ROS 2 and end so: `action_status_ours.json`. The same check runs both."""


def find_check(name: str) -> ModuleType | None:
    """The check module for the vector file with this stem, or None. Errors inside the module are not hidden."""
    name = name.removesuffix(OURS)
    module = f"{CHECKS}.{name}"
    if not name.isidentifier() or importlib.util.find_spec(module) is None:
        return None
    return importlib.import_module(module)


def cases(path: Path) -> Iterator[Case]:
    """The cases of one vector file; the file must have a check module."""
    module = find_check(path.stem)
    if module is None:
        raise LookupError(f"there is no check module {CHECKS}.{path.stem}")
    yield from module.cases(path)


def run_file(path: Path) -> Outcome:
    """Run every case of one vector file."""
    outcome = Outcome(path.stem)
    try:
        if find_check(path.stem) is None:
            outcome.skipped_file = f"no check module checks/{path.stem}.py"
            return outcome
        found = list(cases(path))
    except Exception as error:
        # one broken check module or unreadable file must not hide the other files
        outcome.failures.append((path.name, f"cannot be run: {type(error).__name__}: {error}"))
        return outcome
    for case, tier, check in found:
        try:
            check()
        except Skip as reason:
            outcome.skipped.append((case, str(reason)))
        except Exception as error:
            # any exception is an answer that the vector did not expect
            told = str(error) if isinstance(error, AssertionError) else f"{type(error).__name__}: {error}"
            (outcome.edges if tier == "edge" else outcome.failures).append((case, told.partition("\n")[0]))
        else:
            outcome.passed += 1
    return outcome


def run_folder(folder: Path, out: TextIO = sys.stdout, families: Collection[str] = ()) -> int:
    """Run every vector file of a folder, or those of some families, print the outcomes, and return 1 if a core case failed, else 0."""
    outcomes: list[Outcome] = []
    for path in sorted(folder.glob("*.json")):
        if families and path.stem.removesuffix(OURS) not in families:
            continue
        outcome = run_file(path)
        outcomes.append(outcome)
        print(outcome, file=out)
        for title, items in (("FAILED", outcome.failures), ("edge", outcome.edges), ("skipped", outcome.skipped)):
            for case, reason in items:
                decided = f"; decided: {DECISIONS[case]}" if case in DECISIONS else ""
                print(f"    {title} {case}: {reason}{decided}", file=out)
    failed = sum(len(outcome.failures) for outcome in outcomes)
    passed = sum(outcome.passed for outcome in outcomes)
    edges = sum(len(outcome.edges) for outcome in outcomes)
    skipped = sum(len(outcome.skipped) for outcome in outcomes)
    files = sum(outcome.skipped_file is not None for outcome in outcomes)
    print(
        f"{passed} passed, {failed} failed, {skipped} skipped, {edges} edge cases not met; "
        f"{len(outcomes) - files} files run, {files} without checks",
        file=out,
    )
    return 1 if failed or not outcomes else 0
