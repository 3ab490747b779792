"""What a new interpreter needs before it can unpickle an order: the parent's module search path, arguments, and main module."""

from __future__ import annotations

import os
import runpy
import sys
from contextlib import suppress
from importlib import import_module
from types import ModuleType
from typing import Final

import msgspec

MAIN: Final = "__mp_main__"
"""The name under which the main module of the parent is run in its processes, as `multiprocessing` does."""
_ROOT: Final = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))


class Preparation(msgspec.Struct, frozen=True):
    """`main` is the parent's main module, by name, or by path if it is a script; empty if nothing of it is needed. `modules` are imported at
    once, those that can be, so that the order need not wait for them."""

    path: tuple[str, ...]
    argv: tuple[str, ...]
    python_path: str | None
    main: str = ""
    main_is_script: bool = False
    modules: tuple[str, ...] = ()


def environment() -> dict[str, str]:
    """The environment of a new process, in which this library can be imported."""
    return {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, (_ROOT, os.environ.get("PYTHONPATH", ""))))}


def preparation(*, main: bool, modules: tuple[str, ...] = ()) -> Preparation:
    """The preparation for a process of this one; `main` says whether it needs the main module, `modules` what else it will need."""
    common = tuple(sys.path), tuple(sys.argv), os.environ.get("PYTHONPATH")
    if not main:
        return Preparation(*common, modules=modules)
    module = sys.modules["__main__"]
    sys.modules.setdefault(MAIN, module)  # so that what goes back from there to the parent is found here
    spec = module.__spec__
    if spec is not None:
        return Preparation(*common, main=spec.name)
    return Preparation(*common, main=os.path.abspath(str(module.__file__)), main_is_script=True)


def prepare(given: Preparation) -> None:
    """Apply a preparation to this process. Raises what the main module raises."""
    if given.python_path is None:
        os.environ.pop("PYTHONPATH", None)
    else:
        os.environ["PYTHONPATH"] = given.python_path
    sys.path[:] = given.path
    sys.argv[:] = given.argv
    for name in given.modules:
        with suppress(Exception):  # who needs it says why it cannot be imported
            import_module(name)
    if given.main:
        run = runpy.run_path if given.main_is_script else runpy.run_module
        module = ModuleType(MAIN)
        vars(module).update(run(given.main, run_name=MAIN))
        sys.modules["__main__"] = sys.modules[MAIN] = module
