"""Programs that start their launch themselves, by `launch.LaunchService`."""

from __future__ import annotations

import runpy
import sys
from collections.abc import Sequence
from pathlib import Path

from actors.launch.context import LaunchContext
from actors.launch.loading import MAKERS
from actors.launch.packages import Packages
from actors.launch.shim import shim


def starts_itself(path: Path) -> bool:
    """Whether a Python file is such a program: it uses `LaunchService`, and has no function that gives a description."""
    if path.suffix != ".py":
        return False
    text = path.read_text(encoding="utf-8", errors="replace")
    return "LaunchService" in text and not any(name in text for name in MAKERS)


def run_script(
    path: Path, argv: Sequence[str] = (), *, packages: Packages | None = None, stand_ins: bool = False
) -> int:
    """Run a program whose imports of `launch` and `launch_ros` lead here, and return its exit code.

    `argv` are its arguments; `packages` say where executables and files are. With `stand_ins`, an empty node stands in for an executable
    that is not here.
    """
    context = LaunchContext(packages, argv=argv, stand_ins=stand_ins)
    before = list(sys.argv)
    sys.argv[:] = [str(path), *argv]
    try:
        with shim(context):
            sys.path.insert(0, str(path.resolve().parent))  # as `python start.py` has it
            runpy.run_path(str(path), run_name="__main__")
    except SystemExit as end:
        if isinstance(end.code, str):
            print(end.code, file=sys.stderr)
            return 1
        return end.code or 0
    finally:
        sys.argv[:] = before
    return 0
