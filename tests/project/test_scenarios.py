"""The table of rows and tests: what it names exists."""

from __future__ import annotations

import ast

from tests.scenarios.rows import ROOT, read_rows


def test_every_test_and_every_row_that_the_table_names_exists() -> None:
    rows = read_rows()
    named = {test for row in rows.values() for test in row.tests}
    functions = {
        f"{path.relative_to(ROOT).as_posix()}::{part.name}"
        for path in (ROOT / "tests").rglob("test_*.py")
        for part in ast.parse(path.read_text(encoding="utf-8")).body
        if isinstance(part, (ast.FunctionDef, ast.AsyncFunctionDef))
    }
    assert named <= functions
    assert {other for row in rows.values() for other in row.rows} <= rows.keys()


def test_there_are_540_rows_of_which_46_are_systems() -> None:
    rows = read_rows()
    assert len(rows) == 540
    assert sum(name.startswith("Y-") for name in rows) == 46


def test_a_range_of_rows_stands_for_each_of_them() -> None:
    assert read_rows()["Y-07"].rows == ("N-10", "N-11", "S-20", "S-21", "X-23")
    assert read_rows()["Y-12"].rows[:2] == ("X-05", "H-05")
    assert "Q-20" in read_rows()["Y-04"].rows


def test_every_row_is_shown_by_tests_in_the_end_or_has_a_reason_and_few_have() -> None:
    rows = read_rows()

    def shown(name: str, above: tuple[str, ...] = ()) -> bool:
        row = rows[name]
        return bool(row.tests or row.reason) or (
            bool(row.rows)
            and name not in above
            and all(shown(other, (*above, name)) for other in row.rows if other != name)
        )

    assert [name for name in rows if not shown(name)] == []
    assert sum(bool(row.reason) for row in rows.values()) <= 15
