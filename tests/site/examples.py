"""Which public names the examples of the documents use, and where. The suite runs every one of these examples."""

from __future__ import annotations

import ast
import importlib
import re
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import NamedTuple

from tests.site.markdown import headlines
from tests.tools.reference import ROBOT, SECTIONS

ROOT = Path(__file__).parents[2]
FACES = frozenset({"actors", *SECTIONS.values(), *ROBOT.values()})
BLOCK = re.compile(r"^```python\n(.*?)^```", re.MULTILINE | re.DOTALL)

Name = tuple[str, str]
"""A public name: its module, and what it is called there."""


class Example(NamedTuple):
    """A section of a document with an example."""

    page: str
    title: str
    anchor: str


@cache
def examples() -> Mapping[Name, tuple[Example, ...]]:
    """The sections whose examples use a name, for each name that one uses."""
    found: dict[Name, dict[Example, None]] = {}
    for path in sorted([ROOT / "README.md", *(ROOT / "docs").rglob("*.md"), *(ROOT / "docs").rglob("*.py")]):
        text = as_page(path)
        known = Imported()
        for block in BLOCK.finditer(text):
            *_, (_, title, anchor) = headlines(text[: block.start()])
            for name in names_used(block[1], known):
                place = path.relative_to(ROOT).with_suffix(".md").as_posix()
                found.setdefault(name, {})[Example(place, title, anchor)] = None
    return {name: tuple(places) for name, places in found.items()}


def as_page(path: Path) -> str:
    """The text of a document. An example, `docs/reference/examples/NAME.py`, is a page whose title and text are its docstring."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".md":
        return text
    said = (ast.get_docstring(ast.parse(text)) or "").partition(": ")
    code = text.partition('"""\n')[2].strip()
    return f"# Example: {said[0].lower()}\n\n{said[2][:1].upper()}{said[2][1:]}\n\n```python\n{code}\n```\n"


class Imported(dict[str, Name]):
    """What the names of a program stand for; a module has an empty name."""


def names_used(code: str, known: Imported) -> Iterator[Name]:
    """The public names that a block of a program uses, which goes on with what the blocks before it have imported."""
    tree = ast.parse(code)
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module is not None:
            for alias in node.names:
                module = f"{node.module}.{alias.name}"
                if module in FACES:
                    known[alias.asname or alias.name] = (module, "")
                elif node.module in FACES:
                    known[alias.asname or alias.name] = (node.module, alias.name)
    for node in ast.walk(tree):
        if isinstance(node, ast.Name) and known.get(node.id, ("", ""))[1]:
            yield known[node.id]
        elif isinstance(node, ast.Name) and node.id in known:
            yield "actors", node.id  # a module that is a name of the front door
        elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            face, name = known.get(node.value.id, ("", "no module"))
            if not name and node.attr in getattr(importlib.import_module(face), "__all__", ()):
                yield face, node.attr
