"""`python -m robot.tutorials`: lists the tutorials, or runs one of them by name."""

from __future__ import annotations

import sys

from cli.starting import end_at_signals

if __name__ == "__main__":
    end_at_signals()  # what is imported takes a while

import ast
import importlib
import pkgutil
from collections.abc import Sequence
from importlib.resources import files

from actors.suggest import did_you_mean
from robot import tutorials

USAGE = "usage: python -m robot.tutorials NAME [options]     (NAME --help for its options)"


def main(argv: Sequence[str] | None = None) -> int:
    """Run one tutorial, or list them; the exit code is that of the tutorial, or 2 when there is none of that name."""
    arguments = list(sys.argv[1:] if argv is None else argv)
    known = summaries()
    if not arguments or arguments[0] in ("-h", "--help"):
        print(f"{USAGE}\n")
        widest = max(map(len, known))
        for name, summary in known.items():
            print(f"  {name:<{widest}}  {summary}")
        return 0
    name = arguments[0].removeprefix("robot.tutorials.")
    if name not in known:
        hint = did_you_mean(name, known, "did", quoted=False) or "python -m robot.tutorials lists all of them"
        print(f"robot.tutorials: there is no tutorial {arguments[0]!r}; {hint}", file=sys.stderr)
        return 2
    from robot.tutorials.program import main as run

    run(
        importlib.import_module(f"robot.tutorials.{name}").tree, arguments[1:], name=f"python -m robot.tutorials {name}"
    )


def summaries() -> dict[str, str]:
    """Name of each tutorial -> the first line of its documentation. Reads the files without running them."""
    found: dict[str, str] = {}
    for module in sorted(pkgutil.iter_modules(tutorials.__path__), key=lambda module: module.name):
        parsed = ast.parse((files(tutorials) / f"{module.name}.py").read_text(encoding="utf-8"))
        if any(isinstance(part, ast.FunctionDef) and part.name == "tree" for part in parsed.body):
            found[module.name] = (ast.get_docstring(parsed) or "").partition("\n")[0]
    return found


if __name__ == "__main__":
    sys.exit(main())
