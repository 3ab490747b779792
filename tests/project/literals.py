"""Numbers without a name: `python -m tests.project.literals [ROOT]` lists each float literal inside a function of the robot's algorithms, and counts them.

Of the rooms `control`, `navigation`, `planning` and `estimation`. Not counted are 0, 0.5, 1 and 2; what stands in a class or at the top of a module,
where it has a name and a place for its unit and reason; and the constants of a formula, on lines that end in ``# formula: NAME``.
"""

from __future__ import annotations

import argparse
import ast
import re
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2] / "robot"
ROOMS = ("control", "navigation", "planning", "estimation")
PLAIN = frozenset({0.0, 0.5, 1.0, 2.0})
FORMULA = re.compile(r"# formula: \S+")


@dataclass(frozen=True, slots=True, order=True)
class Literal:
    """One literal, and where it stands."""

    path: Path
    line: int
    column: int
    value: float

    def __str__(self) -> str:
        return f"{self.path}:{self.line}: {self.value:g}"


def literals(source: str, path: Path) -> list[Literal]:
    """Those inside the functions of one module, in order; defaults of arguments count as inside."""
    lines = source.splitlines()
    functions = (
        node
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda)
    )
    found = {
        Literal(path, node.lineno, node.col_offset, node.value)
        for function in functions
        for node in ast.walk(function)
        if isinstance(node, ast.Constant) and isinstance(node.value, float) and node.value not in PLAIN
    }
    return sorted(literal for literal in found if not FORMULA.search(lines[literal.line - 1]))


def all_literals(root: Path = ROOT) -> Iterator[Literal]:
    for room in ROOMS:
        for path in sorted((root / room).rglob("*.py")):
            yield from literals(path.read_text(encoding="utf-8"), path)


def main(argv: Sequence[str] | None = None) -> int:
    """0: there are none; 1: there are some."""
    parser = argparse.ArgumentParser(
        prog="python -m tests.project.literals", description=__doc__.splitlines()[0] if __doc__ else None
    )
    parser.add_argument("root", type=Path, nargs="?", default=ROOT, metavar="ROOT", help="the package (default: robot)")
    found = list(all_literals(parser.parse_args(argv).root))
    for literal in found:
        print(literal)
    print(f"{len(found)} float literals without a name")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
