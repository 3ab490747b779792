"""docs/concepts/architecture.md: every module and function that it names exists, and its picture shows the rooms as they are."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import actors
from tests.project.test_floors import FLOORS

DOCS = Path(__file__).parents[2] / "docs" / "concepts"
TEXT = (DOCS / "architecture.md").read_text(encoding="utf-8")


def defined(path: Path) -> set[str]:
    """What a module defines: ``function``, ``Class`` and ``Class.method``."""
    found: set[str] = set()
    for statement in ast.parse(path.read_text(encoding="utf-8")).body:
        if isinstance(statement, (ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)):
            found.add(statement.name)
        if isinstance(statement, ast.ClassDef):
            inside = (one for one in statement.body if isinstance(one, (ast.FunctionDef, ast.AsyncFunctionDef)))
            found |= {f"{statement.name}.{one.name}" for one in inside}
    return found


def test_every_name_is_where_the_link_leads() -> None:
    links = re.findall(r"\[`([\w.]+)`\]\((\.\./\.\./actors/[\w/.]+)\)", TEXT)
    assert len(links) > 20
    for name, target in links:
        assert name in defined(DOCS / target), f"{name} is not in {target}"


def test_every_link_leads_to_a_file() -> None:
    for target in re.findall(r"\]\(([^)#]+)\)", TEXT):
        assert (DOCS / target).is_file(), target


def test_the_picture_shows_the_rooms_in_their_order() -> None:
    (picture,) = re.findall(r"```mermaid\n(.*?)```", TEXT, re.DOTALL)
    assert tuple(re.findall(r'^    \w+\["(\w+)', picture, re.MULTILINE)) == FLOORS
    layers = re.findall(r"^  subgraph (\w+)\[", picture, re.MULTILINE)
    assert picture.endswith(f"  {' --> '.join(layers)}\n")


def test_the_docstring_of_actors_names_the_rooms_in_their_order() -> None:
    layout = re.findall(r"^    (\w+) {2,}", actors.__doc__ or "", re.MULTILINE)
    assert tuple(layout) == FLOORS
