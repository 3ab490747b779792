"""What `python -m robot evaluate` measures with: levels, bounds, and what it says meanwhile."""

from __future__ import annotations

import pytest

from robot.evaluate import walk
from robot.evaluate.levels import Metric, measure, table


def metric(name: str, bounds: tuple[float | None, float | None, float | None] = (3.0, 2.0, 1.0)) -> Metric:
    return Metric(name, "m", bounds, float, quick=True)


@pytest.mark.parametrize(("value", "level"), [(0.5, "excellent"), (1.5, "good"), (2.5, "acceptable"), (3.5, "")])
def test_a_value_has_the_highest_level_that_it_reaches(value: float, level: str) -> None:
    assert metric("error").level(value) == level
    assert metric("error", (None, None, None)).level(value) == "no bounds"


def test_it_says_how_much_there_is_to_do_how_long_it_takes_and_how_far_it_is(
    capsys: pytest.CaptureFixture[str],
) -> None:
    result = measure([metric("one"), metric("two")], [1, 2, 3], backend="none", takes="half an hour")
    assert capsys.readouterr().err.splitlines() == [
        "metrics to measure: 2, each with 3 seeds; all of it takes half an hour",
        "[1/2] one: 2 m (0 s)",
        "[2/2] two: 2 m (0 s)",
    ]
    assert [row["level"] for row in result["metrics"]] == ["good", "good"]
    assert result["metrics"][0]["bounds"] == {"acceptable": 3.0, "good": 2.0, "excellent": 1.0}


def test_a_part_of_it_does_not_take_as_long(capsys: pytest.CaptureFixture[str]) -> None:
    measure([metric("one"), metric("two")], [1], backend="none", only="two", takes="half an hour")
    assert capsys.readouterr().err.splitlines()[0] == "metrics to measure: 1, each with 1 seeds"


def test_a_value_beyond_all_bounds_is_told_as_such() -> None:
    text = table("errors", measure([metric("bad")], [9], backend="none"))
    assert text.splitlines()[-1].endswith("below acceptable")


def test_the_help_of_walk_says_how_long_it_takes(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        walk.main(["--help"])
    assert "All of it takes half an hour on an idle machine." in capsys.readouterr().out
