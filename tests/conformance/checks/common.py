"""What the check modules share: reading vector files and comparing answers."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

Vector = dict[str, Any]
Case = tuple[str, str, Callable[[], None]]


class Skip(Exception):
    """Raised by a case that cannot be run; its text is the reason."""


def each(path: Path, check: Callable[[Vector], None]) -> Iterator[Case]:
    """The cases of a vector file, all checked by one function that is given the whole case."""
    for vector in json.loads(path.read_text(encoding="utf-8"))["cases"]:
        yield vector["id"], vector.get("tier", "core"), partial(check, vector)


def by_kind(path: Path, checks: dict[str, Callable[[Vector], None]]) -> Iterator[Case]:
    """The cases of a vector file, each checked by the function for its `input.kind`."""

    def check(vector: Vector) -> None:
        kind = vector["input"]["kind"]
        if kind not in checks:
            raise Skip(f"there is no check for cases of kind {kind!r}")
        checks[kind](vector)

    return each(path, check)


def same(what: str, got: object, wanted: object) -> None:
    """Fail unless both are equal, of one type, floats within nothing; NaN equals itself."""
    if isinstance(got, float) and isinstance(wanted, float) and math.isnan(got) and math.isnan(wanted):
        return
    alike = got == wanted and isinstance(got, bool) == isinstance(wanted, bool)
    assert alike, f"{what}: {got!r}, wanted {wanted!r}"


def expected(expect: Vector, **answers: object) -> None:
    """Compare answers with the expectations of the same name; what the case does not mention is not checked."""
    for name, got in answers.items():
        if name in expect:
            same(name, got, expect[name])


def raises(kind: type[BaseException] | tuple[type[BaseException], ...], call: Callable[[], object]) -> BaseException:
    """Fail unless the call raises one of these; the error is handed back."""
    try:
        answer = call()
    except kind as error:
        return error
    raise AssertionError(f"expected an error, got {answer!r}")


def number(value: object) -> object:
    """A float that JSON could not hold, as a float again."""
    return float(value) if value in ("nan", "inf", "-inf") else value  # type: ignore[arg-type]


def typed(value: object) -> Vector:
    """A parameter value as the vectors write it: its type's name and the value."""
    names = {bool: "bool", int: "integer", float: "double", str: "string", bytes: "byte"}
    if value is None or value == ():
        return {"type": "not_set", "value": None}
    if isinstance(value, tuple):
        return {"type": f"{names[type(value[0])]}_array", "value": list(value)}
    return {"type": names[type(value)], "value": value}


def same_typed(what: str, got: object, wanted: Vector) -> None:
    """Fail unless a parameter value is the one that the vector describes, NaN included."""
    answer = typed(got)
    same(f"{what} type", answer["type"], wanted["type"])
    value = wanted["value"]
    if wanted["type"] == "double":
        same(what, answer["value"], float(number(value)))  # type: ignore[arg-type]
    elif wanted["type"] == "double_array":
        for index, (one, other) in enumerate(zip(answer["value"], value, strict=True)):
            same(f"{what}[{index}]", one, float(number(other)))  # type: ignore[arg-type]
    else:
        same(what, answer["value"], value)
