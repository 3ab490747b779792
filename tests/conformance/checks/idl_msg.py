"""The grammar of .msg, .srv and .action files."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from actors.interfaces.naming import is_constant_name, is_field_name, is_interface_name, is_package_name
from actors.interfaces.parse import DefinitionError, MessageDefinition, parse, parse_type, parse_value
from tests.conformance.checks.common import Case, Vector, by_kind, expected, number, raises, same

PARTS = {"msg": ("",), "srv": ("request", "response"), "action": ("goal", "result", "feedback")}
NAMES: dict[str, Callable[[str], bool]] = {
    "package": is_package_name,
    "field": is_field_name,
    "message": is_interface_name,
    "service": is_interface_name,
    "action": is_interface_name,
    "constant": is_constant_name,
}


def cases(path: Path) -> Iterator[Case]:
    checks: dict[str, Callable[[Vector], None]] = {"msg": definition, "srv": definition, "action": definition}
    return by_kind(path, checks | {"type": type_text, "value": value, "name": name})


def _refused(expect: Vector, call: Callable[[], object]) -> None:
    error = raises(DefinitionError, call)
    assert isinstance(error, DefinitionError)
    if expect["error"] != "any":
        same("error", error.code, expect["error"])


def definition(vector: Vector) -> None:
    given, expect = vector["input"], vector["expect"]

    def read() -> tuple[MessageDefinition, ...]:
        return parse(given["definition"], given["package"], given["name"], given["kind"]).parts

    if not expect["ok"]:
        _refused(expect, read)
        return
    for part, wanted in zip(read(), PARTS[given["kind"]], strict=True):
        _part(part, expect.get(wanted, {}) if wanted else expect)


def _part(part: MessageDefinition, expect: Vector) -> None:
    if "comment" in expect:
        same("comment", list(part.comment), expect["comment"])
    fields = expect.get("fields", ())
    for got, wanted in zip(part.fields, fields, strict="fields" in expect):
        same("name", got.name, wanted["name"])
        same("type", str(got.type), wanted["type"])
        if "default" in wanted:
            same("default", _plain(got.default), number(wanted["default"]))
        _remarks(got.comment, got.unit, wanted)
    constants = expect.get("constants", ())
    for constant, wanted in zip(part.constants, constants, strict="constants" in expect):
        same("name", constant.name, wanted["name"])
        same("type", str(constant.type), wanted["type"])
        same("value", constant.value, number(wanted["value"]))
        _remarks(constant.comment, constant.unit, wanted)


def _remarks(comment: tuple[str, ...], unit: str | None, wanted: Vector) -> None:
    if "comment" in wanted:
        same("comment", list(comment), wanted["comment"])
    if "unit" in wanted:
        same("unit", unit, wanted["unit"])


def _plain(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value


def type_text(vector: Vector) -> None:
    given, expect = vector["input"], vector["expect"]
    if not expect["ok"]:
        _refused(expect, lambda: parse_type(given["text"], given["context_package"]))
        return
    kind = parse_type(given["text"], given["context_package"])
    package, _, base = kind.base.rpartition("/msg/")
    size, bound = kind.size or None, kind.string_bound or None
    expected(expect, base=base, package=package or None, string_bound=bound, array=kind.array, array_size=size)


def value(vector: Vector) -> None:
    given, expect = vector["input"], vector["expect"]

    def read() -> Any:
        return parse_value(parse_type(given["type"], "pkg"), given["text"])

    if not expect["ok"]:
        _refused(expect, read)
    else:
        same("value", _plain(read()), number(expect["value"]))


def name(vector: Vector) -> None:
    given = vector["input"]
    same("valid", NAMES[given["of"]](given["text"]), vector["expect"]["valid"])
