"""`python -m robot evaluate`: what it lists, whom it calls, and how it ends."""

from __future__ import annotations

import pytest

from robot.evaluate import arm, battery, command, maps, odometry, rates, sensitivity, walk


def test_without_a_word_it_lists_the_measurements_and_that_is_a_mistake(capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main([]) == 2
    assert command.main(["--help"]) == 0
    first, second = capsys.readouterr().out.split("usage: ")[1:]
    assert first.strip() == second.strip()
    assert [line.split()[0] for line in first.splitlines()[2:] if line] == [
        "walk", "arm", "barn", "sensitivity", "battery", "odometry", "pose", "kidnap", "mission", "rooms", "crowd", "ramps", "slip",
        "rates", "busy", "stops", "maps",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("word", "told"),
    [
        ("walks", "robot evaluate: nothing is called 'walks'; did you mean walk?"),
        (
            "xyz",
            "robot evaluate: nothing is called 'xyz'; there are: walk, arm, barn, sensitivity, battery, odometry, ",
        ),
    ],
)
def test_a_name_that_is_none_is_one_line(word: str, told: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert command.main([word]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(told)


def test_the_exit_code_is_that_of_the_measurement(monkeypatch: pytest.MonkeyPatch) -> None:
    given: list[list[str]] = []

    def measured(rest: list[str]) -> int:
        given.append(rest)
        return 1

    monkeypatch.setattr(battery, "main", measured)
    assert command.main(["battery", "--seeds", "3"]) == 1
    assert given == [["--seeds", "3"]]


def test_an_interrupt_is_told_and_ends_with_130(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupted(rest: list[str]) -> int:
        raise KeyboardInterrupt

    monkeypatch.setattr(walk, "main", interrupted)
    assert command.main(["walk"]) == 130
    assert capsys.readouterr().err == "\nrobot evaluate walk: interrupted\n"


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
    assert command.main(words) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"robot evaluate {words[0]}: {told}")


@pytest.mark.parametrize("module", [arm, maps, odometry, rates, sensitivity, walk])
def test_each_help_names_the_command_that_was_typed(module: object, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        module.main(["--help"])  # type: ignore[attr-defined]
    assert ended.value.code == 0
    name = module.__name__.rpartition(".")[2]  # type: ignore[attr-defined]
    assert capsys.readouterr().out.startswith(f"usage: robactor evaluate {name} ")
