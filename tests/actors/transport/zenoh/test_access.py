"""The rules of a security file as keys of Zenoh: which messages they let pass. Zenoh's own `KeyExpr.includes` judges."""

from __future__ import annotations

import json
from typing import Any

import pytest
import zenoh
from hypothesis import given
from hypothesis import strategies as st

from actors.qos import DEFAULT
from actors.transport.format.keys import DataKey, write_key
from actors.transport.format.tokens import EndpointKind, EndpointToken, NodeToken, write_token
from actors.transport.security import AccessRule
from actors.transport.zenoh.access import access_control

TYPE = "std_msgs/msg/String"
PARTS = st.sampled_from(["a", "b", "arm"])
NAMES = st.lists(PARTS, min_size=1, max_size=4).map(lambda parts: "/" + "/".join(parts))
PATTERNS = st.lists(st.one_of(PARTS, st.sampled_from(["*", "**"])), min_size=1, max_size=4).map(
    lambda parts: "/" + "/".join(parts)
)


def allowed(rule: AccessRule, message: str, flow: str, key: str) -> bool:
    """Whether Zenoh would let it pass: as it does, a rule has to include the whole key."""
    rules: Any = access_control([rule])["rules"]
    return any(
        zenoh.KeyExpr(pattern).includes(zenoh.KeyExpr(key))
        for one in rules
        if message in one["messages"] and flow in one["flows"]
        for pattern in one["key_exprs"]
    )


def matches(pattern: list[str], name: list[str]) -> bool:
    """The meaning of ``*`` and ``**``, spelled out."""
    if not pattern:
        return not name
    if pattern[0] == "**":
        return matches(pattern[1:], name) or (bool(name) and matches(pattern, name[1:]))
    return bool(name) and pattern[0] in ("*", name[0]) and matches(pattern[1:], name[1:])


def key(name: str) -> str:
    return write_key(DataKey(7, name, TYPE, "RIHS01_00"))


def token(name: str, node: str = "/a", kind: EndpointKind = EndpointKind.PUBLISHER) -> str:
    namespace, _, last = node.rpartition("/")
    return write_token(
        EndpointToken(NodeToken(7, "ab", 0, last, namespace or "/"), 1, kind, name, TYPE, "RIHS01_00", DEFAULT)
    )


@given(PATTERNS, NAMES)
def test_exactly_the_names_that_match_may_be_published(pattern: str, name: str) -> None:
    rule = AccessRule(peers=("desk",), publish=(pattern,))
    expected = matches(pattern.split("/")[1:], name.split("/")[1:])
    assert allowed(rule, "put", "ingress", key(name)) is expected
    assert allowed(rule, "declare_subscriber", "egress", key(name)) is expected
    assert not allowed(rule, "put", "egress", key(name))
    if expected:
        assert allowed(rule, "liveliness_token", "ingress", token(name)), "what may be published may be shown"


@given(PATTERNS, NAMES)
def test_nodes_that_match_may_be_shown_and_no_name_without_wildcard_lets_another_in(pattern: str, node: str) -> None:
    rule = AccessRule(peers=("desk",), nodes=(pattern,), publish=("/x",))
    shown = token("/x", node)
    if matches(pattern.split("/")[1:], node.split("/")[1:]):
        assert allowed(rule, "liveliness_token", "ingress", shown)
    elif "*" not in pattern:
        assert not allowed(rule, "liveliness_token", "ingress", shown)


@pytest.mark.parametrize(
    ("direction", "message", "flow"),
    [
        ("publish", "put", "ingress"),
        ("subscribe", "put", "egress"),
        ("subscribe", "declare_subscriber", "ingress"),
        ("serve", "declare_queryable", "ingress"),
        ("serve", "query", "egress"),
        ("call", "query", "ingress"),
        ("call", "reply", "egress"),
    ],
)
def test_a_direction_allows_its_own_messages_and_no_other_direction_does(
    direction: str, message: str, flow: str
) -> None:
    rules = {one: AccessRule(peers=("desk",), **{one: ("/a",)}) for one in ("publish", "subscribe", "serve", "call")}
    lets_pass = {one for one, rule in rules.items() if allowed(rule, message, flow, key("/a"))}
    both_reply = {"subscribe"} if (message, flow) == ("reply", "egress") else set()
    assert lets_pass == {direction} | both_reply, "what is kept for a subscription is sent as a reply, too"


@pytest.mark.parametrize(
    ("kind", "direction"), [("MP", "publish"), ("MS", "subscribe"), ("SS", "serve"), ("SC", "call")]
)
def test_only_endpoints_of_the_allowed_direction_may_be_shown(kind: str, direction: str) -> None:
    for one in ("publish", "subscribe", "serve", "call"):
        rule = AccessRule(peers=("desk",), **{one: ("/a",)})
        assert allowed(rule, "liveliness_token", "ingress", token("/a", kind=EndpointKind(kind))) is (one == direction)


@pytest.mark.parametrize(("direction", "sent"), [("serve", "ingress"), ("call", "egress")])
def test_an_action_is_served_and_called_with_all_its_parts(direction: str, sent: str) -> None:
    rule = AccessRule(peers=("desk",), **{direction: ("/go",)})
    asked = "egress" if sent == "ingress" else "ingress"
    for service in ("send_goal", "cancel_goal", "get_result"):
        assert allowed(rule, "query", asked, key(f"/go/_action/{service}"))
        assert allowed(rule, "reply", sent, key(f"/go/_action/{service}"))
    for topic in ("feedback", "status"):
        assert allowed(rule, "put", sent, key(f"/go/_action/{topic}"))
        assert not allowed(rule, "put", asked, key(f"/go/_action/{topic}"))


def test_history_and_large_messages_belong_to_their_topic() -> None:
    rule = AccessRule(peers=("desk",), publish=("/a",))
    below = f"{key('/a')}/@adv/pub/ab/1"
    assert allowed(rule, "liveliness_token", "ingress", f"{below}/_")
    assert allowed(rule, "query", "egress", f"{below}/**")
    assert allowed(rule, "put", "ingress", f"{key('/a')}/_buf_cpu")
    assert not allowed(rule, "query", "ingress", f"{below}/**")
    assert not allowed(rule, "liveliness_token", "ingress", f"{key('/b')}/@adv/pub/ab/1/_")


@pytest.mark.parametrize("hostile", ["**", "7/**", "*/cmd/*/*", "7/a$*/T/H"])
def test_a_key_that_is_wider_than_the_rule_does_not_pass(hostile: str) -> None:
    assert not allowed(AccessRule(peers=("desk",), publish=("/a", "/b/**")), "put", "ingress", hostile)


def test_the_peers_are_known_by_their_certificates_and_a_star_is_everybody() -> None:
    rules = [AccessRule(peers=("desk", "lab"), call=("/a",)), AccessRule(peers=("*",), call=("/b",))]
    found: Any = access_control(rules)
    assert found["default_permission"] == "deny"
    assert found["subjects"] == [{"id": "rule 0", "cert_common_names": ["desk", "lab"]}, {"id": "rule 1"}]
    assert [policy["subjects"] for policy in found["policies"]] == [["rule 0"], ["rule 1"]]
    names = [one["id"] for one in found["rules"]]
    assert sorted(names) == sorted(name for policy in found["policies"] for name in policy["rules"])
    assert len(set(names)) == len(names)


@given(st.lists(PATTERNS, min_size=1, max_size=3), st.lists(PATTERNS, min_size=1, max_size=3))
def test_zenoh_takes_every_rule(names: list[str], nodes: list[str]) -> None:
    rule = AccessRule(
        peers=("desk",), nodes=tuple(nodes), **dict.fromkeys(("publish", "subscribe", "serve", "call"), tuple(names))
    )
    config = zenoh.Config()
    config.insert_json5("access_control", json.dumps(access_control([rule])))
    for one in access_control([rule])["rules"]:  # type: ignore[attr-defined]
        for pattern in one["key_exprs"]:
            assert str(zenoh.KeyExpr(pattern)) == pattern
