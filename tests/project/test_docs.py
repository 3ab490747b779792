"""The pages of docs/ are run: all Python blocks of a page, in order, as one program; its tests with a rig."""

from __future__ import annotations

import functools
import inspect
import os
import re
import subprocess
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from actors.testing import Rig

DOCS = Path(__file__).parents[2] / "docs"
PAGES = sorted(page.name for page in DOCS.glob("*.md") if "```python" in page.read_text(encoding="utf-8"))


def program(page: str) -> dict[str, Any]:
    """The page's blocks, run; line numbers are those of the page."""
    text = (DOCS / page).read_text(encoding="utf-8")
    module = ModuleType(f"docs.{page}")
    sys.modules[module.__name__] = module  # so that its classes can be pickled
    names = vars(module)
    for block in re.finditer(r"```python\n(.*?)```", text, re.DOTALL):
        line = text[: block.start(1)].count("\n")
        exec(compile("\n" * line + block[1], str(DOCS / page), "exec"), names)
    return names


once = functools.cache(program)
"""The same, run once for all the tests of a page."""


@pytest.mark.parametrize("page", PAGES)
def test_the_page_runs_as_printed(page: str, tmp_path: Path) -> None:
    """In a process and a folder of its own: a page may run event loops, and write files."""
    code = f"from tests.project.test_docs import program; program({page!r})"
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", code],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(DOCS.parent)},
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert (done.returncode, done.stderr) == (0, "")


# without a decorator: a scenario makes rigs of its own, and has tests of its own
TESTS = [
    (page, found)
    for page in PAGES
    for found in re.findall(
        r"^(?!@).*\nasync def (test_\w+)\(rig", (DOCS / page).read_text(encoding="utf-8"), re.MULTILINE
    )
]


@pytest.fixture
def names(page: str) -> dict[str, Any]:
    """The page's names. A fixture that is not async, because a page may run event loops."""
    return once(page)


@pytest.mark.parametrize(("page", "name"), TESTS)
async def test_the_tests_of_the_page_pass(page: str, name: str, names: dict[str, Any], rig: Rig) -> None:
    test = names[name]
    assert inspect.iscoroutinefunction(test)
    await test(rig)


PLAIN = [
    (page, found)
    for page in PAGES
    for found in re.findall(r"^def (test_\w+)\(\) -> None", (DOCS / page).read_text(encoding="utf-8"), re.MULTILINE)
]


@pytest.mark.parametrize(("page", "name"), PLAIN)
def test_the_tests_without_a_rig_pass_too(page: str, name: str) -> None:
    once(page)[name]()
