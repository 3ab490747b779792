"""The functions of `ament_index_python`, as launch files call them, for the packages of the context in which the file is read."""

from __future__ import annotations

from collections.abc import Generator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import TYPE_CHECKING, Final

from actors.launch.errors import LaunchError

if TYPE_CHECKING:
    from actors.launch.context import LaunchContext

_context: Final[ContextVar[LaunchContext]] = ContextVar("launch context")


class PackageNotFoundError(KeyError):
    """There is no package of that name; the text lists those that there are."""

    def __str__(self) -> str:
        return str(self.args[0])


@contextmanager
def used(context: LaunchContext) -> Generator[None]:
    """Let the functions below answer for the packages of this context."""
    token = _context.set(context)
    try:
        yield
    finally:
        _context.reset(token)


def context_here() -> LaunchContext:
    """The context in which a launch file is being evaluated."""
    return _context.get()


def get_package_share_directory(package_name: str, print_warning: bool = True) -> str:
    """The share folder of a package. Raises `PackageNotFoundError`."""
    context = _context.get()
    try:
        return str(context.packages.share(package_name))
    except LookupError as error:
        return _missing(str(error.args[0]), f"$(find-pkg-share {package_name})")


def get_package_share_path(package_name: str, print_warning: bool = True) -> Path:
    """The share folder of a package, as a path."""
    return Path(get_package_share_directory(package_name))


def get_package_prefix(package_name: str) -> str:
    """The prefix below which a package is installed. Raises `PackageNotFoundError`."""
    context = _context.get()
    try:
        return str(context.packages.prefix(package_name))
    except LookupError as error:
        return _missing(str(error.args[0]), f"$(find-pkg-prefix {package_name})")


def has_resource(resource_type: str, resource_name: str) -> str:
    """The prefix of a package; empty if it is not here, and for every other kind of resource: there is no index of those."""
    if resource_type != "packages":
        return ""
    try:
        return str(_context.get().packages.prefix(resource_name))
    except LookupError:
        return ""


def get_packages_with_prefixes() -> dict[str, str]:
    """All packages, each with its prefix."""
    packages = _context.get().packages
    return {name: str(packages.prefix(name)) for name in packages.names()}


def _missing(problem: str, text: str) -> str:
    context = _context.get()
    if not context.lenient:
        raise PackageNotFoundError(problem)
    return context.stand_in(LaunchError(problem), text)
