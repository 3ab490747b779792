"""Remapping rules.

Edge: rcl at this version remaps each of the five names of an action on its own. Here they also follow a rule for the
action's bare name; the rules upstream tests use give the same result.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

from actors.names import names
from actors.names.remapping import Remapping, Rule
from tests.conformance.checks.common import Case, Vector, by_kind, expected, same

RULES = ("global_rules", "name", "namespace")
"""What a case may tell though nothing of it is used: rules that are to be ignored, a name where the node's is asked for."""


def remapping(given: Vector) -> Remapping:
    use_global = given.get("use_global_arguments", True)
    return Remapping(
        [Rule.parse(rule) for rule in given["local_rules"] or ()],
        [Rule.parse(rule) for rule in given["global_rules"] or ()] if use_global else (),
    )


def find(vector: Vector) -> None:
    given = vector["input"]
    name, namespace = given.get("name", ""), given.get("namespace", "/")
    found = remapping(given).find(given["kind"], name, given["node"], namespace)
    expected(vector["expect"], result=found)


def attempt(call: Callable[[], str]) -> str | None:
    """A name, or None where it cannot be resolved."""
    try:
        return call()
    except names.InvalidName:
        return None


def create_node_and_resolve(vector: Vector) -> None:
    given, expect = vector["input"], vector["expect"]
    rules = remapping(given)
    node, namespace = rules.identity(given["node"], given["namespace"])
    full = names.fully_qualified(namespace, node)
    expected(
        expect,
        node_name=node,
        namespace=namespace,
        fully_qualified_name=full,
        logger_name=names.logger_name(full),
    )
    for one in expect.get("resolved", ()):
        resolve = rules.resolve_topic if one["kind"] == "topic" else rules.resolve_service
        same(
            f"{one['kind']} {one['name']}",
            attempt(lambda r=resolve, n=one["name"]: r(n, node, namespace)),
            one["result"],
        )


def cases(path: Path) -> Iterable[Case]:
    kinds = ("topic", "service", "node_name", "namespace")
    return by_kind(path, {**dict.fromkeys(kinds, find), "create_node_and_resolve": create_node_and_resolve}, RULES)
