"""The fields of a client's request, checked as they are taken out. All of this raises `BadRequest`."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, TypeVar, cast

from cli.web.clients.errors import BadRequest

T = TypeVar("T")

MOST = 2**53
"""Beyond that a number of JavaScript is not exact, and one of JSON may be infinite."""


def text(request: dict[str, Any], key: str, default: str | None = None) -> str:
    """A text, or the default where there is none."""
    value = request.get(key, default)
    if not isinstance(value, str):
        raise BadRequest(f"{_what(request)}: {key!r} must be a text, not {value!r:.60}")
    return value


def number(request: dict[str, Any], key: str) -> int:
    """A whole number from 0 to 2^32 - 1."""
    value = request.get(key)
    if type(value) is not int or not 0 <= value < 2**32:
        raise BadRequest(f"{_what(request)}: {key!r} must be a whole number of 32 bits, not {value!r:.60}")
    return value


def optional_number(request: dict[str, Any], key: str, default: float = 0.0) -> float:
    """A number from 0 to 2^53, or the default where there is none."""
    value: Any = request.get(key)
    if value is None:
        return default
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not 0 <= value <= MOST:
        raise BadRequest(f"{_what(request)}: {key!r} must be a number from 0 to 2^53, not {value!r:.60}")
    return float(value)


def flag(request: dict[str, Any], key: str) -> bool:
    """Whether something is said to be so; false where nothing is said."""
    value = request.get(key)
    if value is not None and not isinstance(value, bool):
        raise BadRequest(f"{_what(request)}: {key!r} must be true or false, not {value!r:.60}")
    return bool(value)


def entries(request: dict[str, Any], key: str, kind: type[T]) -> list[T]:
    """A list of things of one kind."""
    value = request.get(key)
    if not isinstance(value, list) or not all(type(item) is kind for item in cast("Iterable[Any]", value)):
        raise BadRequest(f"{_what(request)}: {key!r} must be a list of {kind.__name__}, not {value!r:.60}")
    return cast("list[T]", value)


def objects(request: dict[str, Any], key: str) -> list[dict[str, Any]]:
    """A list of objects."""
    found: list[dict[str, Any]] = entries(request, key, dict)
    return found


def by_name(fields: Iterable[str], arguments: Any) -> dict[str, Any]:
    """The arguments of a request, which are an object or a list in the order of the fields."""
    if arguments is None:
        return {}
    if isinstance(arguments, list):
        return dict(zip(fields, cast("Iterable[Any]", arguments), strict=False))
    if isinstance(arguments, dict):
        return cast("dict[str, Any]", arguments)
    raise BadRequest(f"arguments are an object or a list, not {arguments!r:.60}")


def _what(request: dict[str, Any]) -> str:
    op = request.get("op")
    return op if isinstance(op, str) and len(op) < 60 else "request"
