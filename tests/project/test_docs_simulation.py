"""The scenario of docs/simulation.md is a test file as printed, and passes."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.suites import run_pytest

PAGE = Path(__file__).parents[2] / "docs" / "simulation.md"


def test_the_scenario_passes_and_a_guard_that_reacts_too_late_is_found_out(pytester: pytest.Pytester) -> None:
    (code,) = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    lost = ("--scenario-replay", "1 fifo lose:/temperature>/guard#89")  # 109 degrees
    pytester.makepyfile(test_oven=code, test_late=code.replace("> 100.0", "> 108.0"))
    run_pytest(pytester, "test_oven.py").assert_outcomes(passed=1)
    run_pytest(pytester, "test_oven.py", *lost).assert_outcomes(passed=1)
    run_pytest(pytester, "test_late.py", *lost).assert_outcomes(failed=1)
