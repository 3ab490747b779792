"""Names as a real ROS 2 judged, expanded and resolved them.

Edge: a NUL in a name ends it upstream, because it becomes a C string; here it is an unallowed character. `~x` is
refused.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

from actors.names import names
from tests.conformance.checks.common import Case, Vector, each, same
from tests.conformance.checks.topic_names import judge

_VALIDATORS: dict[str, Callable[[str], None]] = {
    "topic": names.validate_name,
    "service": names.validate_name,
    "full_topic": names.validate_full_name,
    "full_service": names.validate_full_name,
    "namespace": names.validate_namespace,
    "node": names.validate_node_name,
}


def attempt(call: Callable[[], str]) -> str | None:
    try:
        return call()
    except names.InvalidName:
        return None


def check(vector: Vector) -> None:
    name, expect = vector["input"]["name"], vector["expect"]
    for kind, wanted in expect.get("valid", {}).items():
        same(f"valid as {kind}", judge(_VALIDATORS[kind], name)["valid"], wanted)
    for place, wanted in expect.get("expand", {}).items():
        node, namespace = place.split("@")
        same(f"expand {place}", attempt(lambda n=node, s=namespace: names.expand_only(name, n, s)), wanted)
    for namespace, wanted in expect.get("resolve_topic", {}).items():
        same(f"resolve in {namespace}", attempt(lambda s=namespace: names.expand(name, "nd", s)), wanted)


def cases(path: Path) -> Iterable[Case]:
    return each(path, check)
