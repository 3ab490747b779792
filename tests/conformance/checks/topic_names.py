"""Topic and service names: what is valid, what is hidden, what is derived."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

from actors.names import names
from tests.conformance.checks.common import Case, Vector, by_kind, expected, same


def judge(validate: Callable[[str], None], name: str) -> Vector:
    """The verdict of a validator in the words of the vectors."""
    try:
        validate(name)
    except names.InvalidName as error:
        return {"valid": False, "error": error.code, "invalid_index": error.index}
    return {"valid": True, "error": None, "invalid_index": None}


def full_name(vector: Vector) -> None:
    expected(vector["expect"], **judge(names.validate_full_name, vector["input"]["name"]))


def user_name(vector: Vector) -> None:
    expected(vector["expect"], **judge(names.validate_name, vector["input"]["name"]))


def hidden(vector: Vector) -> None:
    expected(vector["expect"], hidden=names.is_hidden(vector["input"]["name"]))


def full_of(given: Vector) -> str:
    """The full name that a case means: expanded when it names a node."""
    if "node" not in given:
        return str(given["name"])
    return names.expand(given["name"], given["node"], names.normalize_namespace(given["namespace"]))


def action_names(vector: Vector) -> None:
    derived = names.action_names(full_of(vector["input"]))
    topics = {"status": derived.status, "feedback": derived.feedback}
    services = {"send_goal": derived.send_goal, "cancel_goal": derived.cancel_goal, "get_result": derived.get_result}
    expect = vector["expect"]
    for kind, named in (("topics", topics), ("services", services)):
        if kind in expect:
            same(kind, set(named.values()), set(expect[kind]))
    expected(expect, **topics, **services)


def service_event_topic(vector: Vector) -> None:
    given = vector["input"]
    topic = names.service_event_topic(full_of({**given, "name": given.get("name", given.get("service"))}))
    for key, wanted in vector["expect"].items():
        same(key, names.is_hidden(topic) if key == "hidden" else topic, wanted)


def cases(path: Path) -> Iterable[Case]:
    checks = {
        "full_name": full_name,
        "name": user_name,
        "hidden": hidden,
        "action_names": action_names,
        "service_event_topic": service_event_topic,
    }
    return by_kind(path, checks)
