"""The rows: what is owed (`rows.txt`), the tests that carry a row's id in their name, and `shown.toml` for the rest."""

from __future__ import annotations

import ast
import re
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

__all__ = ["HERE", "ROOT", "Row", "read_rows", "tests_by_name"]

HERE: Final = Path(__file__).parent
ROOT: Final = HERE.parents[1]

_ID: Final = re.compile(r"(?<![A-Za-z0-9])([A-Z]+)_(\d+[a-z]?)(?![0-9A-Za-z])")
_RANGE: Final = re.compile(r"\b([A-Z]+)-(\d+)([a-z]?)(?:\.\.(?:\1-)?(\d+))?")


@dataclass(frozen=True)
class Row:
    """One behaviour. It is shown by tests (node ids of pytest), by other rows, or has a reason why no test shows it."""

    id: str
    text: str
    tests: tuple[str, ...] = ()
    rows: tuple[str, ...] = ()
    reason: str = ""

    @property
    def open(self) -> bool:
        """Whether nothing shows it."""
        return not (self.tests or self.rows or self.reason)


def read_rows() -> dict[str, Row]:
    """Every row by its id, with what shows it. Raises ValueError for an entry of `shown.toml` that names no row."""
    texts = dict(line.split("\t", 1) for line in (HERE / "rows.txt").read_text(encoding="utf-8").splitlines())
    shown = tomllib.loads((HERE / "shown.toml").read_text(encoding="utf-8"))
    named = tests_by_name()
    for kind in ("tests", "rows", "reasons"):
        if unknown := sorted(shown[kind].keys() - texts.keys()):
            raise ValueError(f"shown.toml, [{kind}]: there is no row {', '.join(unknown)}")
    rows: dict[str, Row] = {}
    for number, text in texts.items():
        others = tuple(shown["rows"].get(number, ())) or (tuple(_named(text, texts)) if number.startswith("Y-") else ())
        tests = (*named.get(number, ()), *shown["tests"].get(number, ()))
        rows[number] = Row(number, text, tests, others, shown["reasons"].get(number, ""))
    return rows


def _named(text: str, known: dict[str, str]) -> Iterator[str]:
    """The rows that the text of a system names, ranges among them: ``S-10..S-15``."""
    for family, first, letter, last in _RANGE.findall(text):
        for number in range(int(first), int(last or first) + 1):
            row = f"{family}-{number:0{len(first)}d}{letter}"
            if row in known:
                yield row


def tests_by_name() -> dict[str, list[str]]:
    """The node ids of the tests that have a row's id in their names, such as ``test_N_30_A_05_...``, by that id."""
    found: dict[str, list[str]] = {}
    for file in sorted((ROOT / "tests").rglob("test_*.py")):
        for name in _functions(file):
            for family, number in _ID.findall(name.removeprefix("test")):
                found.setdefault(f"{family}-{number}", []).append(f"{file.relative_to(ROOT).as_posix()}::{name}")
    return found


def _functions(file: Path) -> Iterator[str]:
    for part in ast.parse(file.read_text(encoding="utf-8")).body:
        if isinstance(part, (ast.FunctionDef, ast.AsyncFunctionDef)) and part.name.startswith("test_"):
            yield part.name
