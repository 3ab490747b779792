"""One node's parameters: declaring, overriding, reading, setting, describing, listing, reporting."""

from __future__ import annotations

import math
from typing import Any

import pytest

from actors import Parameter, SetResult, parameter
from actors.parameters import (
    FloatingPointRange,
    IntegerRange,
    InvalidParameterName,
    InvalidParameterType,
    InvalidParameterValue,
    ParameterAlreadyDeclared,
    ParameterChange,
    ParameterDescriptor,
    ParameterImmutable,
    ParameterNames,
    ParameterNotDeclared,
    ParameterStore,
    ParameterTable,
    ParameterType,
    ParameterUninitialized,
)

MAX_VELOCITY = parameter(1.0, name="max_velocity", ge=0.0, le=10.0)
PID_GAINS = parameter((1.0, 0.1, 0.01), name="pid_gains")
SERIAL = parameter("A1", name="serial", read_only=True)
MOTOR = ParameterTable([MAX_VELOCITY, PID_GAINS, SERIAL])
DYNAMIC = ParameterDescriptor(dynamic_typing=True)
BUILT_IN = ("use_sim_time", "start_type_description_service")


def motor_controller(overrides: dict[str, Any] | None = None, **options: Any) -> ParameterStore:
    return ParameterStore("/motor_controller", overrides, table=MOTOR, **options)


@pytest.fixture
def changes() -> list[ParameterChange]:
    return []


@pytest.fixture
def store(changes: list[ParameterChange]) -> ParameterStore:
    """A plain node, /n, whose changes are recorded."""
    store = ParameterStore("/n", on_event=changes.append)
    changes.clear()
    return store


def names(change: ParameterChange) -> tuple[list[str], list[str], list[str]]:
    return (
        [parameter.name for parameter in change.new],
        [parameter.name for parameter in change.changed],
        [parameter.name for parameter in change.deleted],
    )


# -- what the class declares, and overrides ---------------------------------------------------------------------------


def test_a_node_starts_with_the_values_of_its_class() -> None:
    store = motor_controller()
    assert store.values["max_velocity"] == 1.0
    assert store.get("pid_gains") == Parameter("pid_gains", (1.0, 0.1, 0.01))
    assert store.value("use_sim_time") is False
    assert repr(store).startswith("<parameters of /motor_controller: use_sim_time=False, ")


def test_overrides_replace_declared_values() -> None:
    slow, fast = motor_controller({"max_velocity": 0.2}), motor_controller({"max_velocity": 8.0, "unused": 1})
    assert (slow.values["max_velocity"], fast.values["max_velocity"]) == (0.2, 8.0)
    assert not fast.has("unused")
    assert motor_controller({"serial": "B2"}).values["serial"] == "B2"
    assert motor_controller({"use_sim_time": True}).values["use_sim_time"] is True


def test_an_int_in_an_override_widens_to_the_declared_float() -> None:
    store = motor_controller({"max_velocity": 2, "pid_gains": [1, 0.5, 0]})
    assert store.get("max_velocity") == Parameter("max_velocity", 2.0)
    assert store.get("pid_gains") == Parameter("pid_gains", (1.0, 0.5, 0.0))


def test_an_override_of_another_type_fails_the_node() -> None:
    with pytest.raises(InvalidParameterType, match=r"/motor_controller.*expected DOUBLE got STRING") as caught:
        motor_controller({"max_velocity": "fast"})
    assert (caught.value.node, caught.value.names) == ("/motor_controller", ("max_velocity",))


@pytest.mark.parametrize("wrong", [-0.1, 10.1, math.nan])
def test_an_override_outside_the_range_fails_the_node(wrong: float) -> None:
    with pytest.raises(InvalidParameterValue, match="out of range"):
        motor_controller({"max_velocity": wrong})


def test_two_nodes_of_one_class_are_independent() -> None:
    left, right = motor_controller(), motor_controller()
    assert left.set_values({"max_velocity": 3.0}).successful
    left.undeclare("pid_gains")
    left.declare("extra", 1)
    assert right.values["max_velocity"] == 1.0
    assert right.has("pid_gains")
    assert not right.has("extra")
    assert MOTOR.values["max_velocity"] == 1.0


def test_the_values_at_the_start_are_reported_as_new(changes: list[ParameterChange]) -> None:
    motor_controller({"max_velocity": 2.0}, on_event=changes.append)
    assert [names(change) for change in changes] == [([*BUILT_IN, "max_velocity", "pid_gains", "serial"], [], [])]
    assert Parameter("max_velocity", 2.0) in changes[0].new


def test_overrides_can_declare_themselves(changes: list[ParameterChange]) -> None:
    store = motor_controller(
        {"max_velocity": 2.0, "extra": [1, 2]}, automatically_declare=True, on_event=changes.append
    )
    assert store.get("extra") == Parameter("extra", (1, 2))
    assert not store.set_values({"extra": "text"}).successful
    assert names(changes[-1]) == (["extra"], [], [])


# -- declaring at run time --------------------------------------------------------------------------------------------


def test_a_declared_default_fixes_the_type(store: ParameterStore, changes: list[ParameterChange]) -> None:
    assert store.declare("rate", 50.0) == Parameter("rate", 50.0)
    assert not store.set([Parameter("rate", 50)])[0].successful
    assert store.describe("rate").type is ParameterType.DOUBLE
    assert changes == [ParameterChange(new=(Parameter("rate", 50.0),))]


def test_a_type_alone_declares_without_a_value(store: ParameterStore, changes: list[ParameterChange]) -> None:
    assert store.declare("port", ParameterType.INTEGER) == Parameter("port")
    assert store.has("port")
    assert "port" not in store.values
    with pytest.raises(ParameterUninitialized, match="'port' of node /n has no value: it was declared as INTEGER"):
        store.get("port")
    assert store.get_or("port", 80) == Parameter("port", 80)
    assert store.type_of("port") is ParameterType.NOT_SET
    assert store.describe("port").type is ParameterType.INTEGER
    assert not store.set([Parameter("port", "http")])[0].successful
    assert store.set([Parameter("port", 8080)])[0].successful
    assert store.value("port") == 8080
    assert [names(change) for change in changes] == [(["port"], [], []), (["port"], [], [])]


def test_a_name_alone_is_deprecated_and_dynamic(store: ParameterStore) -> None:
    with pytest.warns(DeprecationWarning, match="'anything' of node /n by its name only is deprecated"):
        assert store.declare("anything") == Parameter("anything")
    assert store.get("anything").type is ParameterType.NOT_SET
    assert store.set_values({"anything": [True]}).successful


def test_an_override_meets_a_declaration_made_later() -> None:
    store = ParameterStore("/n", {"rate": 20, "name": "x", "list": []})
    assert store.declare("rate", 50.0).value == 20.0
    assert store.declare("list", ParameterType.STRING_ARRAY).value == ()
    assert store.declare("name", "y", ignore_override=True).value == "y"
    store.undeclare("name")
    with pytest.raises(InvalidParameterType, match="expected INTEGER got STRING"):
        store.declare("name", 3)
    assert not store.has("name")


@pytest.mark.parametrize(
    ("arguments", "error", "why"),
    [
        (("", 1), InvalidParameterName, "non-empty string"),
        ((5, 1), InvalidParameterName, "non-empty string, not 5"),
        (("use_sim_time", True), ParameterAlreadyDeclared, "/n has already declared 'use_sim_time'"),
        (("x", None, ParameterDescriptor()), ValueError, "neither a default value nor a type"),
        (("x", ParameterType.NOT_SET), ValueError, "cannot have NOT_SET"),
        (("x", ParameterType.BOOL, DYNAMIC), ValueError, "drop one of them"),
        (("x", object()), TypeError, "cannot hold"),
        (("x", 2**63), ValueError, "64 bits"),
        (("x", 12, ParameterDescriptor(integer_range=IntegerRange(0, 10))), InvalidParameterValue, "out of range"),
        (
            ("x", math.nan, ParameterDescriptor(floating_point_range=FloatingPointRange(0, 1))),
            InvalidParameterValue,
            "value nan",
        ),
    ],
)
def test_a_wrong_declaration_leaves_nothing_behind(
    store: ParameterStore, changes: list[ParameterChange], arguments: tuple[Any, ...], error: type[Exception], why: str
) -> None:
    with pytest.raises(error, match=why):
        store.declare(*arguments)
    assert store.list().names == BUILT_IN
    assert changes == []


def test_several_are_checked_by_name_first_and_declared_one_by_one(store: ParameterStore) -> None:
    declared = store.declare_many("pid", [("p", 1.0), ("mode", "auto", DYNAMIC)])
    assert [parameter.name for parameter in declared] == ["pid.p", "pid.mode"]
    with pytest.raises(ParameterAlreadyDeclared, match=r"'pid\.p', 'pid\.i'"):
        store.declare_many("", [("new", 1), ("pid.p", 1.0), ("pid.i", 2), ("pid.i", 3)])
    assert not store.has("new")
    limited = ParameterDescriptor(integer_range=IntegerRange(0, 1))
    with pytest.raises(InvalidParameterValue):
        store.declare_many("", [("first", 1), ("second", 5, limited), ("third", 1)])
    assert store.has("first")
    assert not store.has("third")


def test_several_accept_one_to_three_elements_each(store: ParameterStore) -> None:
    with pytest.warns(DeprecationWarning, match="'alone' of node /n by its name only"):
        assert store.declare_many("", [("alone",)]) == (Parameter("alone"),)
    with pytest.raises(ValueError, match="neither a default value nor a type"):
        store.declare_many("", [("x", None)])
    with pytest.raises(TypeError, match="not \\('x', 1, None, 2\\)"):
        store.declare_many("", [("x", 1, None, 2)])


def test_undeclaring_is_silent_and_refused_for_read_only_ones(changes: list[ParameterChange]) -> None:
    store = motor_controller(on_event=changes.append)
    changes.clear()
    store.undeclare("max_velocity")
    assert not store.has("max_velocity")
    assert "max_velocity" not in store.values
    assert changes == []
    store.declare("max_velocity", "now a string")
    with pytest.raises(ParameterImmutable, match="'serial' of node /motor_controller is read-only"):
        store.undeclare("serial")
    with pytest.raises(ParameterNotDeclared, match="did you mean 'serial'"):
        store.undeclare("seriell")


# -- reading ----------------------------------------------------------------------------------------------------------


def test_reading_an_undeclared_parameter_names_node_parameter_and_neighbours(store: ParameterStore) -> None:
    with pytest.raises(ParameterNotDeclared, match="node /n has not declared 'zz'; declared are: start_type_d"):
        store.get("zz")
    with pytest.raises(ParameterNotDeclared):
        store.describe("zz")
    with pytest.raises(ParameterNotDeclared):
        store.type_of("zz")
    assert store.get_or("zz", 9) == Parameter("zz", 9)
    assert store.get_or("use_sim_time", True) == Parameter("use_sim_time", False)
    assert not store.has("zz")


def test_groups_are_read_by_prefix() -> None:
    store = ParameterStore("/n")
    store.declare_many("pid", [("p", 1.0), ("i", 0.1)])
    store.declare("pid_max", ParameterType.INTEGER)
    assert store.get_by_prefix("pid") == {"p": Parameter("pid.p", 1.0), "i": Parameter("pid.i", 0.1)}
    assert set(store.get_by_prefix("")) == {*BUILT_IN, "pid.p", "pid.i", "pid_max"}
    assert store.get_by_prefix("max") == {}


def test_listing_by_depth_and_prefix() -> None:
    store = ParameterStore("/n")
    for name in ("e1", "pfx.a", "pfx.b.c", "pfx.b.d.e", "pf"):
        store.declare(name, 1)
    assert store.list().prefixes == ("pfx", "pfx.b", "pfx.b.d")
    assert store.list([], 1).names == (*BUILT_IN, "e1", "pf")
    assert store.list(["pfx"], 1) == ParameterNames(("pfx.a",), ("pfx",))
    assert store.list(["pfx"], 2).names == ("pfx.a", "pfx.b.c")
    assert store.list(["pfx"]).names == ("pfx.a", "pfx.b.c", "pfx.b.d.e")
    assert store.list(["pf"]).names == ("pf",)
    assert store.list(["e1", "pfx.b"], 1).names == ("e1", "pfx.b.c")


@pytest.mark.parametrize(
    ("prefixes", "depth", "error"),
    [("pfx", 0, TypeError), ([5], 0, TypeError), ([], 1.5, TypeError), ([], -1, ValueError)],
)
def test_listing_refuses_wrong_arguments(prefixes: Any, depth: Any, error: type[Exception]) -> None:
    with pytest.raises(error, match=r"must be"):
        ParameterStore("/n").list(prefixes, depth)


# -- setting ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("value", "allowed"), [(0.0, True), (10.0, True), (-0.1, False), (10.1, False), (math.nan, False)]
)
def test_max_velocity_lies_between_0_and_10(value: float, allowed: bool) -> None:
    store = motor_controller()
    result = store.set_values({"max_velocity": value})
    assert result.successful == allowed
    assert store.values["max_velocity"] == (value if allowed else 1.0)
    assert allowed or "out of range 0.0..10.0" in result.reason


def test_a_wrong_type_is_refused_with_a_reason(changes: list[ParameterChange]) -> None:
    store = motor_controller(on_event=changes.append)
    changes.clear()
    result = store.set_values({"max_velocity": "fast"})
    assert not result.successful
    assert result.reason.startswith("Wrong parameter type, expected DOUBLE got STRING")
    assert changes == []


def test_the_service_is_exact_where_python_widens() -> None:
    store = motor_controller()
    assert not store.set([Parameter("max_velocity", 2)])[0].successful
    assert store.set_values({"max_velocity": 2}).successful
    assert store.get("max_velocity") == Parameter("max_velocity", 2.0)
    assert store.coerced("pid_gains", []) == Parameter("pid_gains", (), ParameterType.DOUBLE_ARRAY)
    assert store.coerced("unknown", 2) == Parameter("unknown", 2)


def test_each_parameter_of_a_set_has_its_own_result(changes: list[ParameterChange]) -> None:
    store = motor_controller(on_event=changes.append)
    changes.clear()
    results = store.set(
        [
            Parameter("max_velocity", 2.0),
            Parameter("serial", "A1"),
            Parameter("pid_gains", "x"),
            Parameter("use_sim_time", True),
        ]
    )
    assert [result.successful for result in results] == [True, False, False, True]
    assert results[1].reason.startswith("Trying to set a read-only parameter: serial.")
    assert [names(change) for change in changes] == [([], ["max_velocity"], []), ([], ["use_sim_time"], [])]


def test_a_set_keeps_what_came_before_an_undeclared_name() -> None:
    store = motor_controller()
    with pytest.raises(ParameterNotDeclared):
        store.set([Parameter("max_velocity", 2.0), Parameter("nobody", 1), Parameter("use_sim_time", True)])
    assert store.values["max_velocity"] == 2.0
    assert store.values["use_sim_time"] is False


def test_an_atomic_set_is_all_or_nothing_with_one_event(changes: list[ParameterChange]) -> None:
    store = motor_controller(on_event=changes.append)
    changes.clear()
    assert not store.set_values({"max_velocity": 5.0, "pid_gains": "two"}).successful
    with pytest.raises(ParameterNotDeclared):
        store.set_values({"max_velocity": 5.0, "nobody": 1})
    assert (store.values["max_velocity"], changes) == (1.0, [])
    assert store.set_values({"max_velocity": 5.0, "pid_gains": (2.0, 0.0, 0.0)}) == SetResult()
    assert [names(change) for change in changes] == [([], ["max_velocity", "pid_gains"], [])]


def test_setting_the_same_value_is_reported_too(store: ParameterStore, changes: list[ParameterChange]) -> None:
    store.declare("p", 1)
    store.set_values({"p": 1})
    assert names(changes[-1]) == ([], ["p"], [])


def test_nothing_deletes_only_dynamic_parameters(store: ParameterStore, changes: list[ParameterChange]) -> None:
    store.declare("static", 1)
    store.declare("dynamic", 1, DYNAMIC)
    changes.clear()
    refused, deleted = store.set([Parameter("static"), Parameter("dynamic")])
    assert refused.reason.startswith("Static parameter cannot be undeclared")
    assert deleted.successful
    assert store.has("static")
    assert not store.has("dynamic")
    assert changes == [ParameterChange(deleted=(Parameter("dynamic"),))]


def test_a_dynamic_parameter_changes_type_and_its_description_follows(store: ParameterStore) -> None:
    store.declare("d", None, DYNAMIC)
    assert store.describe("d").type is ParameterType.NOT_SET
    for value in (1, "text", (True,)):
        assert store.set_values({"d": value}).successful
        assert store.describe("d").type is store.type_of("d") is ParameterType.of(value)


def test_of_a_name_given_twice_the_last_value_counts(store: ParameterStore, changes: list[ParameterChange]) -> None:
    store.declare("d", 1, DYNAMIC)
    changes.clear()
    assert store.set_atomically([Parameter("d"), Parameter("d", 5), Parameter("d", "last")]).successful
    assert changes == [ParameterChange(changed=(Parameter("d", "last"),))]


def test_an_empty_atomic_set_does_nothing(store: ParameterStore, changes: list[ParameterChange]) -> None:
    assert store.set_atomically([]).successful
    assert changes == []


def test_undeclared_parameters_can_be_allowed(changes: list[ParameterChange]) -> None:
    store = ParameterStore("/n", allow_undeclared=True, on_event=changes.append)
    changes.clear()
    assert store.get("w") == Parameter("w")
    assert store.type_of("w") is ParameterType.NOT_SET
    assert store.describe("w") == ParameterDescriptor()
    assert store.set([Parameter("w", 1)])[0].successful
    assert store.set([Parameter("w", "text")])[0].successful
    assert store.describe("w").dynamic_typing
    assert store.set([Parameter("w")])[0].successful
    assert not store.has("w")
    assert [names(change) for change in changes] == [(["w"], [], []), ([], ["w"], []), ([], [], ["w"])]
    assert store.set([Parameter("never")])[0].successful
    assert len(changes) == 3
    assert store.set([Parameter("", 1)]) == (SetResult(False, "a parameter name must not be empty."),)
    store.declare("static", 1)
    assert not store.set([Parameter("static", "text")])[0].successful


# -- descriptors ------------------------------------------------------------------------------------------------------


def test_a_descriptor_is_replaced_if_the_value_obeys_it(store: ParameterStore, changes: list[ParameterChange]) -> None:
    store.declare("p", 5)
    changes.clear()
    limited = ParameterDescriptor(name="ignored", type=ParameterType.STRING, integer_range=IntegerRange(0, 10))
    assert store.set_descriptor("p", limited) == Parameter("p", 5)
    assert store.describe("p").name == "p"
    assert store.describe("p").type is ParameterType.INTEGER
    assert not store.set_values({"p": 11}).successful
    with pytest.raises(InvalidParameterValue, match=r"out of range 0\.\.3") as caught:
        store.set_descriptor("p", ParameterDescriptor(integer_range=IntegerRange(0, 3)))
    assert caught.value.reason == "Parameter p is out of range 0..3, value 5."
    assert store.set_values({"p": 9}).successful
    assert len(changes) == 1


def test_an_alternative_value_takes_over_and_is_reported(store: ParameterStore, changes: list[ParameterChange]) -> None:
    store.declare("p", 5.0)
    changes.clear()
    unit = ParameterDescriptor(floating_point_range=FloatingPointRange(0.0, 1.0))
    with pytest.raises(InvalidParameterValue):
        store.set_descriptor("p", unit, 7.0)
    with pytest.raises(InvalidParameterType):
        store.set_descriptor("p", unit, "text")
    assert store.set_descriptor("p", unit, 1) == Parameter("p", 1.0)
    assert store.values["p"] == 1.0
    assert changes == [ParameterChange(changed=(Parameter("p", 1.0),))]
    assert store.set_descriptor("p", unit, 0.5) == Parameter("p", 1.0)


def test_typing_changes_only_when_asked(store: ParameterStore) -> None:
    store.declare("p", 5)
    store.set_descriptor("p", ParameterDescriptor(description="still an integer"))
    assert not store.set_values({"p": "text"}).successful
    store.set_descriptor("p", DYNAMIC)
    assert store.set_values({"p": "text"}).successful
    store.set_descriptor("p", ParameterDescriptor())
    assert not store.set_values({"p": 5}).successful


def test_a_parameter_without_a_value_keeps_or_gets_its_type(store: ParameterStore) -> None:
    store.declare("typed", ParameterType.BOOL)
    store.set_descriptor("typed", ParameterDescriptor(description="d"))
    assert store.describe("typed").type is ParameterType.BOOL
    store.declare("free", None, DYNAMIC)
    with pytest.raises(ValueError, match="'free' has no type to keep"):
        store.set_descriptor("free", ParameterDescriptor())
    store.set_descriptor("free", ParameterDescriptor(type=ParameterType.STRING))
    assert store.describe("free").type is ParameterType.STRING


def test_read_only_and_undeclared_parameters_cannot_be_described_anew() -> None:
    store = motor_controller()
    with pytest.raises(ParameterImmutable, match="'serial' of node /motor_controller is read-only"):
        store.set_descriptor("serial", ParameterDescriptor())
    with pytest.raises(ParameterNotDeclared):
        store.set_descriptor("nobody", ParameterDescriptor())
    relaxed = ParameterStore("/n", allow_undeclared=True)
    assert relaxed.set_descriptor("nobody", ParameterDescriptor()) == Parameter("nobody")
    assert not relaxed.has("nobody")
