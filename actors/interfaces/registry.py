"""Every known type by its ROS name, and the folders in which definitions are looked for.

A type gets here when its class is created: by importing a generated module, by declaring a class, or by loading a
definition at run time. `lookup` finds those that are not here yet.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from actors.interfaces.errors import BadDeclaration
from actors.interfaces.naming import KINDS, Kind


class Folder(NamedTuple):
    """A folder of definitions, `<path>/<package>/<kind>/<Name>.<kind>`, and the package of its generated modules."""

    path: str
    module: str | None


_types: dict[str, type[object]] = {}
_folders: list[Folder] = [Folder(os.path.join(os.path.dirname(__file__), "share"), "actors.interfaces")]


def register(cls: type[Any]) -> None:
    """Makes a type known by its ROS name. A class declared again (in a notebook, say) replaces the earlier one.

    Raises:
        BadDeclaration: the name belongs to a type that comes from a definition.
    """
    name: str = cls.__ros_type__
    if not (_is_generated(cls) or hasattr(cls, "__ros_source__")):
        earlier = _types.get(name)
        definition = find_definition(name)
        if definition is not None or hasattr(earlier, "__ros_source__"):
            place = definition[1] if definition is not None else getattr(earlier, "__ros_source__", "")
            raise BadDeclaration(
                f"class {cls.__module__}.{cls.__qualname__}: {name} is defined by {place}; use that type "
                f"(get_message({name!r})), or choose another name"
            )
    _types[name] = cls


def known(name: str) -> type[Any] | None:
    """The class of a full name if it is in memory already, else None."""
    return _types.get(name)


def _is_generated(cls: type[Any]) -> bool:
    package, kind, _ = cls.__ros_type__.split("/")
    return any(
        folder.module is not None and cls.__module__ == f"{folder.module}.{package}.{kind}" for folder in _folders
    )


def add_folder(path: str | os.PathLike[str], module: str | None = None) -> None:
    """Adds a folder of definitions. `module` is the Python package of its generated modules, None if it has none."""
    folder = Folder(os.fspath(path), module)
    if folder not in _folders:
        _folders.append(folder)


def folders() -> tuple[Folder, ...]:
    """The folders that are searched, in order."""
    return tuple(_folders)


def find_definition(name: str) -> tuple[Folder, str] | None:
    """The folder and the file that define `package/kind/Name` (or a part such as `S_Request`), None if none does."""
    package, kind, leaf = name.split("/")
    stem = leaf.partition("_")[0]
    for folder in _folders:
        path = os.path.join(folder.path, package, kind, f"{stem}.{kind}")
        if os.path.isfile(path):
            return folder, path
        for file in definition_files(os.path.join(folder.path, package), kind):
            if file.stem == stem:
                return folder, os.fspath(file)
    return None


def definition_files(package: str | os.PathLike[str], kind: str) -> list[Path]:
    """The files of this kind in the folder of a package, sorted: those in `msg`, or in `msgs`, and in folders below.

    An .idl file counts where no other one defines its type: ROS 2 installs one beside each .msg file.
    """
    inner = [Path(package, folder) for folder in (kind, f"{kind}s")]
    found = sorted(file for folder in inner for file in folder.glob(f"**/*.{kind}"))
    known = {file.stem for file in found}
    return found + sorted(file for folder in inner for file in folder.glob("**/*.idl") if file.stem not in known)


def known_names(kind: Kind | None = None) -> list[str]:
    """The full names of all interfaces (not of their parts): those in memory and those in the folders, sorted."""
    found = {name for name in _types if "_" not in name.rpartition("/")[2]}
    for folder in _folders:
        found.update(_names_in(folder.path))
    return sorted(name for name in found if kind is None or name.split("/")[1] == kind)


def _names_in(path: str) -> Iterator[str]:
    for package in os.listdir(path) if os.path.isdir(path) else ():
        for kind in KINDS:
            yield from (f"{package}/{kind}/{file.stem}" for file in definition_files(os.path.join(path, package), kind))
