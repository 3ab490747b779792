"""The import edges of a package, read from its syntax trees: nothing is imported, and every import is found, also those in functions."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import Literal, NamedTuple

Kind = Literal["top", "lazy", "typing"]
"""At module level; in a function; under ``if TYPE_CHECKING``."""


class Edge(NamedTuple):
    """``source`` imports ``target``: dotted names of modules of the same package."""

    source: str
    target: str
    kind: Kind
    line: int


def modules(package: Path) -> dict[str, Path]:
    """Every module of the package by its dotted name; a folder goes by the name of its ``__init__``."""
    found: dict[str, Path] = {}
    for path in sorted(package.rglob("*.py")):
        parts = path.relative_to(package.parent).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


@cache
def edges(package: Path) -> tuple[Edge, ...]:
    """Every import of one module of the package by another."""
    known = modules(package)
    found: list[Edge] = []
    for name, path in known.items():
        folder = name if path.name == "__init__.py" else name.rpartition(".")[0]
        for node, kind in _imports(ast.parse(path.read_text(encoding="utf-8")), "top"):
            found += [
                Edge(name, target, kind, node.lineno) for target in _targets(node, folder, known) if target != name
            ]
    return tuple(found)


def circles(imports: Iterable[Edge]) -> list[list[str]]:
    """The modules that import each other, directly or by way of others: each circle in order of its names, the first circle first."""
    above: dict[str, set[str]] = {}
    for edge in imports:
        above.setdefault(edge.source, set()).add(edge.target)

    def reached(start: str) -> set[str]:
        found: set[str] = set()
        left = [start]
        while left:
            for target in above.get(left.pop(), set()) - found:
                found.add(target)
                left.append(target)
        return found

    from_each = {name: reached(name) for name in above}
    members = {
        name: tuple(sorted(one for one in found if name in from_each.get(one, ()))) for name, found in from_each.items()
    }
    return [list(circle) for circle in sorted(set(members.values())) if circle]


def imported_from(node: ast.ImportFrom, folder: str) -> str:
    """The dotted name behind the word "from", of a statement in a module of the package `folder`."""
    base = node.module or ""
    if not node.level:
        return base
    above = ".".join(folder.split(".")[: len(folder.split(".")) - node.level + 1])
    return f"{above}.{base}" if base else above


def _imports(tree: ast.AST, kind: Kind) -> Iterator[tuple[ast.Import | ast.ImportFrom, Kind]]:
    for child in ast.iter_child_nodes(tree):
        if isinstance(child, (ast.Import, ast.ImportFrom)):
            yield child, kind
        elif isinstance(child, ast.If) and _is_typing(child.test):
            for statement in child.body:
                yield from _imports(ast.Module([statement], []), "typing")
            for statement in child.orelse:
                yield from _imports(ast.Module([statement], []), kind)
        else:
            inner = isinstance(child, (ast.FunctionDef, ast.AsyncFunctionDef)) and kind == "top"
            yield from _imports(child, "lazy" if inner else kind)


def _is_typing(test: ast.expr) -> bool:
    return isinstance(test, ast.Name) and test.id == "TYPE_CHECKING"


def _targets(node: ast.Import | ast.ImportFrom, folder: str, known: dict[str, Path]) -> list[str]:
    if isinstance(node, ast.Import):
        return [alias.name for alias in node.names if alias.name in known]
    base = imported_from(node, folder)
    inside = {f"{base}.{alias.name}" for alias in node.names}
    return sorted({name if name in known else base for name in inside if name in known or base in known})
