"""Text given to `param set`."""

from __future__ import annotations

import contextlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from actors import Parameter
from actors.parameters import ParameterType
from actors.parameters.text import parse_parameter


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1.5", 1.5),
        ("true", True),
        ("42", 42),
        ("fast", "fast"),
        ("", ""),
        ("null", "null"),
        ("~", "~"),
        ("[1.5, 0.2, 0.02]", (1.5, 0.2, 0.02)),
        ("[1, 2.0]", "[1, 2.0]"),
        ("{a: 1}", "{a: 1}"),
        ("2024-01-31", "2024-01-31"),
        ("2024-13-99", "2024-13-99"),
        ("[1, 2", "[1, 2"),
        ("a: b: c", "a: b: c"),
        ("'5'", "5"),
        ("[a, b]", ("a", "b")),
        ("1e3", "1e3"),
        ("1_000", 1000),
        ("[1, 2]", (1, 2)),
        ("{", "{"),
    ],
)
def test_text_is_typed_as_ros2_param_set_types_it(text: str, value: object) -> None:
    assert parse_parameter("max_velocity", text) == Parameter("max_velocity", value)


def test_an_empty_list_is_an_empty_array_of_bool() -> None:
    assert parse_parameter("p", "[]") == Parameter("p", (), ParameterType.BOOL_ARRAY)


def test_an_integer_beyond_64_bits_is_refused() -> None:
    with pytest.raises(ValueError, match="64 bits"):
        parse_parameter("p", "9223372036854775808")


@given(st.text(max_size=40))
def test_any_text_is_a_parameter_but_for_integers_beyond_64_bits(text: str) -> None:
    with contextlib.suppress(ValueError):
        assert parse_parameter("p", text).type is not ParameterType.NOT_SET
