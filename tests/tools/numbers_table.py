"""The numbers of the robot's controllers in the reference: each constant of the modules that docs/concepts/control.md names, with its reason."""

from __future__ import annotations

import ast
import importlib
import inspect
import re
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from types import ModuleType
from typing import Any

CONTROL = Path(__file__).parents[2] / "docs" / "concepts" / "control.md"


def tables() -> Iterator[str]:
    """A table for each module that has any, in the order of the page."""
    for module in dict.fromkeys(modules()):
        rows = [f"| `{name}` | {value} | {' '.join(text.split())} |" for name, value, text in numbers(module)]
        if rows:
            yield "\n".join([f"`{module.__name__}`", "", "| name | value | what it is |", "|---|---|---|", *rows, ""])


def modules() -> Iterator[ModuleType]:
    """The modules of the names on the page."""
    for name in re.findall(r"`(robot(?:\.\w+)+)`", CONTROL.read_text(encoding="utf-8")):
        parts = name.split(".")
        while parts:
            try:
                yield importlib.import_module(".".join(parts))
                break
            except ModuleNotFoundError:
                parts.pop()


def numbers(module: ModuleType) -> Iterator[tuple[str, str, str]]:
    """Name, value and text of each documented constant, and of each field of a dataclass that has a default."""
    for owner, body in bodies(ast.parse(inspect.getsource(module))):
        for statement, after in pairwise(body):
            if isinstance(statement, ast.Assign) and len(statement.targets) == 1:
                target: ast.expr = statement.targets[0]
            elif isinstance(statement, ast.AnnAssign) and statement.value is not None:
                target = statement.target
            else:
                continue
            if isinstance(target, ast.Name) and isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant):
                value = vars(module)[target.id] if not owner else default(vars(module)[owner], target.id)
                if shown := number(value):
                    yield ".".join(filter(None, (owner, target.id))), shown, str(after.value.value)


def bodies(tree: ast.Module) -> Iterator[tuple[str, list[ast.stmt]]]:
    """The statements of the module, and of each of its classes."""
    yield "", tree.body
    for statement in tree.body:
        if isinstance(statement, ast.ClassDef):
            yield statement.name, statement.body


def default(kind: Any, field: str) -> Any:
    """The value of a constant of a class, or the default of a field."""
    fields = getattr(kind, "__dataclass_fields__", {})
    return fields[field].default if field in fields else getattr(kind, field, None)


def number(value: Any) -> str:
    """A number, or several, as one writes them; empty for anything else."""
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return f"{value:g}"
    if isinstance(value, tuple) and value and all(number(one) for one in value):
        return ", ".join(map(number, value))
    return ""
