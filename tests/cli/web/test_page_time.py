"""How the figures of `python -m tests.tools.page_time` are read from a browser's trace."""

from __future__ import annotations

import pytest

from tests.tools.page_time import costs

PAGE, OTHER = {"pid": 1, "tid": 7, "ph": "X"}, {"pid": 1, "tid": 8, "ph": "X"}


def test_script_counts_from_one_picture_to_the_next_on_the_thread_that_draws_in_processor_time() -> None:
    found = costs(
        [
            {**PAGE, "name": "FunctionCall", "ts": 500, "dur": 100, "tdur": 90},  # before the first picture
            {**PAGE, "name": "FireAnimationFrame", "ts": 1000, "dur": 9000, "tdur": 2500},
            {**PAGE, "name": "FunctionCall", "ts": 1010, "dur": 8000, "tdur": 2000},  # draws it
            {**PAGE, "name": "FunctionCall", "ts": 12_000, "dur": 900, "tdur": 500},  # takes a message in
            {**PAGE, "name": "FireAnimationFrame", "ts": 17_000, "dur": 2000, "tdur": 1500},
            {**PAGE, "name": "FunctionCall", "ts": 17_010, "dur": 1900, "tdur": 1000},
            {**OTHER, "name": "FunctionCall", "ts": 17_020, "dur": 99_000, "tdur": 99_000},
            {**PAGE, "name": "ThreadControllerImpl::RunTask", "ts": 900, "dur": 60_000, "tdur": 2600},
            {**OTHER, "name": "ThreadControllerImpl::RunTask", "ts": 900, "dur": 99_000, "tdur": 99_000},
            {"name": "FireAnimationFrame", "ph": "B", "pid": 1, "tid": 8, "ts": 1},
        ]
    )
    assert found.script == [pytest.approx(2.5), pytest.approx(1.0)]
    assert found.longest_task == pytest.approx(2.6)
    assert found.at(100) == pytest.approx(2.5)
