"""Lines of code, and lines of tests for them: `python -m tests.lines [robot|actors]`.

A line of code is one that holds a token of Python: neither blank, nor a comment, nor part of a docstring. Generated messages do not count.
Tests of a package are those in the folder of its name in tests/; what tests/project and other folders say of it is not counted.
"""

from __future__ import annotations

import ast
import io
import sys
import tokenize
from collections.abc import Sequence
from pathlib import Path

ROOT = Path(__file__).parents[1]
NOTHING = frozenset(
    {tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER}
)
GENERATED = frozenset({"msg.py", "srv.py", "action.py"})
"""What the generator writes into the folders of message packages."""


def lines_of_code(text: str) -> int:
    """How many lines of a module hold code."""
    held: set[int] = set()
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type not in NOTHING:
            held.update(range(token.start[0], token.end[0] + 1))
    return len(held - docstrings(ast.parse(text)))


def docstrings(tree: ast.Module) -> set[int]:
    """The lines of all docstrings."""
    lines: set[int] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            first = node.body[0] if node.body else None
            if (
                isinstance(first, ast.Expr)
                and isinstance(first.value, ast.Constant)
                and isinstance(first.value.value, str)
            ):
                lines.update(range(first.lineno, (first.end_lineno or first.lineno) + 1))
    return lines


def rooms(package: Path) -> dict[str, int]:
    """The lines of each room of a package, and of the modules beside them."""
    counted: dict[str, int] = {}
    for file in sorted(package.rglob("*.py")):
        inner = file.relative_to(package)
        if not ("interfaces" in inner.parts and inner.name in GENERATED):
            room = inner.parts[0]
            counted[room] = counted.get(room, 0) + lines_of_code(file.read_text(encoding="utf-8"))
    return {room: number for room, number in counted.items() if number}


def main(argv: Sequence[str]) -> int:
    """Print a table for each package."""
    for name in argv or ("robot", "actors"):
        code, tests = rooms(ROOT / name), rooms(ROOT / "tests" / name)
        print(f"{name:24} {'code':>7} {'tests':>7}")
        for room in sorted({*code, *tests}):
            print(f"  {room:22} {code.get(room, 0):7,} {tests.get(room, 0):7,}")
        print(f"  {'in all':22} {sum(code.values()):7,} {sum(tests.values()):7,}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
