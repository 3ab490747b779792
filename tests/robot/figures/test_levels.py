"""What `python -m tests.figures` measures with: levels, bounds, and what it says meanwhile."""

from __future__ import annotations

import pytest

from cli.command import UsageError
from tests.figures.__main__ import main
from tests.figures.levels import Metric, levelled, measure, table
from tests.figures.machine import machine

HERE = {
    "date": "2026-01-02", "wall_seconds": 12.4, "machine": {"processor": "P", "cores": 2, "python": "3.11", "mujoco": "none"}
}  # fmt: skip


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
    text = table("errors", measure([metric("bad")], [9], backend="none") | HERE)
    assert text.splitlines()[-1].endswith("below acceptable")


def test_the_help_of_walk_says_how_long_it_takes(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["walk", "--help"])
    assert "All of it takes half an hour on an idle machine." in capsys.readouterr().out


def test_more_is_better_where_it_is_said_so() -> None:
    speed = Metric("speed", "m/s", (1.0, 2.0, 3.0), float, larger_is_better=True)
    assert [speed.level(value) for value in (0.5, 1.0, 2.5, 4.0)] == ["", "acceptable", "good", "excellent"]


def test_a_level_without_a_bound_is_never_reached() -> None:
    assert metric("error", (3.0, None, None)).level(0.1) == "acceptable"
    assert metric("error", (None, None, 1.0)).level(2.0) == ""


def test_the_table_word_by_word() -> None:
    values = {1: 0.5, 2: 4.0, 3: 2.5}
    line = Metric("a thing measured", "mm", (3.0, 2.0, None), lambda seed: values[seed])
    result = measure([line], [1, 2, 3], backend="none") | HERE
    assert table("A title", result).splitlines() == [
        "A title, back end none",
        "seeds 1, 2, 3; 2026-01-02; P, 2 cores, Python 3.11, MuJoCo none; 12 s",
        "",
        "metric                                        median       min       max unit   accept.    good excell.  level",
        "a thing measured                                 2.5       0.5         4 mm           3       2       -  acceptable",
    ]


def test_what_is_beyond_all_bounds_is_not_good() -> None:
    fine, bad = (levelled("one", measure([metric("one")], [seed], backend="none")) for seed in (2, 5))
    assert (fine.good, bad.good) == (True, False)
    assert bad.values["metrics"][0]["level"] == ""


def test_quick_and_only_choose_and_nothing_chosen_is_a_mistake_that_names_what_there_is() -> None:
    lines = [metric("fast"), Metric("slow", "m", (None, None, None), float)]
    assert [row["name"] for row in measure(lines, [1], backend="none", quick=True)["metrics"]] == ["fast"]
    with pytest.raises(UsageError, match=r"--only slow: no metric's name contains that; there are: 'fast'$"):
        measure(lines, [1], backend="none", quick=True, only="slow")


def test_the_settings_of_a_measurement_are_in_its_result() -> None:
    result = measure([metric("one")], [4], backend="none", delay_ms=8.0)
    assert (result["backend"], result["seeds"], result["delay_ms"]) == ("none", [4], 8.0)
    assert result["metrics"][0]["values"] == [4.0]
    assert machine().keys() == {"processor", "cores", "system", "python", "mujoco"}
