"""What mypy and pyright, both strict, say about programs on `actors`: nothing about right ones, one error for each mistake.

A line of the samples that ends with ``# E`` must give exactly one error of each checker, one with ``# E: mypy`` or ``# E: pyright``
exactly one of that checker only; no other line may give any.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SAMPLES = Path(__file__).parent / "samples"

Line = tuple[str, int]
Found = dict[Line, list[str]]
"""What a checker says of each line of each file."""


def run(*command: str) -> str:
    """The output of a checker, which exits with 1 when it has found errors, as it should."""
    pytest.importorskip(command[0], reason=f"{command[0]} is not installed: pip install --group lint")
    done = subprocess.run([sys.executable, "-m", *command], cwd=ROOT, capture_output=True, text=True, timeout=300)
    assert done.returncode in (0, 1), f"{command[0]} could not run:\n{done.stdout}\n{done.stderr}"
    return done.stdout


def mypy() -> Iterator[tuple[Line, str]]:
    output = run("mypy", "--strict", "--follow-imports=silent", "--output=json", str(SAMPLES))
    for said in map(json.loads, output.splitlines()):
        if said["severity"] == "error":
            yield (Path(said["file"]).name, said["line"]), said["message"]


def pyright() -> Iterator[tuple[Line, str]]:
    output = run("pyright", "--pythonpath", sys.executable, "--outputjson", str(SAMPLES))
    for said in json.loads(output)["generalDiagnostics"]:
        if said["severity"] == "error":
            yield (Path(said["file"]).name, said["range"]["start"]["line"] + 1), said["message"]


CHECKERS: dict[str, Callable[[], Iterator[tuple[Line, str]]]] = {"mypy": mypy, "pyright": pyright}


def wanted(checker: str) -> Counter[Line]:
    """The lines that are marked for this checker."""
    marked: Counter[Line] = Counter()
    for path in SAMPLES.glob("*.py"):
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1):
            mark = re.search(r"# E(?:: (\w+))?$", line)
            if mark is not None and mark[1] in (None, checker):
                marked[path.name, number] = 1
    return marked


@pytest.mark.parametrize("checker", CHECKERS)
def test_each_mistake_is_one_error_and_right_programs_give_none(checker: str) -> None:
    said: Found = {}
    for line, message in CHECKERS[checker]():
        said.setdefault(line, []).append(message)
    found = Counter({line: len(messages) for line, messages in said.items()})
    marked = wanted(checker)

    assert len(marked) > 50, "the samples have lost their marks"
    assert found == marked, "\n".join(
        f"{file}:{number}: {found[file, number]} errors, wanted {marked[file, number]}: {said.get((file, number), [])}"
        for file, number in sorted(found | marked)
        if found[file, number] != marked[file, number]
    )


def test_marks_name_checkers_that_exist() -> None:
    text = "".join(path.read_text(encoding="utf-8") for path in SAMPLES.glob("*.py"))
    assert set(re.findall(r"# E: (\w+)", text)) <= CHECKERS.keys()
