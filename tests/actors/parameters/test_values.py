"""Parameter values: inference from Python, what a Parameter holds, widening."""

from __future__ import annotations

import math
from array import array
from enum import IntEnum
from typing import Any

import numpy as np
import pytest

from actors import Parameter
from actors.parameters import ParameterType
from actors.parameters.values import INT64_MAX, INT64_MIN, widened

NINE = [
    (True, ParameterType.BOOL, True),
    (7, ParameterType.INTEGER, 7),
    (0.5, ParameterType.DOUBLE, 0.5),
    ("walk", ParameterType.STRING, "walk"),
    ([b"o", b"k"], ParameterType.BYTE_ARRAY, (b"o", b"k")),
    ([True, False], ParameterType.BOOL_ARRAY, (True, False)),
    ([1, -2], ParameterType.INTEGER_ARRAY, (1, -2)),
    ((0.1, 2.0), ParameterType.DOUBLE_ARRAY, (0.1, 2.0)),
    (["a", ""], ParameterType.STRING_ARRAY, ("a", "")),
]


class Mode(IntEnum):
    TROT = 2


@pytest.mark.parametrize(("given", "kind", "kept"), NINE)
def test_each_of_the_nine_types_is_inferred_and_kept_immutable(given: Any, kind: ParameterType, kept: Any) -> None:
    parameter = Parameter("p", given)
    assert (parameter.type, parameter.value) == (kind, kept)
    assert type(parameter.value) is type(kept)
    assert parameter == Parameter("p", given, kind)
    hash(parameter)


@pytest.mark.parametrize(("given", "kind", "kept"), NINE)
def test_asking_for_the_wrong_type_is_an_error(given: Any, kind: ParameterType, kept: Any) -> None:
    parameter = Parameter("p", given)
    for asked in ParameterType:
        if asked is kind:
            assert getattr(parameter, f"{asked.name.lower()}_value") == kept
        elif asked is not ParameterType.NOT_SET:
            with pytest.raises(TypeError, match=f"parameter 'p' is {kind.name}, not {asked.name}: its value is"):
                getattr(parameter, f"{asked.name.lower()}_value")


def test_none_is_a_parameter_without_type_and_value() -> None:
    assert Parameter("p") == Parameter("p", None, ParameterType.NOT_SET)


@pytest.mark.parametrize("number", [2**63, -(2**63) - 1])
def test_integers_beyond_64_bits_are_refused(number: int) -> None:
    with pytest.raises(ValueError, match="64 bits"):
        Parameter("p", number)
    with pytest.raises(ValueError, match="64 bits"):
        Parameter("p", [1, number])


def test_the_smallest_and_the_largest_integer_are_held() -> None:
    assert Parameter("p", [INT64_MIN, INT64_MAX]).value == (-(2**63), 2**63 - 1)


def test_arrays_of_the_standard_library_become_tuples() -> None:
    assert Parameter("p", array("i", [1, 2])) == Parameter("p", [1, 2])
    assert Parameter("p", array("d", [1.5])) == Parameter("p", [1.5])


def test_subclasses_of_plain_values_become_plain() -> None:
    kept = Parameter("p", Mode.TROT).value
    assert type(kept) is int
    kept = Parameter("p", np.float64(0.5)).value
    assert type(kept) is float
    assert [type(element) for element in Parameter("p", [Mode.TROT, 1]).value] == [int, int]


def test_a_list_of_bool_and_int_counts_as_integers_as_in_rclpy() -> None:
    parameter = Parameter("p", [True, 1])
    assert parameter.type is ParameterType.INTEGER_ARRAY
    assert [type(element) for element in parameter.value] == [int, int]


@pytest.mark.parametrize("value", [[1, 2.0], [1, "a"], {"a": 1}, b"ab", object(), [[1], [2]]])
def test_what_is_none_of_the_nine_types_is_a_type_error(value: object) -> None:
    with pytest.raises(TypeError, match="a parameter cannot hold"):
        Parameter("p", value)


def test_a_numpy_array_is_refused_with_the_remedy() -> None:
    with pytest.raises(TypeError, match=r"call its \.tolist\(\) first"):
        Parameter("p", np.zeros(2))


@pytest.mark.parametrize(
    ("kind", "value"),
    [
        (ParameterType.NOT_SET, 42),
        (ParameterType.DOUBLE, 1),
        (ParameterType.INTEGER, 1.0),
        (ParameterType.BOOL, 1),
        (ParameterType.STRING, None),
        (ParameterType.BOOL_ARRAY, 42),
        (ParameterType.DOUBLE_ARRAY, [1, 2]),
        (ParameterType.BYTE_ARRAY, [b"ab"]),
    ],
)
def test_a_stated_type_must_agree_with_the_value(kind: ParameterType, value: object) -> None:
    with pytest.raises(ValueError, match=r"do not agree|one byte"):
        Parameter("p", value, kind)


def test_the_type_itself_must_be_a_parameter_type() -> None:
    with pytest.raises(TypeError, match="must be a ParameterType, not 'double'"):
        Parameter("p", 1.0, "double")  # type: ignore[arg-type]


def test_only_the_five_list_types_are_arrays() -> None:
    assert [kind.name for kind in ParameterType if kind.is_array] == [
        "BYTE_ARRAY",
        "BOOL_ARRAY",
        "INTEGER_ARRAY",
        "DOUBLE_ARRAY",
        "STRING_ARRAY",
    ]


@pytest.mark.parametrize(
    ("value", "kind", "kept"),
    [
        (2, ParameterType.DOUBLE, 2.0),
        (0.5, ParameterType.DOUBLE, 0.5),
        ([1, 0.5], ParameterType.DOUBLE_ARRAY, (1.0, 0.5)),
        ([], ParameterType.STRING_ARRAY, ()),
        (3, ParameterType.INTEGER, 3),
    ],
)
def test_widening_loses_nothing(value: object, kind: ParameterType, kept: object) -> None:
    assert widened("p", value, kind) == Parameter("p", kept, kind)


@pytest.mark.parametrize(
    ("value", "kind", "own"),
    [
        (True, ParameterType.DOUBLE, ParameterType.BOOL),
        (1.0, ParameterType.INTEGER, ParameterType.DOUBLE),
        ("1", ParameterType.DOUBLE, ParameterType.STRING),
        ([True], ParameterType.DOUBLE_ARRAY, ParameterType.BOOL_ARRAY),
        (["a"], ParameterType.BOOL_ARRAY, ParameterType.STRING_ARRAY),
        (5, ParameterType.DOUBLE_ARRAY, ParameterType.INTEGER),
    ],
)
def test_what_does_not_widen_keeps_its_own_type(value: object, kind: ParameterType, own: ParameterType) -> None:
    assert widened("p", value, kind).type is own


def test_an_integer_too_large_for_a_float_is_refused_in_words() -> None:
    with pytest.raises(ValueError, match="too large for a floating-point parameter"):
        widened("p", 10**400, ParameterType.DOUBLE)


def test_nan_and_infinities_are_doubles() -> None:
    assert math.isnan(Parameter("p", math.nan).value)
    assert Parameter("p", -math.inf).type is ParameterType.DOUBLE
