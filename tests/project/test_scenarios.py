"""What the tutorials promise: each promise is shown by tests that exist."""

from __future__ import annotations

import re
from functools import cache

from tests.scenarios.rows import ROOT, Row, read_rows

ROWS = read_rows()


@cache
def functions_in(file: str) -> frozenset[str]:
    return frozenset(re.findall(r"^(?:async )?def (test_\w+)", (ROOT / file).read_text(encoding="utf-8"), re.MULTILINE))


def is_shown(row: Row, above: tuple[str, ...] = ()) -> bool:
    others = [ROWS[name] for name in row.rows if name != row.id and name not in above]
    return bool(row.tests or row.reason) or (bool(others) and all(is_shown(one, (*above, row.id)) for one in others))


def test_every_promise_is_shown_by_tests_that_exist_or_by_other_promises() -> None:
    lost = [
        test
        for row in ROWS.values()
        for test in row.tests
        if test.partition("::")[2] not in functions_in(test.partition("::")[0])
    ]
    assert lost == []
    assert [row.id for row in ROWS.values() if not is_shown(row)] == []


def test_there_are_540_promises_and_few_have_a_reason_instead_of_a_test() -> None:
    assert len(ROWS) == 540
    assert sum(bool(row.reason) for row in ROWS.values()) <= 15
