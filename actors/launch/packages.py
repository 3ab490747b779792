"""`Packages`: where packages, their executables and their share folders are.

A package is found in the first of these places that has it:

1. the entry points ``robactor.nodes`` of what is installed here: nodes of this framework, by a name such as ``my_package.talker``, whose
   value is a node class, a tree, or a function that makes one; an entry ``my_package`` alone names the module beside which its files lie;
2. the folders given as `paths`: workspaces with the sources of packages, and folders that stand for packages;
3. distributions installed here, with their console scripts as executables;
4. the prefixes in ``AMENT_PREFIX_PATH``, those of a ROS 2 installation, and the prefix of this Python;
5. the examples: what the entry points ``robactor.examples`` of what is installed here name, each a dictionary
   ``{package: {executable: "module:Node"}}``.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import suppress
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

from actors.suggest import did_you_mean

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

DEEPEST = 5
"""How many folders below the root of a workspace packages are looked for."""

IGNORED = ("COLCON_IGNORE", "AMENT_IGNORE")
"""Files that exclude the folder in which they lie, as for colcon."""

PROGRAM_FOLDERS = ("scripts", "nodes", "bin", "src", "")
"""Where the sources of a package have programs that can be run as they are; `lib/<package>`, where they are installed, comes first."""


class Share(NamedTuple):
    """The folder of one package, whose files are found there as they would be in its share folder."""

    name: str
    folder: Path

    def programs(self) -> Iterator[Path]:
        """The executable files of the package."""
        for place in (Path("lib") / self.name, *map(Path, PROGRAM_FOLDERS), Path(self.name)):
            folder = self.folder / place
            if folder.is_dir():
                yield from (path for path in sorted(folder.iterdir()) if path.is_file() and os.access(path, os.X_OK))


def packages_below(roots: Iterable[Path]) -> dict[str, Share]:
    """The packages below each folder, by name: every folder with a ``package.xml``, and every direct one with none below it.

    A package that is found twice is the one found first.
    """
    found: dict[str, Share] = {}
    for root in roots:
        for share in _below(root.absolute(), 0):
            found.setdefault(share.name, share)
        for folder in sorted(path for path in root.absolute().iterdir() if path.is_dir()):
            if not any(True for _ in _below(folder, 1)) and not folder.name.startswith("."):
                found.setdefault(folder.name, Share(folder.name, folder))
    return found


def _below(folder: Path, depth: int) -> Iterator[Share]:
    if (folder / "package.xml").is_file():
        yield Share(_declared_name(folder), folder)
        return
    if depth >= DEEPEST or any((folder / name).exists() for name in IGNORED):
        return
    for inner in sorted(path for path in folder.iterdir() if path.is_dir() and not path.name.startswith(".")):
        yield from _below(inner, depth + 1)


def _declared_name(folder: Path) -> str:
    """The name in ``package.xml``; that of the folder, if the file is not to be read."""
    from xml.etree import ElementTree

    try:
        name = ElementTree.parse(folder / "package.xml").getroot().findtext("name")
    except (ElementTree.ParseError, OSError):
        return folder.name
    return (name or "").strip() or folder.name


def folder_of_module(module: str) -> Path | None:
    """The folder in which a module or package lies, without importing it; None if there is no such module.

    Importing the packages around it cannot be avoided, as Python finds a module by its package.
    """
    from importlib.util import find_spec

    try:
        spec = find_spec(module)
    except ImportError:
        return None
    if spec is None:
        return None
    places = list(spec.submodule_search_locations or ())
    if not places and spec.has_location and spec.origin is not None:
        places = [str(Path(spec.origin).parent)]
    return Path(places[0]) if places else None


GROUP = "robactor.nodes"
"""The group of entry points in which a distribution names its nodes."""

EXAMPLES = "robactor.examples"
"""The group of entry points in which a distribution names its examples: they are no packages of its users."""

OURS = "robactor"
"""The distribution of this framework: a package in `paths` that has the name of one of its own goes before it."""

SHOWN = 30
"""How many names an error lists."""


class NodeTarget(NamedTuple):
    """An executable that is a node, or several, of this framework: ``target`` is MODULE:NAME of its class, tree, or maker."""

    package: str
    name: str
    target: str


class Program(NamedTuple):
    """An executable that is a program of its own, run as a process."""

    package: str
    name: str
    path: Path


Executable: TypeAlias = NodeTarget | Program
"""An executable of a package."""


class UnknownPackage(LookupError):
    """There is no package of that name; the text lists those that there are."""


class UnknownExecutable(LookupError):
    """The package has no executable of that name, or no such file; the text lists those that it has."""


class Packages:
    """The packages that can be found from here, looked up when they are asked for.

    `paths` are further folders with packages, `environment` the variables of which ``AMENT_PREFIX_PATH`` is read (default: those of this
    process). What is installed is read once.
    """

    def __init__(
        self, paths: Iterable[str | os.PathLike[str]] = (), environment: Mapping[str, str] | None = None
    ) -> None:
        self._sources = packages_below(map(Path, paths))
        self._environment = os.environ if environment is None else environment

    def add_package_of(self, file: Path) -> None:
        """Find the package in whose sources `file` lies, too, if it lies in those of any. Packages that are known stay what they are."""
        for folder in file.absolute().parents:
            if (folder / "package.xml").is_file():
                for name, share in packages_below([folder]).items():
                    self._sources.setdefault(name, share)
                return

    def python_folders(self) -> list[str]:
        """The folders from which the Python modules of the packages in `paths` can be imported."""
        return [str(one.folder) for one in self._sources.values() if (one.folder / one.name / "__init__.py").is_file()]

    def names(self) -> list[str]:
        """The packages, sorted: those with nodes of this framework, those of `paths`, those of the prefixes, and the examples."""
        return sorted({*self._entries, *self._sources, *self._of_prefixes(), *self._examples})

    def executables(self, package: str) -> dict[str, Executable]:
        """The executables of a package by name, sorted. Raises `UnknownPackage`."""
        found: dict[str, Executable] = {}
        first: list[Callable[[str], Iterable[Executable]]] = [self._nodes, self._source_programs]
        if self._is_ours(package):
            first.reverse()
        for place in (*first, self._scripts, self._prefix_programs):
            for executable in place(package):
                found.setdefault(executable.name, executable)
        if not found and self._installed_share(package) is None:
            nodes = self._examples.get(package)
            if nodes is None:
                raise self._unknown(package)
            found = {name: NodeTarget(package, name, target) for name, target in nodes.items()}
        return dict(sorted(found.items()))

    def find(self, package: str, executable: str) -> Executable:
        """An executable of a package. Raises `UnknownPackage` or `UnknownExecutable`."""
        known = self.executables(package)
        if executable in known:
            return known[executable]
        near = did_you_mean(executable, known)
        listed = _listed(known) if known else f"{_listed(known)[:-1]}{self._to_install(package)})"
        raise UnknownExecutable(f"package {package!r} has no executable {executable!r}{near}{listed}")

    def _to_install(self, package: str) -> str:
        """What makes the nodes of a Python package known of which only the sources are here."""
        folder = self._source_share(package)
        if folder is None or not any((folder / name).is_file() for name in ("setup.py", "pyproject.toml")):
            return ""
        return f"; pip install -e {folder} makes those known that it declares"

    def share(self, package: str) -> Path:
        """The folder in which the files of a package lie: its launch and parameter files. Raises `UnknownPackage`."""
        folder = self._installed_share(package)
        if folder is None and package in self._examples:
            module = next(iter(self._examples[package].values()), "").partition(":")[0]
            folder = folder_of_module(module) if module else None
        if folder is None:
            raise self._unknown(package)
        return folder

    def _installed_share(self, package: str) -> Path | None:
        """That of a package that is no example; None if there is none."""
        first: tuple[Callable[[str], Path | None], ...] = (
            (self._source_share, self._prefix_share, self._entry_share)
            if self._is_ours(package)
            else (self._entry_share, self._source_share)
        )
        for place in (*first, self._prefix_share, self._module_share):
            if (folder := place(package)) is not None:
                return folder
        return None

    def prefix(self, package: str) -> Path:
        """The prefix below which a package is installed; for one that is not, the folder of its files. Raises `UnknownPackage`."""
        for prefix in self._prefixes():
            if _is_in(prefix, package):
                return prefix
        return self.share(package)

    def file(self, package: str, name: str, suffixes: tuple[str, ...] = ()) -> Path:
        """The file of this name somewhere in the share folder of a package: a launch file.

        Raises `UnknownPackage`; `UnknownExecutable`, which lists the files with one of the `suffixes`; and `LookupError` when several
        files have that name.
        """
        share = self.share(package)
        found = sorted(path for path in share.rglob(name) if path.is_file())
        if len(found) > 1:
            raise LookupError(f"package {package!r} has several files {name!r}: {', '.join(map(str, found))}")
        if not found:
            known = sorted({path.name for path in share.rglob("*") if path.name.endswith(suffixes) and path.is_file()})
            raise UnknownExecutable(f"no file {name!r} in {share}{did_you_mean(name, known)}{_listed(known)}")
        return found[0]

    # -- entry points -------------------------------------------------------------------------------------------------------

    @cached_property
    def _entries(self) -> dict[str, dict[str, EntryPoint]]:
        """Package -> name of the executable -> entry point; the one of the package itself has no name."""
        from importlib.metadata import entry_points  # late: it looks at all that is installed

        found: dict[str, dict[str, EntryPoint]] = {}
        for entry in entry_points(group=GROUP):
            package, _, name = entry.name.partition(".")
            found.setdefault(package, {})[name] = entry
        return found

    @cached_property
    def _examples(self) -> dict[str, Mapping[str, str]]:
        """Package -> name of the executable -> MODULE:NAME."""
        from importlib.metadata import entry_points

        found: dict[str, Mapping[str, str]] = {}
        for entry in entry_points(group=EXAMPLES):
            with suppress(ImportError, AttributeError):  # its examples are missed, and nothing else
                found |= entry.load()
        return found

    def _is_ours(self, package: str) -> bool:
        """Whether this distribution brings the package."""
        return any(
            entry.dist is not None and entry.dist.name == OURS for entry in self._entries.get(package, {}).values()
        )

    def _nodes(self, package: str) -> Iterator[NodeTarget]:
        for name, entry in self._entries.get(package, {}).items():
            if name:
                yield NodeTarget(package, name, entry.value.partition("[")[0].strip())

    def _entry_share(self, package: str) -> Path | None:
        entries = self._entries.get(package, {})
        entry = entries.get("") or next(iter(entries.values()), None)
        return None if entry is None else folder_of_module(entry.module)

    # -- folders with sources -----------------------------------------------------------------------------------------------

    def _source_programs(self, package: str) -> Iterator[Program]:
        if package in self._sources:
            for path in self._sources[package].programs():
                yield Program(package, path.name, path)

    def _source_share(self, package: str) -> Path | None:
        return self._sources[package].folder if package in self._sources else None

    # -- what is installed --------------------------------------------------------------------------------------------------

    def _scripts(self, package: str) -> Iterator[Program]:
        from importlib.metadata import PackageNotFoundError, distribution

        try:
            entries = distribution(package).entry_points
        except (PackageNotFoundError, ValueError):
            return
        for entry in entries.select(group="console_scripts"):
            path = Path(sys.executable).parent / entry.name
            if path.is_file():
                yield Program(package, entry.name, path)

    def _module_share(self, package: str) -> Path | None:
        """The folder of the module of this name, if a distribution of this name has console scripts."""
        return folder_of_module(package) if package.isidentifier() and any(self._scripts(package)) else None

    def _prefixes(self) -> Iterator[Path]:
        for text in self._environment.get("AMENT_PREFIX_PATH", "").split(os.pathsep):
            if text:
                yield Path(text)
        yield Path(sys.prefix)

    def _of_prefixes(self) -> Iterator[str]:
        for prefix in self._prefixes():
            index = prefix / "share" / "ament_index" / "resource_index" / "packages"
            if index.is_dir():
                yield from (path.name for path in index.iterdir())

    def _prefix_programs(self, package: str) -> Iterator[Program]:
        for prefix in self._prefixes():
            folder = prefix / "lib" / package
            if folder.is_dir():
                for path in folder.iterdir():
                    if path.is_file() and os.access(path, os.X_OK):
                        yield Program(package, path.name, path)

    def _prefix_share(self, package: str) -> Path | None:
        return next((prefix / "share" / package for prefix in self._prefixes() if _is_in(prefix, package)), None)

    # -- errors -------------------------------------------------------------------------------------------------------------

    def _unknown(self, package: str) -> UnknownPackage:
        known = self.names()
        return UnknownPackage(f"package {package!r} not found{did_you_mean(package, known)}{_listed(known)}")


def _is_in(prefix: Path, package: str) -> bool:
    return (prefix / "share" / "ament_index" / "resource_index" / "packages" / package).is_file() or (
        prefix / "share" / package / "package.xml"
    ).is_file()


def _listed(known: Collection[str]) -> str:
    """The end of an error's text: what there is."""
    more = f", and {len(known) - SHOWN} more" if len(known) > SHOWN else ""
    return f" (there are: {', '.join([*known][:SHOWN])}{more})" if known else " (there is none)"
