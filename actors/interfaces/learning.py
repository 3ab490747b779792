"""Types that are defined here by what others say of them: the descriptions of other processes, and the texts in bags.

What others say is bounded before it is read. `definitions_of` and `read` take it apart in time that grows with its
length alone, the former without any effect, so that it may run in another thread; `define` makes the types.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from graphlib import CycleError, TopologicalSorter
from typing import Final, cast

from msgspec import structs

from actors.interfaces import lookup, registry
from actors.interfaces.errors import InterfaceError
from actors.interfaces.fields import PLACEHOLDER, FieldType
from actors.interfaces.hashes import ARRAY_OFFSETS, BOUNDED_STRING, NESTED, TYPE_IDS
from actors.interfaces.loading import define as define_one
from actors.interfaces.naming import Kind, full_name
from actors.interfaces.parse import PARTS, Definition, DefinitionError, parse
from actors.interfaces.type_description_interfaces import msg
from actors.interfaces.type_description_interfaces.srv import GetTypeDescription_Response

MOST_BYTES: Final = 1 << 20
"""The largest description, and the longest texts of a type and all that it contains."""
_MOST_TYPES: Final = 500
"""That a type contains, itself included; the largest types of ROS 2 contain some thirty."""
_MOST_FIELDS: Final = 1000
"""Fields and constants of all these together."""
_DEEPEST: Final = 50
"""Levels of types that contain each other."""

_MOST_LEARNT: Final = 5000
"""Types that are learnt while the process runs. They stay."""
_learnt: set[str] = set()

_PRIMITIVES: Final = {number: name for name, number in TYPE_IDS.items() if name != "char"}


def definitions_of(name: str, answers: Iterable[GetTypeDescription_Response]) -> list[Definition]:
    """The definitions of a type and of those that it contains, by their sources, or as they are described if these say anything else.

    The answers are those of `get_type_description`. See `read` for the order, and for what is not among them. Empty if `name` is not described.
    Raises `InterfaceError` for a description that is none, or beyond all bounds.
    """
    each: dict[str, msg.IndividualTypeDescription] = {}
    texts: dict[str, str] = {}
    for answer in answers:
        told = answer.type_description
        each |= {one.type_name: one for one in (told.type_description, *told.referenced_type_descriptions)}
        for source in answer.type_sources:
            if source.encoding in ("msg", "srv", "action") and source.raw_file_contents:
                texts[source.type_name] = source.raw_file_contents
    _check(len(each) <= _MOST_TYPES, "types", _MOST_TYPES)
    _check(sum(len(one.fields) for one in each.values()) <= _MOST_FIELDS, "fields", _MOST_FIELDS)
    _check(sum(map(len, texts.values())) <= MOST_BYTES, "bytes", MOST_BYTES)
    found: dict[str, Definition] = {}
    waiting = [name]
    while waiting:
        one = waiting.pop()
        if one in found or registry.known(one) is not None:
            continue
        kind = cast("Kind", full_name(one).split("/")[1])
        parts = [part for part in (f"{one}{suffix}" for suffix in PARTS[kind]) if part in each]
        if not parts:
            continue  # it is defined in a folder here, or `define` tells that it is not known
        composed = _parsed("---\n".join(_definition(each[part]) for part in parts), one)
        found[one] = _as_written(texts[one], composed) if one in texts else composed
        waiting += _needed(found[one])
    return _ordered(found)


def read(texts: Mapping[str, str]) -> list[Definition]:
    """The definitions in these texts by the names of their types, each after those that it contains; those that are known here are left out.

    Raises `InterfaceError` for a text that is no definition, for types that contain themselves, and beyond all bounds.
    """
    _check(len(texts) <= _MOST_TYPES, "types", _MOST_TYPES)
    _check(sum(map(len, texts.values())) <= MOST_BYTES, "bytes", MOST_BYTES)
    return _ordered({name: _parsed(text, name) for name, text in texts.items() if lookup.find(name) is None})


def define(definitions: Iterable[Definition]) -> None:
    """Define types in this order; those that are known already stay as they are.

    Raises `InterfaceError` for one that contains a type that is not known, or has a name in it that nothing can have here.
    """
    for definition in definitions:
        if lookup.find(definition.name) is None:
            if len(_learnt) >= _MOST_LEARNT:
                raise InterfaceError(
                    f"{definition.name} stays unknown: {_MOST_LEARNT} types have been learnt from others"
                )
            define_one(definition, None)
            _learnt.add(definition.name)


def _check(right: bool, what: str, most: int) -> None:
    if not right:
        raise InterfaceError(f"a description of a type has more than {most} {what}")


def _parsed(text: str, name: str) -> Definition:
    package, kind, leaf = full_name(name).split("/")
    return parse(text, package, leaf, cast("Kind", kind))


def _as_written(text: str, composed: Definition) -> Definition:
    """What is written of a type, with its comments and constants, if it has the fields that the type is described with."""
    try:
        written = _parsed(text, composed.name)
    except DefinitionError:
        return composed
    return written if _fields(written) == _fields(composed) else composed


def _fields(definition: Definition) -> list[list[tuple[str, FieldType]]]:
    """The fields as descriptions have them, which know no char."""
    return [[(field.name, _described(field.type)) for field in part.fields] for part in definition.parts]


def _described(kind: FieldType) -> FieldType:
    return structs.replace(kind, base="uint8") if kind.base == "char" else kind


def _needed(definition: Definition) -> list[str]:
    return [field.type.base for part in definition.parts for field in part.fields if field.type.is_message]


def _ordered(definitions: Mapping[str, Definition]) -> list[Definition]:
    """Each after those that it contains. Raises `InterfaceError` for a circle, and beyond all bounds."""
    size = sum(len(part.fields) + len(part.constants) for one in definitions.values() for part in one.parts)
    _check(size <= _MOST_FIELDS, "fields and constants", _MOST_FIELDS)
    needed = {
        name: [one for one in _needed(definition) if one in definitions] for name, definition in definitions.items()
    }
    try:
        order = list(TopologicalSorter(needed).static_order())
    except CycleError as error:
        circle = cast("Sequence[str]", error.args[1])
        raise InterfaceError(f"the type {circle[0]} contains itself: {', '.join(circle[:5])}") from None
    depths: dict[str, int] = {}
    for name in order:
        depths[name] = 1 + max((depths[one] for one in needed[name]), default=0)
    _check(max(depths.values(), default=0) <= _DEEPEST, "levels", _DEEPEST)
    return [definitions[name] for name in order]


def _definition(individual: msg.IndividualTypeDescription) -> str:
    """The definition of one message, without defaults and constants: descriptions have none."""
    fields = [field for field in individual.fields if field.name != PLACEHOLDER]
    return "".join(f"{_spelled(field.type)} {field.name}\n" for field in fields)


def _spelled(kind: msg.FieldType) -> str:
    """The type of a field as a definition spells it."""
    array, offset = max(
        ((name, start) for name, start in ARRAY_OFFSETS.items() if start < max(kind.type_id, 1)),
        key=lambda pair: pair[1],
    )
    number = kind.type_id - offset
    if number == NESTED:
        package, _, name = full_name(kind.nested_type_name).split("/")
        element = f"{package}/{name}"
    elif number in _PRIMITIVES:
        element = _PRIMITIVES[number]
    elif number - BOUNDED_STRING in _PRIMITIVES:
        element = f"{_PRIMITIVES[number - BOUNDED_STRING]}<={kind.string_capacity}"
    else:
        raise InterfaceError(f"a description has a field of type id {kind.type_id}, which is not known")
    suffix = {"single": "", "fixed": f"[{kind.capacity}]", "bounded": f"[<={kind.capacity}]", "unbounded": "[]"}[array]
    return element + suffix
