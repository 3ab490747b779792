"""Remapping, as a user meets it."""

from __future__ import annotations

import pytest

from actors.names.names import InvalidName
from actors.names.remapping import InvalidRule, Remapping, Rule


def rules(*texts: str) -> list[Rule]:
    return [Rule.parse(text) for text in texts]


def test_a_node_publishes_under_the_new_name() -> None:
    remapping = Remapping(rules("old_topic:=new_topic"))

    assert remapping.resolve_topic("old_topic", "talker", "/") == "/new_topic"
    assert remapping.resolve_topic("other", "talker", "/") == "/other"


def test_an_absolute_name_moves_to_another() -> None:
    remapping = Remapping(rules("/camera/image:=/perception/camera/rgb"))

    assert remapping.resolve_topic("image", "driver", "/camera") == "/perception/camera/rgb"
    assert remapping.resolve_service("image", "driver", "/camera") == "/perception/camera/rgb"


def test_two_instances_live_in_two_namespaces() -> None:
    for side in ("left", "right"):
        remapping = Remapping(rules(f"__ns:=/{side}", "__node:=eye"))
        node, namespace = remapping.identity("camera", "")
        assert remapping.resolve_topic("image", node, namespace) == f"/{side}/image"
        assert remapping.resolve_topic("~/info", node, namespace) == f"/{side}/eye/info"


def test_renaming_comes_first_and_later_rules_see_the_new_name() -> None:
    remapping = Remapping(rules("talker:__ns:=/old", "talker:__node:=speaker", "speaker:__ns:=/new"))

    assert remapping.identity("talker", "/") == ("speaker", "/new")


def test_the_first_matching_rule_wins_and_its_result_is_final() -> None:
    remapping = Remapping(rules("a:=b", "b:=c", "a:=d"))

    assert remapping.resolve_topic("a", "node", "/") == "/b"
    assert remapping.resolve_topic("b", "node", "/") == "/c"


def test_own_rules_come_before_those_of_the_process() -> None:
    remapping = Remapping(rules("a:=mine"), rules("a:=ours", "b:=shared"))

    assert remapping.resolve_topic("a", "node", "/") == "/mine"
    assert remapping.resolve_topic("b", "node", "/") == "/shared"


def test_a_rule_may_be_for_one_node_or_one_kind_of_name() -> None:
    remapping = Remapping(rules("lidar:scan:=points", "rostopic://image:=picture", "rosservice://reset:=restart"))

    assert remapping.resolve_topic("scan", "lidar", "/") == "/points"
    assert remapping.resolve_topic("scan", "sonar", "/") == "/scan"
    assert remapping.resolve_topic("image", "any", "/") == "/picture"
    assert remapping.resolve_service("image", "any", "/") == "/image"
    assert remapping.resolve_topic("reset", "any", "/") == "/reset"
    assert remapping.resolve_service("reset", "any", "/") == "/restart"


def test_matching_is_exact_and_never_by_prefix() -> None:
    remapping = Remapping(rules("scan:=points"))

    assert remapping.resolve_topic("scan/raw", "lidar", "/") == "/scan/raw"
    assert remapping.resolve_topic("/other/scan", "lidar", "/front") == "/other/scan"


def test_an_action_moves_with_its_bare_name() -> None:
    remapping = Remapping(rules("move:=walk"))

    assert remapping.resolve_service("move", "robot", "/spot") == "/spot/walk"
    assert remapping.resolve_service("move/_action/send_goal", "robot", "/spot") == "/spot/walk/_action/send_goal"
    assert remapping.resolve_topic("move/_action/feedback", "robot", "/spot") == "/spot/walk/_action/feedback"
    assert remapping.resolve_topic("move/_action/status", "tool", "/spot") == "/spot/walk/_action/status"


def test_one_name_of_an_action_can_move_alone() -> None:
    remapping = Remapping(rules("move/_action/feedback:=progress", "move:=walk"))

    assert remapping.resolve_topic("move/_action/feedback", "robot", "/") == "/progress"
    assert remapping.resolve_topic("move/_action/status", "robot", "/") == "/walk/_action/status"


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("scan", "write from:=to"),
        ("a:=b:=c", "more than one ':='"),
        (":=b", "one side of ':=' is empty"),
        ("a:=", "one side of ':=' is empty"),
        ("__ns:=relative", "must start with a slash"),
        ("__node:=/abs", "a single word"),
        ("*/scan:=scan", "wildcards"),
        ("{node}/scan:=scan", "wildcards"),
        (r"scan:=\1", "wildcards"),
        ("a__b:=c", "single underscores"),
        ("a b:=c", "each side must be a name"),
        ("scan:=rostopic://points", "only the left side"),
        ("ns/node:scan:=points", "each side must be a name"),
    ],
)
def test_a_wrong_rule_is_refused_with_the_reason(text: str, why: str) -> None:
    with pytest.raises(InvalidRule, match=why) as caught:
        Rule.parse(text)
    assert caught.value.text == text


def test_a_long_wrong_rule_is_refused_at_once() -> None:
    with pytest.raises(InvalidRule):
        Rule.parse("a_" * 20_000 + "!:=b")


@pytest.mark.parametrize(
    "text", ["a:=b", "n:a:=~/b", "__ns:=/x/y", "n:__node:=m", "rostopic://a:=/b", "n:rosservice://~/a:=b/c"]
)
def test_a_rule_is_written_as_it_was_read(text: str) -> None:
    assert str(Rule.parse(text)) == text


def test_a_namespace_rule_that_ends_with_a_slash_fails_when_it_is_used() -> None:
    with pytest.raises(InvalidName, match="not a valid namespace"):
        Remapping(rules("__ns:=/left/")).identity("camera", "/")


def test_the_repr_shows_the_rules() -> None:
    assert repr(Remapping(rules("a:=b"), rules("__ns:=/x"))) == "Remapping(a:=b, __ns:=/x)"
    assert repr(Remapping()) == "Remapping(no rules)"
    assert not Remapping()


def test_a_full_name_without_a_rule_stays() -> None:
    remapping = Remapping(rules("scan:=points"))

    for resolve in (remapping.resolve_topic, remapping.resolve_service):
        assert resolve("/front/scan", "lidar", "/front") == "/front/points"
        assert resolve("/scan", "lidar", "/front") == "/scan"
