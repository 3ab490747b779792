"""Packages as folders: the sources of ROS 2 packages in a workspace, folders that stand for packages, and the folders of modules."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

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
