"""Reads the annotations of a message class: its fields and its constants."""

from __future__ import annotations

import sys
from typing import Any, ClassVar, TypeAlias, get_args, get_origin

import msgspec

from actors.interfaces.errors import BadDeclaration
from actors.interfaces.fields import STRINGS, Constant, FieldType
from actors.interfaces.types import AtMost, Chars, DefaultMark, Exactly, ManyMark

Declared: TypeAlias = tuple[str, FieldType, object, Any]
"""Name, type, plain default and message class of a `Field`."""

BUILTINS = {bool: "bool", int: "int64", float: "float64", str: "string"}


def read_class(
    name: str, namespace: dict[str, object], caller: dict[str, object]
) -> tuple[list[Declared], list[Constant]]:
    """The fields and constants that the body of message class `name` declares.

    `caller` are the local names where the class statement stands: annotations may be text that mentions them.
    """
    fields: list[Declared] = []
    constants: list[Constant] = []
    for key, annotation in _annotations(namespace).items():
        if isinstance(annotation, str):
            annotation = _evaluate(name, key, annotation, namespace, caller)
        if annotation is ClassVar or get_origin(annotation) is ClassVar:
            constant = _constant(key, annotation, namespace)
            if constant is not None:
                constants.append(constant)
            continue
        kind, message = read_annotation(f"{name}.{key}", annotation)
        fields.append((key, kind, plain_default(kind, namespace.get(key)), message))
    return fields, constants


def read_annotation(where: str, annotation: Any) -> tuple[FieldType, object]:
    """The field type that an annotation means, and the message class if it is a nested one.

    Raises:
        BadDeclaration: the annotation is nothing that a ROS message can hold.
    """
    bare = annotation
    marks: tuple[object, ...] = ()
    if hasattr(annotation, "__metadata__"):
        bare, marks = annotation.__origin__, annotation.__metadata__
    kind: FieldType | None = None
    message: object = None
    for mark in marks:
        if isinstance(mark, FieldType):
            kind = mark
        elif isinstance(mark, ManyMark):
            kind, message = read_annotation(where, mark.element)
            if kind.is_array:
                raise BadDeclaration(
                    f"{where}: a sequence of sequences does not exist in ROS; put the inner one in a message"
                )
            kind = msgspec.structs.replace(kind, array="unbounded")
    if kind is None:
        kind, message = _bare(where, bare)
    for mark in marks:
        kind = _bounded(where, kind, mark)
    return kind, message


def plain_default(kind: FieldType, written: object) -> Any:
    """The default as plain data; None where it is what ROS gives anyway, so that equal types have equal fields."""
    value = written.value if isinstance(written, DefaultMark) else written
    if kind.is_array and isinstance(value, (list, tuple)):
        return tuple(value) if value or kind.array == "fixed" else None  # pyright: ignore[reportUnknownVariableType, reportUnknownArgumentType]
    if kind.is_message and not kind.is_array:
        return None
    return None if not kind.is_array and repr(value) in {"0", "0.0", "False", "''"} else value


def _bare(where: str, annotation: object) -> tuple[FieldType, object]:
    builtin = BUILTINS.get(annotation) if isinstance(annotation, type) else None
    if builtin is not None:
        return FieldType(builtin), None
    name = getattr(annotation, "__ros_type__", None)
    if isinstance(name, str) and hasattr(annotation, "__ros_fields__"):
        return FieldType(name), annotation
    raise BadDeclaration(
        f"{where}: {annotation!r} is not a type a message can hold. Use a name of actors.interfaces.types "
        "(float64, string, float64_array, ...), a message class, or Many[...] of one"
    )


def _bounded(where: str, kind: FieldType, mark: object) -> FieldType:
    if isinstance(mark, (Chars, Exactly, AtMost)) and mark.count <= 0:
        raise BadDeclaration(f"{where}: {mark!r}: a bound must be at least 1")
    if isinstance(mark, Chars):
        if kind.base not in STRINGS:
            raise BadDeclaration(f"{where}: {mark!r} bounds the characters of a string; this is {kind}")
        return msgspec.structs.replace(kind, string_bound=mark.count)
    if isinstance(mark, (Exactly, AtMost)):
        if kind.array != "unbounded":
            raise BadDeclaration(f"{where}: {mark!r} bounds an array; this is {kind}")
        array = "fixed" if isinstance(mark, Exactly) else "bounded"
        return msgspec.structs.replace(kind, array=array, size=mark.count)
    return kind


def _constant(name: str, annotation: object, namespace: dict[str, Any]) -> Constant | None:
    """ROS constants are the `ClassVar`s in capitals; other class variables are the class's own business."""
    arguments = get_args(annotation)
    if not arguments or not name.isupper() or name not in namespace:
        return None
    kind, message = read_annotation(name, arguments[0])
    if message is not None or kind.is_array:
        return None
    return Constant(name, kind, namespace[name])


def _annotations(namespace: dict[str, Any]) -> dict[str, object]:
    if "__annotations__" in namespace:
        annotations: dict[str, object] = namespace["__annotations__"]
        return annotations
    annotate = namespace.get("__annotate_func__")  # Python 3.14 keeps a function instead of the dict
    return annotate(1) if annotate is not None else {}


def _evaluate(name: str, key: str, text: str, namespace: dict[str, Any], caller: dict[str, object]) -> object:
    module = sys.modules.get(namespace.get("__module__", ""))
    known: dict[str, object] = {**vars(module), **caller} if module is not None else caller
    try:
        return eval(text, known, {})
    except NameError as error:
        raise BadDeclaration(
            f"{name}.{key}: annotation {text!r} cannot be read: {error}. Message fields need their types at run time: "
            "import them outside of `if TYPE_CHECKING`"
        ) from error
