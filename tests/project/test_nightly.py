"""`.ci/nightly`: its steps, its usage, and the plugins that it runs the suite with."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path
from textwrap import dedent

import pytest

from tests.suites import run_pytest
from tests.tools import twice as suite_twice
from tests.tools.twice import main as main_twice

ROOT = Path(__file__).parents[2]


def nightly(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([str(ROOT / ".ci/nightly"), *arguments], capture_output=True, text=True, timeout=30)


def test_the_steps_are_listed_and_each_says_what_it_is() -> None:
    done = nightly("--list")
    steps = dict(line.split(maxsplit=1) for line in done.stdout.splitlines())
    assert {"slow", "realtime", "coverage", "mutants", "chaos", "properties"} <= set(steps)
    assert done.returncode == 0


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["--only", "slwo"], "there is no step slwo; there are: realtime"),
        (["--only"], "--only needs the name of a step"),
        (["--seed", "x"], "--seed needs a whole number"),
        (["fast"], "unknown argument fast"),
    ],
)
def test_wrong_usage_is_told(arguments: list[str], told: str) -> None:
    done = nightly(*arguments)
    assert done.returncode == 2
    assert told in done.stderr


TESTS = """
    import pytest

    @pytest.mark.parametrize("number", range(12))
    def test_one(number): print('ran', number)
"""


def ran(result: pytest.RunResult) -> list[str]:
    told = [line.lstrip(".") for line in result.outlines]
    return [line for line in told if line.startswith(("ran ", "other "))]


def test_another_order_is_drawn_from_its_seed(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(test_a=TESTS, test_b=TESTS.replace("'ran'", "'other'"))
    orders = [
        ran(run_pytest(pytester, "-s", "-q", "-p", "tests.tools.order", *shuffle))
        for shuffle in ([], ["--shuffle", "1"], ["--shuffle", "1"], ["--shuffle", "2"])
    ]
    plain, first, again, second = orders
    assert plain == [f"ran {number}" for number in range(12)] + [f"other {number}" for number in range(12)]
    assert first == again
    assert len({tuple(plain), tuple(first), tuple(second)}) == 3
    assert sorted(first) == sorted(second) == sorted(plain)
    words = [line.split()[0] for line in first]
    assert words in (["ran"] * 12 + ["other"] * 12, ["other"] * 12 + ["ran"] * 12)


STEADY = """
    def test_one(): pass
    def test_two(): assert False
"""
BY_HASH = """
    import pytest

    @pytest.mark.parametrize("number", range(40))
    def test_that_rests_on_the_order_of_a_set(number):
        assert hash(f"word {number}") % 2
"""


def twice(folder: Path, text: str, capsys: pytest.CaptureFixture[str], *order: str) -> tuple[int, list[str]]:
    (folder / "test_it.py").write_text(dedent(text), encoding="utf-8")
    code = main_twice([*order, "-o", "addopts=", "--rootdir", str(folder), str(folder / "test_it.py")])
    return code, capsys.readouterr().out.splitlines()


@pytest.mark.slow(reason="a tool of the nightly run")
def test_the_suite_is_run_twice_and_what_ends_otherwise_the_second_time_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code, lines = twice(tmp_path, BY_HASH, capsys)
    assert code == 1
    assert any(
        re.match(r"first test_it.py::test_that_rests_\S+ call (passed|failed); then (passed|failed)$", line)
        for line in lines
    )
    assert re.match(r"40 tests, \d+ failed, [1-9]\d* ended differently; at most \d+\.\d\d GB in a process", lines[-1])


@pytest.mark.slow(reason="a tool of the nightly run")
def test_two_equal_runs_that_pass_are_told_so_and_failures_are_failures(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert twice(tmp_path, "def test_one(): pass", capsys)[0] == 0
    code, lines = twice(tmp_path, STEADY, capsys)
    assert (code, lines[-1].partition(";")[0]) == (1, "2 tests, 1 failed, 0 ended differently")
    assert twice(tmp_path, "", capsys)[0] == 1  # nothing was run


ONE_AFTER_THE_OTHER = """
    seen = []

    def test_one(): seen.append(1)
    def test_two(): seen.append(2)
    def test_three(): assert seen == [1, 2]
"""


@pytest.mark.slow(reason="a tool of the nightly run")
def test_a_test_that_rests_on_the_order_is_found_by_another_order(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert twice(tmp_path, ONE_AFTER_THE_OTHER, capsys)[0] == 0
    code, lines = twice(tmp_path, ONE_AFTER_THE_OTHER, capsys, "--shuffle", "1")
    assert code == 1
    assert "first test_it.py::test_three call passed; then failed" in lines


@pytest.mark.slow(reason="a tool of the nightly run")
def test_a_suite_that_takes_more_than_4_gb_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert suite_twice.LIMIT == 4 * 10**9
    monkeypatch.setattr(suite_twice, "LIMIT", 10**6)
    assert twice(tmp_path, "def test_one(): pass", capsys)[0] == 1


@pytest.mark.slow(reason="a tool of the nightly run")
def test_scenarios_of_topics_services_and_actions_end_alike_in_two_runs(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert (
        main_twice(
            [str(ROOT / "tests/robot/tutorials/test_topics.py"), str(ROOT / "tests/actors/actions/test_actions.py")]
        )
        == 0
    )
