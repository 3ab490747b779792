"""Parameters on the wire: every value survives the trip, and the six services answer as ROS 2 nodes do."""

from __future__ import annotations

import math
from typing import Any

import pytest

from actors import Parameter, SetResult
from actors.interfaces import type_name
from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.rcl_interfaces import msg, srv
from actors.parameters import (
    FloatingPointRange,
    IntegerRange,
    ParameterChange,
    ParameterDescriptor,
    ParameterStore,
    ParameterType,
)
from actors.parameters import messages as wire

VALUES: list[Any] = [
    None,
    True,
    -(2**63),
    math.inf,
    "größe",
    (b"\x00", b"\xff"),
    (True, False),
    (1, -1),
    (0.5, math.inf),
    ("a", ""),
]


@pytest.fixture
def store() -> ParameterStore:
    store = ParameterStore("/n")
    store.declare("a", 1)
    store.declare("group.b", 0.5, ParameterDescriptor(floating_point_range=FloatingPointRange(0.0, 1.0)))
    store.declare("fixed", "x", ParameterDescriptor(read_only=True))
    return store


def setting(*parameters: Parameter) -> tuple[msg.Parameter, ...]:
    return tuple(wire.to_parameter(parameter) for parameter in parameters)


@pytest.mark.parametrize("value", VALUES, ids=lambda value: ParameterType.of(value).name)
def test_each_of_the_nine_types_makes_the_round_trip(value: Any) -> None:
    parameter = Parameter("p", value)
    message = wire.to_parameter(parameter)
    assert (message.name, message.value.type) == ("p", parameter.type.value)
    assert wire.from_parameter(message) == parameter


def test_empty_arrays_keep_their_type() -> None:
    for kind in ParameterType:
        if kind.is_array:
            assert wire.from_parameter(wire.to_parameter(Parameter("p", (), kind))) == Parameter("p", (), kind)


def test_an_unknown_type_is_refused_in_words() -> None:
    with pytest.raises(ValueError, match="parameter 'p' has type 42, but types go from 0 to 9"):
        wire.from_value("p", msg.ParameterValue(type=42))


def test_a_descriptor_makes_the_round_trip() -> None:
    for described in (
        ParameterDescriptor(name="p", type=ParameterType.INTEGER, description="d", integer_range=IntegerRange(0, 9, 3)),
        ParameterDescriptor(
            name="p",
            type=ParameterType.DOUBLE,
            additional_constraints="unit: m/s",
            read_only=True,
            floating_point_range=FloatingPointRange(-1.0, 1.0, 0.5),
        ),
        ParameterDescriptor(name="p", dynamic_typing=True),
    ):
        assert wire.from_descriptor(wire.to_descriptor(described)) == described


def test_choices_travel_as_text() -> None:
    described = ParameterDescriptor(additional_constraints="unit: none", choices=("trot", "walk"))
    assert wire.to_descriptor(described).additional_constraints == "unit: none; one of: 'trot', 'walk'"


def test_an_event_says_who_when_and_what() -> None:
    change = ParameterChange(new=(Parameter("a", 1),), changed=(Parameter("b", 0.5),), deleted=(Parameter("c"),))
    event = wire.to_event(change, "/ns/n", Time(sec=3))
    assert (event.node, event.stamp.sec) == ("/ns/n", 3)
    assert wire.from_event(event) == change


def test_the_six_services_are_named_below_the_node() -> None:
    assert {service.name: type_name(service.type) for service in wire.PARAMETER_SERVICES} == {
        "describe_parameters": "rcl_interfaces/srv/DescribeParameters",
        "get_parameter_types": "rcl_interfaces/srv/GetParameterTypes",
        "get_parameters": "rcl_interfaces/srv/GetParameters",
        "list_parameters": "rcl_interfaces/srv/ListParameters",
        "set_parameters": "rcl_interfaces/srv/SetParameters",
        "set_parameters_atomically": "rcl_interfaces/srv/SetParametersAtomically",
    }


def test_reading_services_answer_in_order(store: ParameterStore) -> None:
    values = wire.get_parameters(store, srv.GetParameters.Request(names=("group.b", "a"))).values
    assert [wire.from_value("", value).value for value in values] == [0.5, 1]
    types = wire.get_parameter_types(store, srv.GetParameterTypes.Request(names=("a", "fixed"))).types
    assert types.tolist() == [2, 4]
    described = wire.describe_parameters(store, srv.DescribeParameters.Request(names=("group.b",))).descriptors
    assert wire.from_descriptor(described[0]) == store.describe("group.b")


def test_one_undeclared_name_empties_the_answer(store: ParameterStore) -> None:
    store.declare("port", ParameterType.INTEGER)
    assert wire.get_parameters(store, srv.GetParameters.Request(names=("a", "zz"))).values == ()
    assert wire.get_parameters(store, srv.GetParameters.Request(names=("a", "port"))).values == ()
    assert wire.get_parameter_types(store, srv.GetParameterTypes.Request(names=("a", "zz"))).types.tolist() == []
    assert wire.get_parameter_types(store, srv.GetParameterTypes.Request(names=("port",))).types.tolist() == [0]
    assert wire.describe_parameters(store, srv.DescribeParameters.Request(names=("a", "zz"))).descriptors == ()


def test_a_node_that_allows_undeclared_names_answers_for_them() -> None:
    store = ParameterStore("/n", allow_undeclared=True)
    values = wire.get_parameters(store, srv.GetParameters.Request(names=("zz",))).values
    assert [value.type for value in values] == [0]
    types = wire.get_parameter_types(store, srv.GetParameterTypes.Request(names=("zz",))).types
    assert types.tolist() == [0]
    described = wire.describe_parameters(store, srv.DescribeParameters.Request(names=("zz",))).descriptors
    assert described == (msg.ParameterDescriptor(),)


def test_listing(store: ParameterStore) -> None:
    listed = wire.list_parameters(store, srv.ListParameters.Request(prefixes=("group",), depth=1)).result
    assert (listed.names, listed.prefixes) == (("group.b",), ("group",))


def test_setting_answers_for_each_and_goes_on_after_a_failure(store: ParameterStore) -> None:
    request = srv.SetParameters.Request(
        parameters=(
            *setting(Parameter("zz", 1), Parameter("fixed", "y"), Parameter("a", "text"), Parameter("group.b", 2.0)),
            msg.Parameter(name="a", value=msg.ParameterValue(type=42)),
            *setting(Parameter("a", 2)),
        )
    )
    results = [wire.from_result(result) for result in wire.set_parameters(store, request).results]
    assert [result.successful for result in results] == [False, False, False, False, False, True]
    assert "has not declared 'zz'" in results[0].reason
    assert "has type 42" in results[4].reason
    assert results[5] == SetResult()
    assert store.values["a"] == 2


def test_setting_atomically_is_all_or_nothing(store: ParameterStore) -> None:
    request = srv.SetParametersAtomically.Request(parameters=setting(Parameter("a", 2), Parameter("zz", 1)))
    assert not wire.set_parameters_atomically(store, request).result.successful
    assert store.values["a"] == 1
    request = srv.SetParametersAtomically.Request(parameters=setting(Parameter("a", 2), Parameter("group.b", 1.0)))
    assert wire.set_parameters_atomically(store, request).result.successful
    assert (store.values["a"], store.values["group.b"]) == (2, 1.0)


def test_a_callback_that_raises_is_reported_to_both_sides(store: ParameterStore) -> None:
    failures: list[Exception] = []

    def broken(parameters: object) -> SetResult:
        raise ZeroDivisionError("oops")

    store.add_on_set_callback(broken)
    request = srv.SetParameters.Request(parameters=setting(Parameter("a", 2)))
    (result,) = wire.set_parameters(store, request, failures.append).results
    assert (result.successful, result.reason) == (
        False,
        "a parameter callback of node /n failed: ZeroDivisionError: oops",
    )
    assert [type(failure) for failure in failures] == [ZeroDivisionError]
    assert not wire.set_parameters(store, request).results[0].successful
    assert store.values["a"] == 1


@pytest.mark.parametrize("service", wire.PARAMETER_SERVICES, ids=lambda service: service.name)
def test_every_service_answers_an_empty_request_with_its_response(
    store: ParameterStore, service: wire.ParameterService
) -> None:
    kind: Any = service.type
    assert isinstance(service.answer(store, kind.Request()), kind.Response)
