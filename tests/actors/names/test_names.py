"""Names, as a user meets them."""

from __future__ import annotations

import pickle

import pytest

from actors.names import names
from actors.names.names import InvalidName


def test_a_node_in_a_namespace_has_a_full_name_and_a_logger() -> None:
    namespace = names.normalize_namespace("front")
    full = names.fully_qualified(namespace, "lidar")

    assert full == "/front/lidar"
    assert names.logger_name(full) == "front.lidar"
    assert names.child_logger_name("front.lidar", "driver") == "front.lidar.driver"


def test_a_node_in_the_root_has_no_double_slash() -> None:
    assert names.fully_qualified(names.normalize_namespace(""), "lidar") == "/lidar"
    assert names.logger_name("/lidar") == "lidar"


@pytest.mark.parametrize(
    ("typed", "full"),
    [
        ("scan", "/front/scan"),
        ("/scan", "/scan"),
        ("~/scan", "/front/lidar/scan"),
        ("~", "/front/lidar"),
        ("{node}/scan", "/front/lidar/scan"),
        ("{ns}/scan", "/front/scan"),
    ],
)
def test_a_name_is_expanded_for_the_node_that_uses_it(typed: str, full: str) -> None:
    assert names.expand(typed, "lidar", "/front") == full


def test_substitutions_of_the_user_are_expanded_and_cannot_hide_those_of_ros() -> None:
    given = {"side": "left", "node": "somebody_else"}

    assert names.expand("{side}/{node}", "lidar", "/", given) == "/left/lidar"


@pytest.mark.parametrize(
    ("typed", "code", "index"),
    [
        ("1bad", "token_starts_with_number", 0),
        ("a b", "unallowed_characters", 1),
        ("a//b", "repeated_slash", 3),
        ("a-", "unallowed_characters", 1),
        ("~x", "tilde_not_followed_by_slash", 1),
        ("{}", "unknown_substitution", 0),
        ("{side}/scan", "unknown_substitution", 0),
        ("{ns}/scan", "repeated_slash", 1),
        ("x" * 300, "too_long", 246),
    ],
)
def test_a_bad_topic_name_is_refused_with_the_reason(typed: str, code: str, index: int) -> None:
    with pytest.raises(InvalidName) as caught:
        names.expand(typed, "node", "/")

    assert (caught.value.code, caught.value.index) == (code, index)


def test_a_bad_node_name_is_refused_with_the_place_of_the_fault() -> None:
    with pytest.raises(InvalidName, match=r"'motor-ctl!' is not a valid node name: only letters.*at 5: '-'") as caught:
        names.validate_node_name("motor-ctl!")

    assert caught.value.kind == "node name"
    assert caught.value.text == "motor-ctl!"


def test_an_expansion_tells_which_of_its_parts_is_wrong() -> None:
    with pytest.raises(InvalidName) as node:
        names.expand("scan", "bad node", "/")
    with pytest.raises(InvalidName) as namespace:
        names.expand("scan", "node", "relative")

    assert node.value.kind == "node name"
    assert namespace.value.kind == "namespace"


def test_the_longest_names_are_accepted() -> None:
    names.validate_node_name("n" * 255)
    names.validate_namespace("/" + "n" * 244)
    names.validate_full_name("/" + "n" * 246)


@pytest.mark.parametrize(
    ("validate", "text"),
    [
        (names.validate_node_name, "n" * 256),
        (names.validate_namespace, "/" + "n" * 245),
        (names.validate_full_name, "/" + "n" * 247),
    ],
)
def test_one_character_more_is_too_long(validate: object, text: str) -> None:
    assert callable(validate)
    with pytest.raises(InvalidName, match="too long"):
        validate(text)


def test_a_trailing_newline_is_not_overlooked() -> None:
    for validate in (names.validate_node_name, names.validate_name):
        with pytest.raises(InvalidName):
            validate("scan\n")
    with pytest.raises(InvalidName):
        names.validate_full_name("/scan\n")


def test_an_action_stands_for_five_hidden_names() -> None:
    five = names.action_names("/move")

    assert five.send_goal == "/move/_action/send_goal"
    assert five.status == "/move/_action/status"
    assert len(set(five)) == 5
    assert all(names.is_hidden(name) for name in five)


def test_the_event_topic_of_a_service_is_hidden() -> None:
    assert names.service_event_topic("/get_map") == "/get_map/_service_event"
    assert names.is_hidden("/get_map/_service_event")


def test_style_hints_name_the_better_spelling() -> None:
    assert "camera_rgb" in names.lint_name("CameraRGB")[0]
    assert "left_arm_joint_commands" in names.lint_name("arm/commands")[0]
    assert names.lint_name("left_arm_joint_commands") == ()


def test_the_error_survives_the_way_to_another_process() -> None:
    error = InvalidName("namespace", "empty", 0, "")

    assert str(pickle.loads(pickle.dumps(error))) == str(error)


def test_a_child_logger_needs_a_name() -> None:
    with pytest.raises(ValueError, match=r"'front\.lidar' needs a name"):
        names.child_logger_name("front.lidar", "")


@pytest.mark.parametrize("name", ["~/two words", "~/2nd", "~/" + "a" * 256])
def test_a_name_below_a_node_is_checked_as_every_other(name: str) -> None:
    with pytest.raises(InvalidName) as shared:
        names.expand(name, "lidar", "/front")
    with pytest.raises(InvalidName) as own:
        names.expand_for(name, "lidar", "/front")
    assert str(own.value) == str(shared.value)
