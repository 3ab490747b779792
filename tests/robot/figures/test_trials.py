"""Trials that are kept, and not run again."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from cli.command import UsageError
from tests.figures.trials import each, enough


def square(seed: int) -> dict[str, Any]:
    return {"seed": seed, "value": seed * seed}


def refused(seed: int) -> dict[str, Any]:
    raise AssertionError(f"{seed} was run again")


def told(run: Any, seeds: range, file: Path | None, what: str = "squares", jobs: int = 1) -> list[int]:
    return [one["value"] for one in each(run, seeds, jobs=jobs, file=file, what=what)]


def test_outcomes_come_in_the_order_of_the_seeds_from_one_process_or_several() -> None:
    assert told(square, range(2, 6), None) == [4, 9, 16, 25]
    assert told(square, range(2, 6), None, jobs=2) == [4, 9, 16, 25]


def test_what_a_file_keeps_is_not_run_again_and_what_it_lacks_is(tmp_path: Path) -> None:
    file = tmp_path / "kept.jsonl"
    assert told(square, range(3), file) == [0, 1, 4]
    assert told(refused, range(3), file) == [0, 1, 4]
    with pytest.raises(AssertionError, match="3 was run again"):
        told(refused, range(4), file)
    with pytest.raises(AssertionError, match="0 was run again"):
        told(refused, range(1), file, what="cubes")


def test_another_kind_of_file_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "letter.txt"
    file.write_text("Dear robot,\n")
    with pytest.raises(UsageError, match="no outcomes of an earlier run"):
        told(square, range(1), file)


def test_a_share_is_judged_by_as_many_as_there_are_and_one_miss_refutes_none() -> None:
    cases = {(4, 4): True, (3, 4): True, (2, 4): False, (0, 1): False, (38, 40): True, (37, 40): False, (0, 0): True}
    assert {case: enough(*case, 95.0) for case in cases} == cases
