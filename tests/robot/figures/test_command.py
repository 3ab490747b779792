"""`python -m tests.figures`: what it lists, what it runs, and how it ends."""

from __future__ import annotations

import os
from argparse import Namespace
from dataclasses import replace

import pytest

from tests.figures import battery, walk
from tests.figures.__main__ import NAMES, main
from tests.figures.measurement import Result


def test_without_a_word_it_lists_the_measurements_and_that_is_a_mistake(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 2
    assert main(["--help"]) == 0
    first, second = capsys.readouterr().out.split("usage: ")[1:]
    assert first.strip() == second.strip()
    assert [line.split()[0] for line in first.splitlines()[2:] if line] == list(NAMES)


@pytest.mark.parametrize(
    ("word", "told"),
    [
        ("walks", "figures: no measurement is called 'walks'; did you mean walk?"),
        (
            "xyz",
            "figures: no measurement is called 'xyz'; there are: walk, arm, barn, sensitivity, battery, odometry, ",
        ),
    ],
)
def test_a_name_that_is_none_is_one_line(word: str, told: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([word]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(told)


@pytest.mark.parametrize(("good", "code"), [(True, 0), (False, 1)])
def test_the_exit_code_says_whether_every_bound_is_kept(
    good: bool, code: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def taken(asked: Namespace) -> Result:
        return Result(
            {"seeds": asked.seeds}, lambda values: f"{values['seeds']}, {values['machine']['cores']} cores", good
        )

    monkeypatch.setattr(battery, "MEASUREMENT", replace(battery.MEASUREMENT, take=taken))
    assert main(["battery", "--seeds", "3"]) == code
    assert capsys.readouterr().out == f"[3], {os.cpu_count()} cores\n"


def test_an_interrupt_is_told_and_ends_with_130(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupted(asked: Namespace) -> Result:
        raise KeyboardInterrupt

    monkeypatch.setattr(walk, "MEASUREMENT", replace(walk.MEASUREMENT, take=interrupted))
    assert main(["walk"]) == 130
    assert capsys.readouterr().err == "\nfigures walk: interrupted\n"


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["walk", "--delay", "25"], "argument --delay: 25: give 0 to 20 milliseconds"),
        (["walk", "--minutes", "nan"], "argument --minutes: nan: give 0.1 to 600 minutes"),
        (["walk", "--only", "xyz"], "--only xyz: no metric's name contains that; there are: 'leg: |FK(IK(p)) - p|'"),
        (["odometry", "--distance", "0"], "argument --distance: 0: give 1 to 10000 metres"),
        (["odometry", "--seconds", "0.5"], "argument --seconds: 0.5: give 1 to 3600 seconds"),
        (["arm", "--seeds", "-1"], "argument --seeds: -1 is no seed: give a whole number of at least 0"),
        (["arm", "--qiuck"], "unrecognized arguments: --qiuck; did you mean --quick?"),
        (["rates", "--backend", "real"], "argument --backend: invalid choice: 'real'"),
        (["rates", "--duration", "-3"], "argument --duration: -3 is not a positive number of seconds"),
        (["maps", "/nowhere"], "there is no /nowhere"),
        (["barn"], "the following arguments are required: folder"),
    ],
)
def test_a_typo_is_one_line_and_exit_code_2(words: list[str], told: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(words) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"figures {words[0]}: {told}")


@pytest.mark.parametrize("name", NAMES)
def test_each_has_help_that_names_what_was_typed(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main([name, "--help"])
    assert ended.value.code == 0
    assert capsys.readouterr().out.startswith(f"usage: python -m tests.figures {name} ")
