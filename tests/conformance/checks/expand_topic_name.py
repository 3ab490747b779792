"""Expansion of topic and service names.

Edge: upstream lets the two-character form `~x` through and expands it to `/ns/nodex`. It is refused here, as `~xy` is.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from actors.names import names
from tests.conformance.checks.common import Case, Vector, each, expected
from tests.conformance.checks.topic_names import judge

_ERRORS = {"node name": "node_invalid_name", "namespace": "node_invalid_namespace"}


def check(vector: Vector) -> None:
    given, expect = vector["input"], vector["expect"]
    try:
        result = names.expand_only(given["name"], given["node"], given["namespace"], given.get("substitutions"))
    except names.InvalidName as error:
        code = "unknown_substitution" if error.code == "unknown_substitution" else "topic_name_invalid"
        expected(expect, ok=False, result=None, error=_ERRORS.get(error.kind, code))
        return
    valid = judge(names.validate_full_name, result)["valid"]
    expected(expect, ok=True, result=result, error=None, result_is_valid_full_name=valid)
    if valid:
        expanded = names.expand(given["name"], given["node"], given["namespace"], given.get("substitutions"))
        expected(expect, result=expanded)


def cases(path: Path) -> Iterable[Case]:
    return each(path, check)
