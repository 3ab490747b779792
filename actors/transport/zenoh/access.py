"""The rules of a security file as Zenoh's access control.

Zenoh judges each message on each link, by the certificate of the process at the other end. So a rule about a process is kept by all others:
what it may publish is let in from there, and what it may subscribe to is let out to there. Everything that no rule allows is dropped.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import product
from typing import Final, NamedTuple

from actors.transport.security import AccessRule
from actors.transport.security.settings import EVERYBODY

_SERVICES: Final = ("send_goal", "cancel_goal", "get_result")
_TOPICS: Final = ("feedback", "status")
"""The parts of an action; see `actors.names.names.action_names`."""

_SENT: Final = ("put", "delete", "reply")
"""What is kept is sent as a reply on the key of the topic, to a question on a key below it."""
_HISTORY_KEPT: Final = ("put", "delete", "reply", "declare_queryable", "liveliness_token")
_HISTORY_WANTED: Final = (
    "declare_subscriber",
    "query",
    "declare_liveliness_subscriber",
    "liveliness_query",
    "liveliness_token",
)
_SERVED: Final = ("declare_queryable", "reply")
_WATCHED: Final = ("declare_liveliness_subscriber", "liveliness_query")

_GRAPH: Final = ("@ros2_lv/**",)
"""The tokens of ROS 2."""
_PROCESSES: Final = ("@robactor/*/*/*/*",)
_TOLD: Final = ("@robactor/*/alive", "*/_robactor/**")
"""The tokens of processes of this library, and the keys by which they tell of themselves."""

_WAITS: Final = ("@robactor/*/*/waits",)
_ASKED: Final = ("declare_queryable", "query", "reply")
"""The questions by which they find cycles of calls, see `actors.transport.cycles`."""


class _Grant(NamedTuple):
    """Kinds of messages on keys, allowed from the other process (in) or to it (out)."""

    into: tuple[str, ...]
    out: tuple[str, ...]
    keys: tuple[str, ...]

    @property
    def turned(self) -> _Grant:
        """The same for the other end of the same keys."""
        return _Grant(self.out, self.into, self.keys)


def access_control(rules: Iterable[AccessRule]) -> dict[str, object]:
    """The value of ``access_control`` in Zenoh's configuration."""
    allowed: list[dict[str, object]] = []
    subjects: list[dict[str, object]] = []
    policies: list[dict[str, object]] = []
    for number, rule in enumerate(rules):
        subject: dict[str, object] = {"id": f"rule {number}"}
        if EVERYBODY not in rule.peers:
            subject["cert_common_names"] = list(rule.peers)
        subjects.append(subject)
        ids: list[str] = []
        for grant in _grants(rule):
            for flow, messages in (("ingress", grant.into), ("egress", grant.out)):
                if messages and grant.keys:
                    ids.append(f"{number}.{len(ids)}")
                    one: dict[str, object] = {"id": ids[-1], "permission": "allow", "flows": [flow]}
                    allowed.append({**one, "messages": list(messages), "key_exprs": sorted(set(grant.keys))})
        policies.append({"rules": ids, "subjects": [subject["id"]]})
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": allowed,
        "subjects": subjects,
        "policies": policies,
    }


def _grants(rule: AccessRule) -> Iterator[_Grant]:
    yield from _publishing(rule.publish)
    yield from (grant.turned for grant in _publishing(rule.subscribe))
    yield from _serving(rule.serve)
    yield from (grant.turned for grant in _serving(rule.call))
    yield _Grant(("liveliness_token",), (), tuple(_tokens(rule)))
    yield _Grant(_WATCHED, (*_WATCHED, "liveliness_token"), _GRAPH)
    for kinds, keys in ((("liveliness_token", *_WATCHED), _PROCESSES), (("put", "declare_subscriber"), _TOLD)):
        yield _Grant(kinds, kinds, keys)
    yield _Grant(_ASKED, _ASKED, _WAITS)


def _publishing(names: Iterable[str]) -> Iterator[_Grant]:
    data = tuple(_data_key(name) for name in names)
    yield _Grant(_SENT, ("declare_subscriber",), (*data, *_below(data, "_buf_cpu"), *_below(data, "_buf/*")))
    yield _Grant(_HISTORY_KEPT, _HISTORY_WANTED, _below(data, "@adv/**"))


def _serving(names: Iterable[str]) -> Iterator[_Grant]:
    names = tuple(names)
    yield _Grant(_SERVED, ("query",), tuple(map(_data_key, (*names, *_parts_of_actions(names, _SERVICES)))))
    yield from _publishing(_parts_of_actions(names, _TOPICS))


def _parts_of_actions(names: Iterable[str], parts: Iterable[str]) -> tuple[str, ...]:
    return tuple(f"{name}/_action/{part}" for name in names for part in parts)


def _data_key(name: str) -> str:
    """Any domain, the name, any type."""
    return _canonical(f"*{name}/*/*")


def _below(keys: Iterable[str], end: str) -> tuple[str, ...]:
    return tuple(f"{key}/{end}" for key in keys)


def _tokens(rule: AccessRule) -> Iterator[str]:
    for space, node in dict.fromkeys(place for pattern in rule.nodes for place in _places(pattern)):
        yield f"@ros2_lv/*/*/*/*/NN/*/{space}/{node}"
        for kind, names in _things(rule):
            for chunk in dict.fromkeys(chunk for name in names for chunk in _chunks(name) if chunk):
                yield f"@ros2_lv/*/*/*/*/{kind}/*/{space}/{node}/{chunk}/**"


def _places(node: str) -> Iterator[tuple[str, str]]:
    """The namespaces and names of the nodes that a pattern matches, each as one chunk of a token."""
    node = _canonical(node)
    start = node.removesuffix("/**")
    for one in (node,) if start == node else (start, f"{start}/*", f"{start}/**/*"):
        namespace, slash, name = one.rpartition("/")
        if slash:
            yield from ((space or "%", name) for space in _chunks(namespace))


def _things(rule: AccessRule) -> Iterator[tuple[str, tuple[str, ...]]]:
    """What it may show endpoints of, by their kind."""
    topics = _parts_of_actions(rule.serve, _TOPICS), _parts_of_actions(rule.call, _TOPICS)
    yield "MP", (*rule.publish, *topics[0])
    yield "MS", (*rule.subscribe, *topics[1])
    yield "SS", (*rule.serve, *_parts_of_actions(rule.serve, _SERVICES))
    yield "SC", (*rule.call, *_parts_of_actions(rule.call, _SERVICES))


def _chunks(name: str) -> list[str]:
    """A name as one chunk of a token; empty for the root. A wildcard in it spans any number of parts, since a chunk has none."""
    choices = [("", "%$*") if part == "**" else (f"%{'$*' if part == '*' else part}",) for part in name.split("/")[1:]]
    return list(map("".join, product(*choices)))


def _canonical(key: str) -> str:
    """As Zenoh wants a key expression: ``*`` before ``**``, and ``**`` only once."""
    parts: list[str] = []
    for part in key.split("/"):
        if part == "*" and "**" in parts[-1:]:
            parts.insert(-1, part)
        elif part != "**" or "**" not in parts[-1:]:
            parts.append(part)
    return "/".join(parts)
