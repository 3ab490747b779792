"""The robot's functions stay short enough to be read at once."""

from __future__ import annotations

import ast
from pathlib import Path

ROBOT = Path(__file__).parents[2] / "robot"
MOST = 60
"""Lines of a function, from its `def` to its end."""


def test_no_function_is_longer_than_a_page() -> None:
    long = [
        f"{path.relative_to(ROBOT)}:{node.lineno} {node.name}"
        for path in sorted(ROBOT.rglob("*.py"))
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
        and (node.end_lineno or node.lineno) - node.lineno >= MOST
    ]
    assert long == []
