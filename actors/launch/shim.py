"""`shim`: lets a Python launch file import `launch`, `launch_ros` and what goes with them, and get what is here.

It holds only inside of ``with shim(context)``: then these names lead here, also where ROS 2 is installed, and afterwards every module that
was imported before is what it was. Nothing is left in ``sys.modules``.
"""

from __future__ import annotations

import sys
from collections.abc import Generator, Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib import import_module
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import TYPE_CHECKING

from actors.launch import packages_api
from actors.launch.errors import LaunchError
from actors.launch.shim_names import NAMES, OPTIONAL
from actors.launch.substitution import Substitution
from actors.suggest import did_you_mean

if TYPE_CHECKING:
    from actors.launch.context import LaunchContext


class NotSupported(ImportError):
    """A launch file imports a name of `launch` or `launch_ros` that does not exist here."""


@contextmanager
def shim(context: LaunchContext) -> Generator[None]:
    """Let imports of `launch`, `launch_ros`, `ament_index_python` and so on lead here, with the packages of this context.

    The Python modules of packages in folders can be imported, too. In a lenient context, a module that is not installed is stood in for.
    """
    table = _present()
    roots = {name.partition(".")[0] for name in table}
    before = _taken(roots)
    finder, lenient = _Finder(table), _Lenient(context)
    path = list(sys.path)
    sys.meta_path.insert(0, finder)
    if context.lenient:
        sys.meta_path.append(lenient)
    sys.path += context.packages.python_folders()
    try:
        with packages_api.used(context), context.as_own_environment():
            yield
    finally:
        sys.path[:] = path
        sys.meta_path.remove(finder)
        if context.lenient:
            sys.meta_path.remove(lenient)
        _taken(roots | lenient.roots)
        sys.modules.update(before)


def _taken(roots: set[str]) -> dict[str, ModuleType]:
    """Take the modules below these roots out of ``sys.modules``."""
    names = [name for name in sys.modules if name.partition(".")[0] in roots]
    return {name: sys.modules.pop(name) for name in names}


def _present() -> Mapping[str, Mapping[str, str]]:
    """The modules that lead here: all but those of optional packages that are installed themselves."""
    from importlib.util import find_spec

    installed = {root for root in OPTIONAL if find_spec(root) is not None}
    return {name: names for name, names in NAMES.items() if name.partition(".")[0] not in installed}


class _Finder(MetaPathFinder, Loader):
    """Finds and makes the modules of the table."""

    def __init__(self, table: Mapping[str, Mapping[str, str]]) -> None:
        self.table = table
        self.roots = {name.partition(".")[0] for name in table}

    def find_spec(self, fullname: str, path: object = None, target: object = None) -> ModuleSpec | None:
        if self.names(fullname) is not None:
            return ModuleSpec(fullname, self, origin="actors.launch", is_package=True)
        if fullname.partition(".")[0] in self.roots:
            raise NotSupported(f"{fullname} is not supported here{did_you_mean(fullname, self.table)}", name=fullname)
        return None

    def names(self, module: str) -> Mapping[str, str] | None:
        """The names of a module; one such as ``launch.actions.execute_process`` has those of the module around it."""
        if module in self.table:
            return self.table[module]
        parent, _, last = module.rpartition(".")
        around = self.table.get(parent, {})
        return around if any(name.lower() == last.replace("_", "") for name in around) else None

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        return _Module(spec.name, self.names(spec.name) or {}, self.table)

    def exec_module(self, module: ModuleType) -> None:
        """Nothing is left to do: names are looked up when they are asked for."""


class _Module(ModuleType):
    """A module whose names are those of a table: each leads to MODULE:NAME here."""

    def __init__(self, name: str, names: Mapping[str, str], table: Mapping[str, Mapping[str, str]]) -> None:
        super().__init__(name, f"{name}, as launch files import it.")
        self.__file__ = f"<{name}>"
        self.__all__ = sorted(names)
        self._names = names
        self._table = table

    def __getattr__(self, name: str) -> object:
        if name.startswith("__"):
            raise AttributeError(f"module {self.__name__!r} has no attribute {name!r}")
        if name in self._names:
            module, _, attribute = self._names[name].partition(":")
            return getattr(import_module(f"actors.launch.{module}"), attribute)
        if f"{self.__name__}.{name}" in self._table:  # it was not imported; real packages import their parts themselves
            return import_module(f"{self.__name__}.{name}")
        known = sorted(self._names)
        near = did_you_mean(name, known) or (f"; there are: {', '.join(known)}" if known else "")
        raise NotSupported(f"{self.__name__}.{name} is not supported here{near}", name=self.__name__)


class _Lenient(MetaPathFinder, Loader):
    """Stands in for modules that nobody else finds, so that the rest of a launch file can be shown; each is noted as a problem."""

    def __init__(self, context: LaunchContext) -> None:
        self.context = context
        self.roots: set[str] = set()

    def find_spec(self, fullname: str, path: Sequence[str] | None = None, target: object = None) -> ModuleSpec | None:
        root = fullname.partition(".")[0]
        if path is not None and root not in self.roots:
            return None  # a part of a package that is here
        if root not in self.roots:
            self.context.note(
                LaunchError(f"the Python module {root!r} is not installed; what it would give is left out")
            )
            self.roots.add(root)
            self.context.absent_modules = True
        return ModuleSpec(fullname, self, is_package=True)

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        return _Unknown(spec.name)

    def exec_module(self, module: ModuleType) -> None:
        """Nothing is left to do."""


class _Unknown(ModuleType):
    """A module that is not installed: whatever is asked of it is unknown."""

    def __getattr__(self, name: str) -> object:
        if name.startswith("__"):
            raise AttributeError(f"module {self.__name__!r} has no attribute {name!r}")
        return Unknown(f"{self.__name__}.{name}")


class Unknown(Substitution):
    """What a module that is not installed would have given: it can be called and asked, and stands for a text that names it."""

    absent = True

    def __init__(self, name: str) -> None:
        self._name = name

    def perform(self, context: LaunchContext) -> str:
        return str(self)

    def describe(self) -> str:
        return str(self)

    def __str__(self) -> str:
        return f"$({self._name})"

    def __getattr__(self, name: str) -> object:
        if name.startswith("__"):
            raise AttributeError(name)
        return Unknown(f"{self._name}.{name}")

    def __call__(self, *arguments: object, **keywords: object) -> Unknown:
        return self

    def __getitem__(self, key: object) -> Unknown:
        return self

    def __setitem__(self, key: object, value: object) -> None:
        """Nothing is kept."""

    def __iter__(self) -> Iterator[Unknown]:
        return iter(())
