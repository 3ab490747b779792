"""Every known type by its ROS name.

A type gets here when its class is created: by importing a generated module, by declaring a class, or by loading a
definition at run time. A name that is asked for and not here is looked for in the known folders of definitions.
"""

from __future__ import annotations

import importlib
import os
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from actors.interfaces.errors import BadDeclaration, UnknownInterface
from actors.interfaces.naming import KINDS, Kind, closest, full_name

if TYPE_CHECKING:
    from collections.abc import Iterator

    from actors.interfaces.message import ActionType, Message, ServiceType


class Folder(NamedTuple):
    """A folder of definitions, `<path>/<package>/<kind>/<Name>.<kind>`, and the package of its generated modules."""

    path: str
    module: str | None


_FULL: Final = re.compile(r"[A-Za-z]\w*(/[A-Za-z]\w*){2}\Z", re.ASCII)
_types: dict[str, type[Any]] = {}
_loading: list[str] = []
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


def known(name: str) -> Any:
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


def get_message(name: str) -> type[Message]:
    """The message class of `std_msgs/msg/String` or `std_msgs/String`, also of a part: `std_srvs/srv/SetBool_Request`.

    Raises:
        UnknownInterface: no such message. The text gives the closest names.
    """
    from actors.interfaces.message import Message

    found: type[Message] = _get(name, "msg", Message)
    return found


def get_service(name: str) -> type[ServiceType[Any, Any]]:
    """The service type of `std_srvs/srv/SetBool` (or `std_srvs/SetBool`), also of a part: `pkg/action/Move_SendGoal`.

    Raises:
        UnknownInterface: no such service. The text gives the closest names.
    """
    from actors.interfaces.message import ServiceType

    found: type[ServiceType[Any, Any]] = _get(name, "srv", ServiceType)
    return found


def get_action(name: str) -> type[ActionType[Any, Any, Any]]:
    """The action type of `example_interfaces/action/Fibonacci` (or `example_interfaces/Fibonacci`).

    Raises:
        UnknownInterface: no such action. The text gives the closest names.
    """
    from actors.interfaces.message import ActionType

    found: type[ActionType[Any, Any, Any]] = _get(name, "action", ActionType)
    return found


def _get(name: str, kind: Kind, base: type[Any]) -> Any:
    found = find(full_name(name, kind))
    if found is None or not issubclass(found, base):
        raise _unknown(name, kind, found)
    return found


def find(name: str) -> type[Any] | None:
    """The class of a full name, or None. Imports the generated module or loads the definition if it must.

    The name may be that of any peer: what is not ``package/kind/Name`` is no name, and leads to no file.
    """
    found = _types.get(name)
    if found is not None or not _FULL.match(name):
        return found
    from actors.interfaces.derived import derive

    definition = find_definition(name)
    if definition is None:
        return derive(name)
    (_, module), file = definition
    package, kind, leaf = name.split("/")
    if module is not None and _import(f"{module}.{package}.{kind}") and name in _types:
        return _types[name]
    if f"{package}/{kind}/{leaf.partition('_')[0]}" not in _types:
        _load_once(file, package)
    return _types.get(name) or derive(name)


def _load_once(file: str, package: str) -> None:
    from actors.interfaces.loading import load_file
    from actors.interfaces.parse import DefinitionError

    if file in _loading:
        raise DefinitionError("invalid_type_name", "the type contains itself", None, file)
    _loading.append(file)
    try:
        load_file(file, package)
    finally:
        _loading.remove(file)


def _import(module: str) -> bool:
    try:
        importlib.import_module(module)
    except ModuleNotFoundError as error:
        if error.name is None or not module.startswith(error.name):
            raise
        return False
    return True


def _unknown(name: str, kind: Kind, found: object) -> UnknownInterface:
    words = {"msg": "message", "srv": "service", "action": "action"}
    if found is not None:
        actual = full_name(name, kind).split("/")[1]
        return UnknownInterface(f"{name} is not a {words[kind]} but belongs to {actual}; ask for it as such")
    full = full_name(name, kind)
    package = full.split("/")[0]
    names = known_names()
    if not any(known.startswith(f"{package}/") for known in names):
        hint = closest(package, {known.split("/")[0] for known in names})
        return UnknownInterface(f"unknown {words[kind]} {name!r}: no package {package!r} is known here.{hint}")
    return UnknownInterface(f"unknown {words[kind]} {name!r}.{closest(full, names)}")
