"""What a new process needs before it can unpickle an order: the parent's environment, module search path, arguments, and main module."""

from __future__ import annotations

import os
import runpy
import sys
from collections.abc import Iterable
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
    once, those that can be, so that the order need not wait for them. `directory` is the current one, empty if it has been deleted."""

    path: tuple[str, ...]
    argv: tuple[str, ...]
    environ: dict[str, str]
    directory: str
    main: str = ""
    main_is_script: bool = False
    modules: tuple[str, ...] = ()


def environment() -> dict[str, str]:
    """The environment of a new process, in which this library can be imported."""
    return {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, (_ROOT, os.environ.get("PYTHONPATH", ""))))}


def preparation(*, main: bool, modules: tuple[str, ...] = ()) -> Preparation:
    """The preparation for a process of this one; `main` says whether it needs the main module, `modules` what else it will need."""
    common = tuple(sys.path), tuple(sys.argv), dict(os.environ), _directory()
    if not main:
        return Preparation(*common, modules=modules)
    module = sys.modules["__main__"]
    sys.modules.setdefault(MAIN, module)  # so that what goes back from there to the parent is found here
    spec = module.__spec__
    if spec is not None:
        return Preparation(*common, main=spec.name)
    return Preparation(*common, main=os.path.abspath(str(module.__file__)), main_is_script=True)


def _directory() -> str:
    try:
        return os.getcwd()
    except FileNotFoundError:
        return ""


def import_all(modules: Iterable[str]) -> None:
    """Import those of these modules that can be."""
    for name in modules:
        with suppress(Exception):  # who needs it says why it cannot be imported
            import_module(name)


def prepare(given: Preparation) -> None:
    """Apply a preparation to this process; what has been applied already, in the process that has forked this one, costs nothing. Raises what
    the main module raises."""
    if os.environ != given.environ:
        os.environ.clear()
        os.environ.update(given.environ)
    with suppress(OSError):
        os.chdir(given.directory)
    sys.path[:] = given.path
    sys.argv[:] = given.argv
    import_all(given.modules)
    if given.main and sys.modules["__main__"].__name__ != MAIN:
        run = runpy.run_path if given.main_is_script else runpy.run_module
        module = ModuleType(MAIN)
        vars(module).update(run(given.main, run_name=MAIN))
        sys.modules["__main__"] = sys.modules[MAIN] = module
