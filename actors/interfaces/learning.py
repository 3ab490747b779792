"""Types that are defined here by the descriptions that other processes give of them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Final

from actors.interfaces.errors import InterfaceError
from actors.interfaces.hashes import ARRAY_OFFSETS, BOUNDED_STRING, NESTED, TYPE_IDS
from actors.interfaces.loading import load
from actors.interfaces.registry import find
from actors.interfaces.text import PARTS

__all__ = ["define"]

PLACEHOLDER: Final = "structure_needs_at_least_one_member"
"""The field that ROS 2 puts into an empty type."""

_PRIMITIVES: Final = {number: name for name, number in TYPE_IDS.items() if name != "char"}


def define(name: str, answers: Iterable[Any]) -> None:
    """Define a type and those that it contains here, those that are known already excepted: by their sources, or as they are described.

    Raises `InterfaceError` for a description that is none.
    """
    each: dict[str, Any] = {}
    texts: dict[str, str] = {}
    for answer in answers:
        described = answer.type_description
        each |= {one.type_name: one for one in (described.type_description, *described.referenced_type_descriptions)}
        for source in answer.type_sources:
            if source.encoding in ("msg", "srv", "action") and source.raw_file_contents:
                texts[source.type_name] = source.raw_file_contents
    _define(name, each, texts)


def _define(name: str, described: Mapping[str, Any], texts: Mapping[str, str]) -> None:
    if find(name) is not None:
        return
    kind = name.split("/")[1]
    parts = [f"{name}_{part}" for part in PARTS.get(kind, ())] or [name]
    if not any(part in described for part in parts):
        return
    for part in parts:
        for field in described[part].fields if part in described else ():
            if field.type.nested_type_name:
                _define(field.type.nested_type_name, described, texts)
    composed = "---\n".join(_definition(described[part]) for part in parts if part in described)
    try:
        load(texts.get(name, composed), name)
    except InterfaceError:
        if name not in texts:
            raise
        load(composed, name)


def _definition(individual: Any) -> str:
    """The definition of one message, without defaults and constants: descriptions have none."""
    fields = [field for field in individual.fields if field.name != PLACEHOLDER]
    return "".join(f"{_spelled(field.type)} {field.name}\n" for field in fields)


def _spelled(kind: Any) -> str:
    """The type of a field as a definition spells it."""
    array, offset = max(
        ((name, start) for name, start in ARRAY_OFFSETS.items() if start < kind.type_id), key=lambda pair: pair[1]
    )
    number = kind.type_id - offset
    if number == NESTED:
        package, _, name = kind.nested_type_name.split("/")
        element = f"{package}/{name}"
    elif number in _PRIMITIVES:
        element = _PRIMITIVES[number]
    elif number - BOUNDED_STRING in _PRIMITIVES:
        element = f"{_PRIMITIVES[number - BOUNDED_STRING]}<={kind.string_capacity}"
    else:
        raise InterfaceError(f"a description has a field of type id {kind.type_id}, which is not known")
    suffix = {"single": "", "fixed": f"[{kind.capacity}]", "bounded": f"[<={kind.capacity}]", "unbounded": "[]"}[array]
    return element + suffix
