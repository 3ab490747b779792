"""The scenario of docs/simulation.md is a test file as printed, and passes."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from actors.testing import scenario  # noqa: F401  # loads numpy here: pytester unloads what a test loads, and numpy allows that once

PAGE = Path(__file__).parents[2] / "docs" / "simulation.md"


def pytest_here(pytester: pytest.Pytester, *arguments: str) -> pytest.RunResult:
    return pytester.runpytest_inprocess(
        "-p", "actors.testing.plugin", "-p", "no:cacheprovider", "-p", "no:looptime_plugin",
        "-o", "asyncio_default_fixture_loop_scope=function", *arguments,
    )  # fmt: skip


def test_the_scenario_passes_and_a_guard_that_reacts_too_late_is_found_out(pytester: pytest.Pytester) -> None:
    (code,) = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    lost = ("--replay", "1 fifo lose:/temperature>/guard#89")  # 109 degrees
    pytester.makepyfile(test_oven=code, test_late=code.replace("> 100.0", "> 108.0"))
    pytest_here(pytester, "test_oven.py").assert_outcomes(passed=1)
    pytest_here(pytester, "test_oven.py", *lost).assert_outcomes(passed=1)
    pytest_here(pytester, "test_late.py", *lost).assert_outcomes(failed=1)
