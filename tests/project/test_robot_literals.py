"""The numbers of the robot's algorithms have names, units and reasons: none is left inside a function."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.project.literals import ROOMS, all_literals, literals, main

SOURCE = """
LIMIT = 3.0

class Config:
    gain: float = 0.3

def law(x: float, gain: float = 0.7) -> float:
    inner = lambda y: 0.25 * y
    return gain * x + 1e-3 * inner(x) + 0.5 * 2.0

def cubic(u: float) -> float:
    return u * u * (3.0 - 2.0 * u)  # formula: smoothstep
"""


def test_no_number_inside_a_function_is_without_a_name() -> None:
    assert [str(literal) for literal in all_literals()] == []


def test_what_counts_is_inside_a_function_and_no_formula() -> None:
    assert [(found.line, found.value) for found in literals(SOURCE, Path("law.py"))] == [(7, 0.7), (8, 0.25), (9, 1e-3)]


def test_the_command_lists_them_with_their_places(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for room in ROOMS:
        (tmp_path / room).mkdir()
    assert main([str(tmp_path)]) == 0
    assert capsys.readouterr().out == "0 float literals without a name\n"
    (tmp_path / "control" / "law.py").write_text(SOURCE, encoding="utf-8")
    assert main([str(tmp_path)]) == 1
    assert f"{tmp_path}/control/law.py:7: 0.7\n" in capsys.readouterr().out
