"""Values as YAML: what is written is read again as the same value of the same type, by the rules of ROS 2."""

from __future__ import annotations

from typing import Any

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from actors.parameters.files import InvalidParams, ParameterOverrides, parse_value
from actors.parameters.ros_yaml import dump_yaml, load_yaml

TEXTS = ["y", "n", "Y", "off", "yes", "true", "1e3", "123E5", "0483", "08", "inf", "-inf", "nan", ".nan", "Infinity"]
TEXTS += [
    "0x1p3",
    "0x10",
    "12:30",
    "2001-01-01",
    "1_000",
    "0b11",
    "~",
    "null",
    "",
    " a",
    "a: b",
    "#",
    "- x",
    "line 1\nline 2\n",
]
TEXTS += ["[1, 2]", "'3'", '"4"', "!!int 5", "*a", "&b", "\t", "ä\u2028ö", "<<", "=", "a\\d"]


def read_as_parameters(text: str) -> dict[str, Any]:
    return ParameterOverrides().with_text(text).for_node("/a")


@pytest.mark.parametrize("text", TEXTS)
def test_a_text_stays_a_text(text: str) -> None:
    values = {"one": text, "several": (text, text), "group": {"inner": text}}
    written = dump_yaml({"/**": {"ros__parameters": values}})
    assert read_as_parameters(written) == {"one": text, "several": (text, text), "group.inner": text}
    assert load_yaml(written)["/**"]["ros__parameters"]["group"] == {"inner": text}


@given(st.text(st.characters(codec="utf-8", exclude_characters="\x00")) | st.floats(allow_nan=False) | st.booleans())
def test_any_value_is_read_as_it_was_written(value: Any) -> None:
    again = read_as_parameters(dump_yaml({"/**": {"ros__parameters": {"p": value}}}))["p"]
    assert again == value
    assert type(again) is type(value)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("5e-1", 0.5),
        ("[1.0, 1e-1]", [1.0, 0.1]),
        ("12:30", "12:30"),
        ("2001-01-01", "2001-01-01"),
        ("1_000", "1_000"),
        ("08", 8.0),
        ("y", True),
        ("'y'", "y"),
        ("!!str 3", "3"),
        ("{y: 1, 2: n}", {"y": 1, "2": False}),
        ("{a: &a {b: 1}, c: {<<: *a, d: 2}}", {"a": {"b": 1}, "c": {"b": 1, "d": 2}}),
        ("a:", {"a": None}),
        ("", None),
    ],
)
def test_plain_scalars_have_the_types_of_ros_2(text: str, value: Any) -> None:
    assert load_yaml(text) == value


def test_a_key_is_a_name() -> None:
    with pytest.raises(yaml.YAMLError, match="a key is a name"):
        load_yaml("{[a]: 1}")


@pytest.mark.parametrize(
    ("text", "value"), [("!!float 10", 10.0), ('!!int "7"', 7), ('!!bool "true"', True), ("!!str 5", "5")]
)
def test_a_tag_says_the_type(text: str, value: Any) -> None:
    again = parse_value(text)
    assert again == value
    assert type(again) is type(value)


@pytest.mark.parametrize("text", ["!!int 1.0", "!foo 5", "!!null x", "!!bool 1"])
def test_a_tag_that_does_not_fit_is_an_error(text: str) -> None:
    with pytest.raises(InvalidParams, match="has the tag"):
        parse_value(text)


def test_an_array_of_bytes_is_written_as_binary_data() -> None:
    data = (b"\x01", b"\xff")

    assert ParameterOverrides().with_text(dump_yaml({"n": {"ros__parameters": {"a": data}}})).for_node("/n") == {
        "a": data
    }
