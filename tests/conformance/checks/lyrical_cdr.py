"""Bytes measured on ROS 2 Lyrical with Cyclone DDS, of default and of populated messages."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from actors.interfaces import decode, encode, get_message
from tests.conformance.checks.common import Case, Vector, each, same
from tests.conformance.checks.definitions import build, load_definitions

WSTRINGS = {"cdr": "cyclone", "cdr_with_tail": "cyclone", "cdr_zenoh": "zenoh"}
"""How each expectation writes wide strings; elsewhere the forms are the same."""


def cases(path: Path) -> Iterator[Case]:
    load_definitions(path)
    return each(path, check)


def check(vector: Vector) -> None:
    given, expect = vector["input"], vector["expect"]
    cls = get_message(given["type"])
    message = build(cls, given["value"])
    same("fields", [field.name for field in cls.__ros_fields__], list(given["fields"]))
    if given["kind"] == "default":
        same("default message", cls(), message)
    for name in expect:
        wstrings = WSTRINGS[name]
        if name != "cdr_with_tail":
            same(name, encode(message, wstrings=wstrings).hex(), expect[name])  # type: ignore[arg-type]
        same(f"{name} decoded", decode(cls, bytes.fromhex(expect[name]), wstrings=wstrings), message)  # type: ignore[arg-type]
