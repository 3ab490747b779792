"""Node names, fully qualified names and logger names."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from actors.names import names
from tests.conformance.checks.common import Case, Vector, by_kind, expected, raises, refused, same
from tests.conformance.checks.topic_names import judge


def name(vector: Vector) -> None:
    expected(vector["expect"], **judge(names.validate_node_name, vector["input"]["name"]))


def fully_qualified(vector: Vector) -> None:
    namespace = names.normalize_namespace(vector["input"]["namespace"])
    full = names.fully_qualified(namespace, vector["input"]["name"])
    expected(vector["expect"], namespace=namespace, fully_qualified_name=full, logger_name=names.logger_name(full))


def child_logger(vector: Vector) -> None:
    given, expect = vector["input"], vector["expect"]
    parent = _first(given, "logger", "parent", "parent_name", "logger_name")
    if parent is None:
        parent = names.logger_name(names.fully_qualified(given.get("namespace", "/"), given["name"]))
    child = _first(given, "child", "child_name", "suffix")
    if expect.get("ok") is False or expect.get("error") is not None:
        code = expect.get("error", "any")
        raises(refused(code, {"value_error": ValueError}), lambda: names.child_logger_name(parent, child))
        return
    got = names.child_logger_name(parent, child)
    for key, wanted in expect.items():
        if key not in ("ok", "error"):
            same(key, got, wanted)


def _first(given: Vector, *keys: str) -> Any:
    """What is given under one of these names."""
    return next((given[key] for key in keys if key in given), None)


def cases(path: Path) -> Iterable[Case]:
    return by_kind(path, {"name": name, "fully_qualified": fully_qualified, "child_logger": child_logger})
