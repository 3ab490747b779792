"""`shim`: lets a Python launch file import `launch`, `launch_ros` and what goes with them, and get what is here.

It holds only inside of ``with shim(context)``: then these names lead here, also where ROS 2 is installed, and afterwards every module that
was imported before is what it was. Nothing is left in ``sys.modules``.
"""

from __future__ import annotations

import sys
from collections.abc import Generator, Mapping
from contextlib import contextmanager
from importlib import import_module
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import TYPE_CHECKING, Any

from actors.launch.shim_names import NAMES, OPTIONAL
from actors.suggest import did_you_mean

if TYPE_CHECKING:
    from actors.launch.context import LaunchContext

__all__ = ["NotSupported", "shim"]


class NotSupported(ImportError):
    """A launch file imports a name of `launch` or `launch_ros` that does not exist here."""


@contextmanager
def shim(context: LaunchContext) -> Generator[None]:
    """Let imports of `launch`, `launch_ros`, `ament_index_python` and so on lead here, with the packages of this context."""
    from actors.launch import packages_api

    roots = {name.partition(".")[0] for name in _present()}
    before = {name: module for name, module in sys.modules.items() if name.partition(".")[0] in roots}
    for name in before:
        del sys.modules[name]
    finder = _Finder(_present())
    sys.meta_path.insert(0, finder)
    try:
        with packages_api.used(context):
            yield
    finally:
        sys.meta_path.remove(finder)
        for name in [name for name in sys.modules if name.partition(".")[0] in roots]:
            del sys.modules[name]
        sys.modules.update(before)


def _present() -> Mapping[str, Mapping[str, str]]:
    """The modules that lead here: all but those of optional packages that are installed themselves."""
    from importlib.util import find_spec

    installed = {root for root in OPTIONAL if root in sys.modules or find_spec(root) is not None}
    return {name: names for name, names in NAMES.items() if name.partition(".")[0] not in installed}


class _Finder(MetaPathFinder, Loader):
    """Finds and makes the modules of the table."""

    def __init__(self, table: Mapping[str, Mapping[str, str]]) -> None:
        self.table = table
        self.roots = {name.partition(".")[0] for name in table}

    def find_spec(self, fullname: str, path: object = None, target: object = None) -> ModuleSpec | None:
        if fullname in self.table:
            return ModuleSpec(fullname, self, origin="actors.launch", is_package=True)
        if fullname.partition(".")[0] in self.roots:
            near = did_you_mean(fullname, self.table)
            raise NotSupported(f"{fullname} is not supported here{near}", name=fullname)
        return None

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        return _Module(spec.name, self.table[spec.name], self.table)

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

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(f"module {self.__name__!r} has no attribute {name!r}")
        if name in self._names:
            module, _, attribute = self._names[name].partition(":")
            return getattr(import_module(f"actors.launch.{module}"), attribute)
        if f"{self.__name__}.{name}" in self._table:
            return import_module(f"{self.__name__}.{name}")
        known = sorted(self._names)
        near = did_you_mean(name, known) or (f"; there are: {', '.join(known)}" if known else "")
        raise NotSupported(f"{self.__name__}.{name} is not supported here{near}", name=self.__name__)
