"""The benchmark harness: contestants take turns, medians are reported, absent peers are named."""

from __future__ import annotations

import json
import sys
from types import ModuleType

import pytest

from tests.benchmarks import Contestant, Row, contest
from tests.benchmarks import __main__ as command


def contestants(log: list[str]) -> list[Contestant]:
    figures = {"a": iter([1e9, 1.0, 100.0, 3.0]), "b": iter([0.0, 10.0, 30.0, 20.0])}

    def measure(name: str) -> tuple[float, float]:
        log.append(name)
        value = next(figures[name])
        return value, -value

    return [
        Contestant("a", "ours", lambda: measure("a")),
        Contestant("b", "floor", lambda: measure("b")),
        Contestant("c", "peer", lambda: measure("c"), needs="no_such_module_anywhere"),
    ]


def test_contestants_take_turns_and_the_median_after_a_warm_up_counts() -> None:
    log: list[str] = []
    rows = contest("work", ["things/s", "cost"], contestants(log), rounds=3)
    assert log == ["a", "b"] * 4
    assert rows[:4] == [
        Row("work", "a", "things/s", 3.0, "ours"),
        Row("work", "a", "cost", -3.0, "ours"),
        Row("work", "b", "things/s", 20.0, "floor"),
        Row("work", "b", "cost", -20.0, "floor"),
    ]


def test_an_absent_peer_is_named_as_skipped() -> None:
    rows = contest("work", ["things/s", "cost"], contestants([]), rounds=3)
    assert [(row.name, row.value) for row in rows[4:]] == [("c", None), ("c", None)]
    assert rows[4].note == "skipped: no_such_module_anywhere is not installed"


def test_the_table_shows_ratios_to_the_floor_and_to_ours() -> None:
    text = command.table(contest("work", ["things/s", "cost"], contestants([]), rounds=3))
    first, second = text.split("work, cost")
    ours, floor, absent = first.splitlines()[-4:-1]
    assert ours.split() == ["a", "ours", "3.00", "0.15", "1.00"]
    assert floor.split() == ["b", "floor", "20.00", "1.00", "6.67"]
    assert "no_such_module_anywhere is not installed" in absent
    assert "-20.00" in second


def test_without_a_floor_there_is_no_ratio_to_it() -> None:
    text = command.table([Row("work", "a", "us", 1234.5, "ours"), Row("work", "z", "us", 2469.0, "peer")])
    assert text.splitlines()[-1].split() == ["z", "peer", "2,469", "-", "2.00"]


def test_the_command_runs_what_it_is_told_to(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    fake = ModuleType("tests.benchmarks.fake")
    fake.run = lambda: [Row("work", "a", "us", 7.0, "ours")]  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "tests.benchmarks.fake", fake)
    monkeypatch.setattr(command, "names", lambda: ["fake"])
    assert command.main(["--json"]) == 0
    assert json.loads(capsys.readouterr().out)[0]["value"] == 7.0
    assert command.main(["fake"]) == 0
    assert "7.00" in capsys.readouterr().out
    with pytest.raises(SystemExit):
        command.main(["imaginary"])
    assert "no such benchmark: imaginary; there are fake" in capsys.readouterr().err


def test_the_benchmarks_of_the_package_are_found() -> None:
    assert {"timers", "virtual"} <= set(command.names())
