"""Namespaces: what is valid, and what a node's constructor makes of what it is given."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from actors.names import names
from tests.conformance.checks.common import Case, Vector, by_kind, expected, same
from tests.conformance.checks.topic_names import judge


def validate(vector: Vector) -> None:
    expected(vector["expect"], **judge(names.validate_namespace, vector["input"]["namespace"]))


def node_constructor(vector: Vector) -> None:
    try:
        namespace = names.normalize_namespace(vector["input"]["namespace"])
    except names.InvalidName as error:
        same("kind of name", error.kind, "namespace")
        expected(vector["expect"], valid=False, error="invalid_namespace")
    else:
        expected(vector["expect"], valid=True, namespace=namespace)


def cases(path: Path) -> Iterable[Case]:
    return by_kind(path, {"validate": validate, "node_constructor": node_constructor})
