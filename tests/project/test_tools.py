"""Programs for developers that write files: asked for help, they write none."""

from __future__ import annotations

import runpy
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PROGRAMS = (
    "tests.tools.cli_docs",
    "tests.tools.cli_speed",
    "tests.tools.page_weight",
    "tests.tools.reference",
    "tests.tools.tutorial_pages",
)


@pytest.mark.parametrize("program", PROGRAMS)
@pytest.mark.parametrize(("argument", "code"), [("--help", 0), ("--no-such-option", 2)])
def test_a_program_that_takes_no_options_says_what_it_does_and_does_nothing(
    program: str, argument: str, code: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", [program, argument])
    with pytest.raises(SystemExit) as ended:
        runpy.run_path(str(ROOT / f"{program.replace('.', '/')}.py"), run_name="__main__")
    assert ended.value.code == code
    shown = capsys.readouterr()
    assert f"usage: python -m {program}" in shown.out + shown.err
