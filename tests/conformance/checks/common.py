"""What the check modules share: reading vector files and comparing answers."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Collection, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

Vector = dict[str, Any]
Case = tuple[str, str, Callable[[], None]]


class Skip(Exception):
    """Raised by a case that cannot be run by design; its text is the reason."""


class Unsupported(AssertionError):
    """A case holds a kind, step or field that its check knows nothing about: a failure, never a pass in silence."""


_DESCRIPTIVE = frozenset({"id", "source", "tier", "note"})
"""The fields of a case, or of a part of it, that describe it and ask for nothing."""


class Watched(dict[str, Any]):
    """An object of a vector file that notes which of its fields have been read, those of the objects in it as well."""

    def __init__(self, given: dict[str, Any]) -> None:
        super().__init__({key: watched(value) for key, value in given.items()})
        self.read: set[str] = set()

    def __getitem__(self, key: str) -> Any:
        self.read.add(key)
        return super().__getitem__(key)

    def get(self, key: str, default: Any = None) -> Any:
        self.read.add(key)
        return super().get(key, default)

    def __iter__(self) -> Iterator[str]:
        self.read.update(super().keys())
        return super().__iter__()

    def keys(self) -> Any:
        self.read.update(super().keys())
        return super().keys()

    def values(self) -> Any:
        self.read.update(super().keys())
        return super().values()

    def items(self) -> Any:
        self.read.update(super().keys())
        return super().items()

    def __eq__(self, other: object) -> bool:
        self.read_all()
        return super().__eq__(other)

    __hash__ = None  # type: ignore[assignment]

    def read_all(self) -> None:
        """Count this object and those in it as read: it is compared as a whole."""
        self.read.update(super().keys())
        for item in super().values():
            _read_all(item)

    def unread(self, path: str = "") -> Iterator[str]:
        """Where the fields are that nobody has read; of one that has not been read, not what is in it."""
        for key, value in super().items():
            if key not in self.read:
                yield f"{path}{key}"
            else:
                yield from _unread(value, f"{path}{key}")


def _unread(value: Any, path: str) -> Iterator[str]:
    if isinstance(value, Watched):
        yield from value.unread(f"{path}.")
    elif isinstance(value, list):
        for index, item in enumerate(value):
            yield from _unread(item, f"{path}[{index}]")


def _read_all(value: Any) -> None:
    if isinstance(value, Watched):
        value.read_all()
    elif isinstance(value, list):
        for item in value:
            _read_all(item)


def watched(value: Any) -> Any:
    """Plain data, its objects turned into `Watched` ones."""
    if isinstance(value, dict):
        return Watched(value)
    return [watched(item) for item in value] if isinstance(value, list) else value


def meet(check: Callable[[Vector], None], vector: Vector, optional: Collection[str] = ()) -> None:
    """Run one case, and fail if it asks for something that its check has not even looked at.

    `optional` names the fields that the check knows and has no need of in every case.
    """
    given = Watched(vector)
    check(given)
    missed = [field for field in given.unread() if field.rpartition(".")[2] not in {*_DESCRIPTIVE, *optional}]
    if missed:
        raise Unsupported(f"unsupported field {', '.join(missed)}: its check does not look at it")


def each(path: Path, check: Callable[[Vector], None], optional: Collection[str] = ()) -> Iterator[Case]:
    """The cases of a vector file, all checked by one function that is given the whole case."""
    for vector in json.loads(path.read_text(encoding="utf-8"))["cases"]:
        yield vector["id"], vector.get("tier", "core"), partial(meet, check, vector, optional)


def by_kind(
    path: Path, checks: Mapping[Any, Callable[[Vector], None]], optional: Collection[str] = ()
) -> Iterator[Case]:
    """The cases of a vector file, each checked by the function for its `input.kind`; None is the variant without a kind."""

    def check(vector: Vector) -> None:
        kind = vector["input"].get("kind")
        if kind not in checks:
            raise Unsupported(f"unsupported kind {kind!r}: known are {', '.join(map(str, checks))}")
        checks[kind](vector)

    return each(path, check, optional)


def steps_of(vector: Vector) -> list[Any]:
    """The steps of a scripted case, wherever it holds them."""
    if "steps" in vector:
        return list(vector["steps"])
    return list(vector["input"].get("steps", ()))


def refused(error: str, kinds: dict[str, type[Exception]]) -> type[Exception]:
    """The class that answers to a code of the vectors; `any` is any error."""
    if error == "any":
        return Exception
    if error not in kinds:
        raise Unsupported(f"unsupported error code {error!r}: known are {', '.join(sorted(kinds))}")
    return kinds[error]


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


def number(value: Any) -> Any:
    """Floats that JSON could not hold, as floats again, in lists as well."""
    if isinstance(value, list):
        return [number(item) for item in value]
    return float(value) if isinstance(value, str) and value in ("nan", "inf", "-inf") else value


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
