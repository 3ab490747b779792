"""The scenario of docs/howto/scenarios.md is a test file as printed, and passes."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.suites import run_pytest

PAGE = Path(__file__).parents[2] / "docs" / "howto" / "scenarios.md"


def blocks() -> list[str]:
    """The scenario of one host, that of several, and that with an invariant; the last two need the nodes of the first."""
    return re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)


@pytest.mark.slow(reason="many seeds")
def test_the_scenario_of_several_hosts_passes_and_a_cut_that_lasts_is_found_out(pytester: pytest.Pytester) -> None:
    one, several, _ = blocks()
    forgetful = several.replace("    await lab.recover()\n", "")
    pytester.makepyfile(test_oven=one + several, test_forgetful=one + forgetful)
    named = ("-k", "network_is_back")
    cut = ("--scenario-replay", "1 fifo cut:oven=guard#4200+60")
    run_pytest(pytester, "test_oven.py", *named).assert_outcomes(passed=1, deselected=1)
    run_pytest(pytester, "test_oven.py", *named, *cut).assert_outcomes(passed=1, deselected=1)
    run_pytest(pytester, "test_forgetful.py", *named, *cut).assert_outcomes(failed=1, deselected=1)


def test_the_scenario_passes_and_a_guard_that_reacts_too_late_is_found_out(pytester: pytest.Pytester) -> None:
    code, _, _ = blocks()
    lost = ("--scenario-replay", "1 fifo lose:/temperature>/guard#89")  # 109 degrees
    pytester.makepyfile(test_oven=code, test_late=code.replace("> 100.0", "> 108.0"))
    run_pytest(pytester, "test_oven.py").assert_outcomes(passed=1)
    run_pytest(pytester, "test_oven.py", *lost).assert_outcomes(passed=1)
    run_pytest(pytester, "test_late.py", *lost).assert_outcomes(failed=1)


def test_the_invariant_holds_and_a_broken_one_is_found_out(pytester: pytest.Pytester) -> None:
    one, _, invariant = blocks()
    pytester.makepyfile(test_oven=one + invariant, test_strict=one + invariant.replace("< 110.0", "< 60.0"))
    run_pytest(pytester, "test_oven.py", "-k", "every_reader").assert_outcomes(passed=1, deselected=1)
    run_pytest(pytester, "test_strict.py", "-k", "every_reader").assert_outcomes(failed=1, deselected=1)
