"""Node names, fully qualified names and logger names."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from actors import names
from tests.conformance.checks.common import Case, Vector, by_kind, expected, raises, refused, same
from tests.conformance.checks.topic_names import judge


def name(vector: Vector) -> None:
    expected(vector["expect"], **judge(names.validate_node_name, vector["input"]["name"]))


def fully_qualified(vector: Vector) -> None:
    namespace = names.normalize_namespace(vector["input"]["namespace"])
    full = names.fully_qualified(namespace, vector["input"]["name"])
    expected(vector["expect"], namespace=namespace, fully_qualified_name=full, logger_name=names.logger_name(full))
    same("split", names.split_fully_qualified(full), (namespace, vector["input"]["name"]))


def child_logger(vector: Vector) -> None:
    given, expect = vector["input"], vector["expect"]
    parent = given.get("logger", given.get("parent"))
    if parent is None:
        parent = names.logger_name(names.fully_qualified(given.get("namespace", "/"), given["name"]))
    child = given.get("child", given.get("child_name"))
    if expect.get("ok") is False:
        raises(
            refused(expect.get("error", "any"), {"value_error": ValueError}),
            lambda: names.child_logger_name(parent, child),
        )
        return
    expect.get("ok")
    got = names.child_logger_name(parent, child)
    expected(expect, **dict.fromkeys(("name", "logger_name", "child", "child_name", "result"), got))


def cases(path: Path) -> Iterable[Case]:
    return by_kind(path, {"name": name, "fully_qualified": fully_qualified, "child_logger": child_logger})
