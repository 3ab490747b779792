"""Ranges, steps and choices: which values a descriptor lets through."""

from __future__ import annotations

import math

import pytest

from actors import Parameter
from actors.parameters import FloatingPointRange, IntegerRange, ParameterDescriptor, ParameterType


def test_both_ends_are_allowed_even_off_the_step_grid() -> None:
    even = IntegerRange(0, 9, 2)
    assert [value for value in range(-1, 11) if even.objection(value) is None] == [0, 2, 4, 6, 8, 9]
    halves = FloatingPointRange(0.0, 0.9, 0.5)
    assert [value for value in (0.0, 0.25, 0.5, 0.75, 0.9, 1.0) if halves.objection(value) is None] == [0.0, 0.5, 0.9]


def test_swapped_ends_mean_the_same_range() -> None:
    for value in range(-2, 13):
        assert (IntegerRange(10, 0, 3).objection(value) is None) == (IntegerRange(0, 10, 3).objection(value) is None)
    assert FloatingPointRange(1.0, 0.0).objection(0.5) is None


def test_steps_of_floats_compare_with_a_relative_tolerance() -> None:
    tenths = FloatingPointRange(0.0, 1.0, 0.1)
    assert tenths.objection(0.1 + 0.2) is None
    assert tenths.objection(0.3000001) is None
    assert tenths.objection(0.30001) is not None
    assert FloatingPointRange(0.0, 1.0).objection(1.0000005) is None
    assert FloatingPointRange(0.0, 1.0).objection(1.00001) is not None


def test_nan_is_inside_no_range() -> None:
    assert FloatingPointRange(0.0, 10.0).objection(math.nan) is not None
    assert FloatingPointRange(-math.inf, math.inf).objection(math.nan) is not None
    assert FloatingPointRange(0.0, math.inf).objection(math.inf) is None


def test_a_step_too_fine_for_floats_to_count_lets_everything_through() -> None:
    assert FloatingPointRange(0.0, 1e308, 1e-300).objection(1e307) is None


@pytest.mark.parametrize(
    ("low", "high", "step", "why"),
    [
        (math.nan, 1.0, 0.0, "NaN"),
        (0.0, math.nan, 0.0, "NaN"),
        (0.0, 1.0, -0.1, "not negative"),
        (0.0, 1.0, math.nan, "not negative"),
        (0.0, 1.0, math.inf, "finite"),
        (-math.inf, 1.0, 0.5, "finite lower end"),
    ],
)
def test_impossible_float_ranges_are_refused(low: float, high: float, step: float, why: str) -> None:
    with pytest.raises(ValueError, match=why):
        FloatingPointRange(low, high, step)


def test_a_negative_integer_step_is_refused() -> None:
    with pytest.raises(ValueError, match="must not be negative"):
        IntegerRange(0, 10, -1)


def test_a_range_counts_only_for_values_of_its_own_kind() -> None:
    described = ParameterDescriptor(integer_range=IntegerRange(0, 10))
    assert described.value_objection(Parameter("p", 123.0)) is None
    assert described.value_objection(Parameter("p", "text")) is None
    assert described.value_objection(Parameter("p", 123)) == "Parameter p is out of range 0..10, value 123."
    described = ParameterDescriptor(floating_point_range=FloatingPointRange(0.0, 1.0))
    assert described.value_objection(Parameter("p", 123)) is None
    assert described.value_objection(Parameter("p", 2.0)) == "Parameter p is out of range 0.0..1.0, value 2.0."


def test_choices_name_what_is_allowed() -> None:
    described = ParameterDescriptor(choices=("trot", "walk"))
    assert described.value_objection(Parameter("gait", "walk")) is None
    assert described.value_objection(Parameter("gait")) is None
    assert (
        described.value_objection(Parameter("gait", "run"))
        == "Parameter gait must be one of 'trot', 'walk'; value 'run'."
    )


def test_a_static_type_is_exact_and_the_reason_names_both_types() -> None:
    described = ParameterDescriptor(name="max_velocity", type=ParameterType.DOUBLE)
    assert described.type_objection(Parameter("max_velocity", 1.0)) is None
    assert (
        described.type_objection(Parameter("max_velocity", "fast"))
        == "Wrong parameter type, expected DOUBLE got STRING: 'max_velocity' cannot be set to 'fast'."
    )
    assert "expected DOUBLE got INTEGER" in str(described.type_objection(Parameter("max_velocity", 2)))
    assert "cannot be undeclared" in str(described.type_objection(Parameter("max_velocity")))


def test_dynamic_typing_takes_any_type() -> None:
    described = ParameterDescriptor(name="p", dynamic_typing=True)
    assert [described.type_objection(Parameter("p", value)) for value in (None, 1, "a", [0.5])] == [None] * 4
