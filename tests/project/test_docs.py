"""The pages of docs/ are run: all Python blocks of a page, in order, as one program; its tests with a rig. So are the examples of the reference."""

from __future__ import annotations

import ast
import asyncio
import functools
import inspect
import os
import re
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from actors.testing import Lab, Rig
from tests import warm

DOCS = Path(__file__).parents[2] / "docs"
START = DOCS / "start"
"""Its pages are files and terminals of a reader: `tests/project/test_tutorial_pages.py` plays them."""
PAGES = sorted(
    page.relative_to(DOCS).as_posix()
    for page in DOCS.rglob("*.md")
    if page.parent != START and "```python\n" in page.read_text(encoding="utf-8")
) + sorted(example.relative_to(DOCS).as_posix() for example in DOCS.rglob("*.py"))


def program(page: str) -> dict[str, Any]:
    """The page's blocks, run, or the example as a whole; line numbers are those of the file."""
    text = (DOCS / page).read_text(encoding="utf-8")
    text = f"```python\n{text}```" if page.endswith(".py") else text
    module = ModuleType(f"docs.{page}")
    sys.modules[module.__name__] = module  # so that its classes can be pickled
    names = vars(module)
    for block in re.finditer(r"```python\n(.*?)```", text, re.DOTALL):
        line = 0 if page.endswith(".py") else text[: block.start(1)].count("\n")
        exec(compile("\n" * line + block[1], str(DOCS / page), "exec"), names)
    return names


once = functools.cache(program)
"""The same, run once for all the tests of a page."""


@pytest.mark.parametrize("page", PAGES)
def test_the_page_runs_as_printed(page: str, tmp_path: Path) -> None:
    """In a process and a folder of its own: a page may run event loops, and write files."""
    strict = "import warnings; warnings.simplefilter('error')"
    code = f"{strict}; from tests.project.test_docs import program; program({page!r})"
    environment = {**os.environ, "PYTHONPATH": str(DOCS.parent)}
    done = warm.run("-c", code, cwd=tmp_path, env=environment, timeout=120)
    assert (done.returncode, done.stderr) == (0, "")


def test_the_cells_of_the_notebook_run_as_printed() -> None:
    """As a kernel runs them: one after another in one event loop, each awaited in a task of its own."""
    text = (DOCS / "howto/jupyter.md").read_text(encoding="utf-8")
    names = dict(once("howto/jupyter.md"))
    cells = re.findall(r"```python notebook\n(.*?)```", text, re.DOTALL)
    assert len(cells) == 3

    async def kernel() -> None:
        for cell in cells:
            code = compile(cell, "a cell", "exec", flags=ast.PyCF_ALLOW_TOP_LEVEL_AWAIT)
            await asyncio.create_task(eval(code, names))

    asyncio.run(kernel())
    assert names["system"].stop_reason == "the block was left"


def declared_tests(declared: str) -> list[tuple[str, str]]:
    """(page, name) of each test whose declaration, with the line before it, is of this form."""
    found = re.compile(declared, re.MULTILINE)
    return [(page, name) for page in PAGES for name in found.findall((DOCS / page).read_text(encoding="utf-8"))]


# without a decorator: a scenario makes rigs of its own, and has tests of its own
WITH_RIG = declared_tests(r"^(?!@).*\nasync def (test_\w+)\(rig")
WITH_LAB = declared_tests(r"^(?!@).*\nasync def (test_\w+)\(lab")
VIRTUAL = declared_tests(r"^@pytest.mark.virtual\nasync def (test_\w+)\(\)")
PLAIN = declared_tests(r"^def (test_\w+)\(\) -> None")


@pytest.fixture
def names(page: str) -> dict[str, Any]:
    """The page's names. A fixture that is not async, because a page may run event loops."""
    return once(page)


@pytest.mark.parametrize(("page", "name"), WITH_RIG)
async def test_the_tests_of_the_page_pass(page: str, name: str, names: dict[str, Any], rig: Rig) -> None:
    test = names[name]
    assert inspect.iscoroutinefunction(test)
    await test(rig)


@pytest.mark.parametrize(("page", "name"), WITH_LAB)
async def test_the_tests_with_a_lab_pass(page: str, name: str, names: dict[str, Any], lab: Lab) -> None:
    test = names[name]
    assert inspect.iscoroutinefunction(test)
    await test(lab)


@pytest.mark.virtual
@pytest.mark.parametrize(("page", "name"), VIRTUAL)
async def test_the_tests_on_the_virtual_clock_pass(page: str, name: str, names: dict[str, Any]) -> None:
    test = names[name]
    assert inspect.iscoroutinefunction(test)
    await test()


@pytest.mark.parametrize(("page", "name"), PLAIN)
def test_the_tests_without_a_rig_pass_too(page: str, name: str) -> None:
    once(page)[name]()
