"""Random lives of a node's parameters against a model of a few lines, and properties of values and ranges."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule

from actors import Parameter, SetResult
from actors.parameters import (
    FloatingPointRange,
    IntegerRange,
    ParameterAlreadyDeclared,
    ParameterChange,
    ParameterDescriptor,
    ParameterImmutable,
    ParameterNotDeclared,
    ParameterStore,
    ParameterType,
)
from actors.parameters.messages import from_parameter, to_parameter
from actors.parameters.values import INT64_MAX, INT64_MIN, widened

NAMES = st.sampled_from(["a", "b", "g.c", "g.d"])
int64 = st.integers(INT64_MIN, INT64_MAX)
text = st.text(max_size=5)
VALUES: st.SearchStrategy[Any] = st.one_of(
    st.none(),
    st.booleans(),
    int64,
    st.integers(-3, 3),
    st.floats(allow_nan=False),
    text,
    st.lists(st.binary(min_size=1, max_size=1), max_size=3),
    st.lists(st.booleans(), min_size=1, max_size=3),
    st.lists(int64, min_size=1, max_size=3),
    st.lists(st.floats(allow_nan=False), min_size=1, max_size=3),
    st.lists(text, min_size=1, max_size=3),
)
PARAMETERS = st.builds(Parameter, NAMES, VALUES)
FORBIDDEN = 2
"""The value that the on-set callback of the machine refuses, wherever it turns up."""


class Declared:
    """What the model knows of one parameter: its value, and how it may change."""

    def __init__(self, parameter: Parameter, dynamic: bool, read_only: bool) -> None:
        self.value = parameter.value
        self.type = None if dynamic else parameter.type
        self.read_only = read_only


class Parameters(RuleBasedStateMachine):
    """A store, a model, and a replica that knows only what the events said."""

    def __init__(self) -> None:
        super().__init__()
        self.model: dict[str, Declared] = {}
        self.replica: dict[str, Any] = {}
        self.told: list[str] = []

    @initialize(allow=st.booleans())
    def start(self, allow: bool) -> None:
        self.allow = allow
        self.store = ParameterStore("/n", allow_undeclared=allow, on_event=self.replicate)
        self.store.add_on_set_callback(self.validate)
        self.store.add_post_set_callback(lambda parameters: self.told.extend(p.name for p in parameters))
        for name in self.store.list().names:
            self.model[name] = Declared(self.store.get(name), False, name.startswith("start_"))

    def replicate(self, change: ParameterChange) -> None:
        for parameter in change.new:
            assert self.replica.get(parameter.name) is None
        for parameter in change.changed:
            assert self.replica[parameter.name] is not None
        for parameter in (*change.new, *change.changed):
            self.replica[parameter.name] = parameter.value
        for parameter in change.deleted:
            del self.replica[parameter.name]

    def validate(self, parameters: Sequence[Parameter]) -> SetResult:
        refused = any(parameter.value == FORBIDDEN for parameter in parameters)
        return SetResult(False, "forbidden") if refused else SetResult()

    @rule(parameter=PARAMETERS, dynamic=st.booleans(), read_only=st.booleans())
    def declare(self, parameter: Parameter, dynamic: bool, read_only: bool) -> None:
        described = ParameterDescriptor(dynamic_typing=dynamic, read_only=read_only)
        wrong: tuple[type[Exception], ...] = ()
        if not dynamic and parameter.value is None:
            wrong = (ValueError,)
        elif parameter.name in self.model:
            wrong = (ParameterAlreadyDeclared,)
        elif parameter.value == FORBIDDEN:
            wrong = (ValueError,)
        if wrong:
            with pytest.raises(wrong):
                self.store.declare(parameter.name, parameter.value, described)
            return
        assert self.store.declare(parameter.name, parameter.value, described) == parameter
        self.model[parameter.name] = Declared(parameter, dynamic, read_only)

    @rule(name=NAMES)
    def undeclare(self, name: str) -> None:
        known = self.model.get(name)
        if known is None or known.read_only:
            with pytest.raises(ParameterNotDeclared if known is None else ParameterImmutable):
                self.store.undeclare(name)
            return
        self.store.undeclare(name)
        del self.model[name]
        del self.replica[name]  # undeclaring is silent, as in rclpy

    @rule(parameters=st.lists(PARAMETERS, min_size=1, max_size=4))
    def set_atomically(self, parameters: list[Parameter]) -> None:
        self.told.clear()
        if any(p.name not in self.model for p in parameters) and not self.allow:
            with pytest.raises(ParameterNotDeclared):
                self.store.set_atomically(parameters)
            assert self.told == []
            return
        expected = all(self.permits(p) for p in parameters)
        result = self.store.set_atomically(parameters)
        assert (result.successful, not result.reason) == (expected, expected)
        assert self.told == ([p.name for p in parameters] if expected else [])
        if expected:
            self.apply(parameters)

    @rule(parameters=st.lists(PARAMETERS, max_size=4))
    def set(self, parameters: list[Parameter]) -> None:
        """One after the other: a name that an earlier one has deleted is undeclared for a later one."""
        expected: list[bool] = []
        for parameter in parameters:
            if parameter.name not in self.model and not self.allow:
                with pytest.raises(ParameterNotDeclared):
                    self.store.set(parameters)
                return
            expected.append(self.permits(parameter))
            self.apply([parameter] if expected[-1] else [])
        assert [result.successful for result in self.store.set(parameters)] == expected

    def permits(self, parameter: Parameter) -> bool:
        known = self.model.get(parameter.name)
        if parameter.value == FORBIDDEN:
            return False
        return known is None or (not known.read_only and known.type in (None, parameter.type))

    def apply(self, parameters: list[Parameter]) -> None:
        for parameter in parameters:
            if parameter.type is ParameterType.NOT_SET:
                self.model.pop(parameter.name, None)
            elif parameter.name in self.model:
                self.model[parameter.name].value = parameter.value
            else:
                self.model[parameter.name] = Declared(parameter, True, False)

    @invariant()
    def the_store_holds_what_the_model_holds(self) -> None:
        if hasattr(self, "store"):
            expected = {name: known.value for name, known in self.model.items()}
            assert self.store.values == expected
            assert set(self.store.list().names) == set(expected)
            for name, known in self.model.items():
                assert self.store.get(name).value == known.value
                described = self.store.describe(name)
                assert (described.dynamic_typing, described.read_only) == (known.type is None, known.read_only)
                assert described.type is self.store.type_of(name)

    @invariant()
    def the_events_tell_everything(self) -> None:
        if hasattr(self, "store"):
            begin = {"use_sim_time": False, "start_type_description_service": True}
            assert begin | self.replica == self.store.values


TestParameters = Parameters.TestCase
TestParameters.settings = settings(deadline=None, stateful_step_count=30)


@given(VALUES)
def test_every_value_survives_the_wire(value: Any) -> None:
    parameter = Parameter("p", value)
    assert from_parameter(to_parameter(parameter)) == parameter


@given(VALUES)
def test_widening_to_its_own_type_changes_nothing(value: Any) -> None:
    parameter = Parameter("p", value)
    assert widened("p", value, parameter.type) == parameter


@given(st.integers(-20, 20), st.integers(-20, 20), st.integers(0, 9), st.integers(-25, 25))
def test_an_integer_range_allows_its_ends_and_its_grid(low: int, high: int, step: int, value: int) -> None:
    first, last = min(low, high), max(low, high)
    allowed = {first, last, *range(first, last + 1, step or 1)}
    assert (IntegerRange(low, high, step).objection(value) is None) == (value in allowed)


@given(st.floats(-1e6, 1e6), st.floats(0.001, 1e3), st.integers(0, 1000))
def test_every_multiple_of_the_step_is_on_the_grid(low: float, step: float, count: int) -> None:
    assert FloatingPointRange(low, math.inf, step).objection(low + count * step) is None


@given(st.floats(), st.floats(allow_nan=False), st.floats(allow_nan=False))
def test_no_float_outside_the_ends_is_let_through(value: float, one: float, other: float) -> None:
    allowed = FloatingPointRange(one, other).objection(value) is None
    low, high = min(one, other), max(one, other)
    near = any(math.isclose(value, end, rel_tol=1e-6) for end in (low, high))
    assert allowed == (low <= value <= high or near)
