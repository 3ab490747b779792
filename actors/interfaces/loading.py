"""Types at run time from .msg, .srv, .action and .idl files: adding a file is enough, nothing is built or generated.

    load_folder("interfaces")                      # <folder>/<package>/<kind>/<Name>.<kind>
    load("interfaces/my_pkg/msg/Sample.msg")
    load("float64 x\\nfloat64 y", "my_pkg/msg/Point2")

A loaded type is a class like any other; only type checkers know nothing of its fields.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Annotated, Any, ClassVar, Final

from actors.interfaces import lookup, registry, types
from actors.interfaces.annotations import plain_default
from actors.interfaces.errors import BadDeclaration
from actors.interfaces.fields import FieldType
from actors.interfaces.idl import parse_idl_file
from actors.interfaces.message import ActionType, Message, ServiceType, make_message
from actors.interfaces.naming import KINDS, Kind, closest, full_name
from actors.interfaces.parse import Definition, DefinitionError, MessageDefinition, parse

FOLDERS: Final = frozenset((*KINDS, *(f"{kind}s" for kind in KINDS)))
"""The folders of a package that hold definitions."""


def load(source: str | os.PathLike[str], name: str | None = None) -> type[Any]:
    """The type that a definition file, or the text of a definition, describes.

    With `name` (`pkg/msg/Name`; `pkg/Name` means a message) `source` is the text; without, it is a path
    `.../<package>/<kind>/<Name>.<kind>`, `.../<package>/<kind>/<Name>.idl` or `.../<package>/<Name>.<kind>`. Nested types must be known.

    Returns a message class, a `ServiceType` or an `ActionType`.

    Raises:
        DefinitionError: the text cannot be read, or names a type that is not known; with file and line.
        BadDeclaration: another type already has this name.
    """
    if name is not None:
        package, kind, leaf = full_name(name).split("/")
        return define(parse(os.fspath(source), package, leaf, _as_kind(kind, name)), None)
    path = Path(source)
    parent = path.parent.name if path.parent.name not in KINDS else path.parent.parent.name
    return load_file(path, parent)


def load_file(path: str | os.PathLike[str], package: str) -> type[Any]:
    """The type that one file describes, as a type of `package`."""
    return define(read_file(Path(path), package), os.fspath(path))


def read_file(file: Path, package: str) -> Definition:
    """What one file defines, as a type of `package`; of an .idl file, the folders tell the kind. Raises `DefinitionError`."""
    idl = file.suffix == ".idl"
    told = next((one for one in reversed(file.parts[:-1]) if one in FOLDERS), "").removesuffix("s")
    kind = _as_kind(told if idl else file.suffix.removeprefix("."), os.fspath(file))
    try:
        text = file.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise DefinitionError("invalid_value", f"this is no UTF-8 text: {error}", None, os.fspath(file)) from None
    return (parse_idl_file if idl else parse)(text, package, file.stem, kind, os.fspath(file))


def load_folder(path: str | os.PathLike[str]) -> list[type[Any]]:
    """All types of a folder `<path>/<package>/<kind>/<Name>.<kind>`, and of folders below these, in whatever order they need each other.

    The folder stays known: a file added later is found when its name is asked for.

    Raises:
        DefinitionError: of the first file that cannot be read, or that names an unknown type; with file and line.
        FileNotFoundError: there is no definition in it.
    """
    files = list(_definitions(Path(path)))
    if not files:
        raise FileNotFoundError(
            f"no definition in {os.fspath(path)}; expected <package>/<msg|srv|action>/<Name>.<msg|srv|action>"
        )
    for package, _, file in files:  # all are read before any is defined, so that a bad file leaves nothing half done
        read_file(file, package)
    registry.add_folder(path)
    loaded: list[type[Any]] = []
    for package, kind, file in files:
        known = lookup.find(f"{package}/{kind}/{file.stem}")
        loaded.append(known if known is not None and _defined_by(known, file) else load_file(file, package))
    return loaded


def _defined_by(known: type[Any], file: Path) -> bool:
    return getattr(known, "__ros_source__", None) == os.fspath(file)


def _definitions(path: Path) -> Iterator[tuple[str, Kind, Path]]:
    for package in sorted(path.iterdir()) if path.is_dir() else ():
        for kind in KINDS:
            for file in registry.definition_files(package, kind):
                yield package.name, kind, file


def _as_kind(kind: str, where: str) -> Kind:
    for known in KINDS:
        if kind == known:
            return known
    raise DefinitionError(
        "invalid_type_name",
        f"{where}: expected a .msg, .srv or .action definition, or an .idl file in a folder msg, srv or action",
    )


def define(definition: Definition, file: str | None) -> type[Any]:
    """The type of a definition, which comes from this file if it comes from one. Nested types must be known. Raises as `load`."""
    package, kind, name = definition.name.split("/")
    parts = [_message_class(part, package, kind, definition, file) for part in definition.parts]
    if kind == "msg":
        return parts[0]
    known: type[Any] | None = registry.known(definition.name)
    if known is not None and [getattr(known, part.__name__.rpartition("_")[2]) for part in parts] == parts:
        return known
    base: Any = ServiceType if kind == "srv" else ActionType
    body: dict[str, object] = {
        "__module__": f"{package}.{kind}",
        "__doc__": _doc(definition.parts[0], definition.name),
        "__orig_bases__": (base[tuple(parts)],),
        "__ros_type__": definition.name,
        "__ros_source__": file or "text",
        "__ros_text__": definition.text,
    }
    return type(name, (base,), body)


def _message_class(
    definition: MessageDefinition, package: str, kind: str, whole: Definition, file: str | None
) -> type[Message]:
    """The class of a definition; the known one if it says the same."""
    body = class_body(definition, lookup.find, file)
    known: type[Message] | None = registry.known(definition.name)
    if known is not None:
        _check_same(known, definition, file)
        return known
    return make_message(
        definition.name.rpartition("/")[2], body | {"__ros_source__": file or "text", "__ros_text__": whole.text}
    )


def class_body(
    definition: MessageDefinition, find: Callable[[str], type[object] | None], file: str | None
) -> dict[str, object]:
    """The body of the class of a definition. `find` gives the classes of nested messages by their full names.

    Raises:
        DefinitionError: a nested message is not known.
    """
    package, kind, name = definition.name.split("/")
    annotations: dict[str, object] = {}
    values: dict[str, object] = {}
    for constant in definition.constants:
        annotations[constant.name] = ClassVar[Annotated[object, constant.type]]
        values[constant.name] = constant.value
    for field in definition.fields:
        annotations[field.name] = _annotation(field.type, field.line, file, find)
        values[field.name] = types.default(field.default)
    return {
        "__module__": f"{package}.{kind}",
        "__qualname__": name,
        "__doc__": _doc(definition, definition.name),
        "__annotations__": annotations,
        **values,
        "__ros_type__": definition.name,
    }


def _doc(definition: MessageDefinition, name: str) -> str:
    return "\n".join([f"{name}", "", *definition.comment]).rstrip() if definition.comment else name


def _annotation(kind: FieldType, line: int, file: str | None, find: Callable[[str], type[object] | None]) -> object:
    if kind.base in {"time", "duration"}:
        better = f"builtin_interfaces/{kind.base.capitalize()}"
        raise DefinitionError("invalid_type_name", f"{kind.base!r} is a type of ROS 1; write {better}", line, file)
    if not kind.is_message:
        return Annotated[object, kind]
    message = find(kind.base)
    if message is None:
        hint = closest(kind.base, registry.known_names("msg"))
        raise DefinitionError("invalid_type_name", f"type {kind.element} is not known.{hint}", line, file)
    if not kind.is_array:
        return message
    many: object = types.Many[message]  # type: ignore[valid-type]  # a class that is known at run time only
    if kind.array == "unbounded":
        return many
    return Annotated[many, types.Exactly(kind.size) if kind.array == "fixed" else types.AtMost(kind.size)]


def _check_same(known: type[Message], definition: MessageDefinition, file: str | None) -> None:
    # Compared as text, in which even a NaN equals itself.
    mine = [f"{field.name} {field.type} {plain_default(field.type, field.default)!r}" for field in definition.fields]
    theirs = [f"{field.name} {field.type} {field.default!r}" for field in known.__ros_fields__]
    if theirs != mine:
        source = getattr(known, "__ros_source__", f"module {known.__module__}")
        raise BadDeclaration(
            f"{file or definition.name}: {definition.name} is known already with other fields, from {source}. "
            "A type cannot change while the program runs; restart it, or choose another name"
        )
