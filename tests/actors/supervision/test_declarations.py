"""The declared tree: defaults, refusals, values."""

from __future__ import annotations

import math
import pickle
from collections.abc import Callable
from random import Random
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from actors import Node
from actors.errors import DeclarationError
from actors.supervision.child import Child
from actors.supervision.declarations import DynamicSupervisor, Supervisor
from actors.supervision.policy import (
    Backoff,
    Intensity,
    all_significant,
    any_significant,
    one_for_all,
    rest_for_one,
    temporary,
    transient,
)


class GpsDriver:
    pass


class IMUReader:
    node_name = "imu"


def camera() -> None: ...


def test_declared_defaults() -> None:
    tree = Supervisor("robot", children=[Child(GpsDriver), Supervisor("legs")])
    node, legs = tree.children
    assert (tree.strategy, tree.intensity, tree.auto_shutdown) == ("one_for_one", Intensity(3, within=5.0), "never")
    assert (node.restart, node.stop, node.backoff, node.significant) == ("permanent", 5.0, None, False)
    assert (legs.restart, legs.stop, legs.significant) == ("permanent", math.inf, False)
    assert (node.kind, legs.kind) == ("worker", "supervisor")


@pytest.mark.parametrize(
    ("options", "option", "value"),
    [
        ({"strategy": "one_for_al"}, "strategy", "'one_for_al'"),
        ({"strategy": None}, "strategy", "None"),
        ({"intensity": 3}, "intensity", "3"),
        ({"auto_shutdown": "some"}, "auto_shutdown", "'some'"),
        ({"restart": "always"}, "restart", "'always'"),
        ({"stop": -1}, "stop", "-1"),
        ({"significant": 1, "restart": transient}, "significant", "1"),
        ({"children": "abc"}, "children", "'abc'"),
        ({"children": 5}, "children", "5"),
    ],
)
def test_bad_supervisor_options_are_named(options: dict[str, Any], option: str, value: str) -> None:
    with pytest.raises(DeclarationError) as refused:
        Supervisor("robot", **options)
    assert "Supervisor('robot')" in str(refused.value)
    assert option in str(refused.value)
    assert value in str(refused.value)


@pytest.mark.parametrize("restarts", [-1, 1.5, True, "3", None])
def test_bad_intensities_are_named(restarts: Any) -> None:
    with pytest.raises(DeclarationError, match=r"Intensity: restarts must be .* not "):
        Intensity(restarts)


@pytest.mark.parametrize("within", [0, 0.0, -1.0, math.inf, math.nan, "5", None, True])
def test_bad_periods_are_named(within: Any) -> None:
    with pytest.raises(DeclarationError, match=r"Intensity: within must be .* not "):
        Intensity(1, within=within)


@pytest.mark.parametrize(
    ("options", "option"),
    [
        ({"name": ""}, "name"),
        ({"name": "a/b"}, "name"),
        ({"name": 7}, "name"),
        ({"factory": None}, "factory"),
        ({"restart": "sometimes"}, "restart"),
        ({"stop": -0.1}, "stop"),
        ({"stop": math.nan}, "stop"),
        ({"stop": "gently"}, "stop"),
        ({"stop": None}, "stop"),
        ({"stop": True}, "stop"),
        ({"backoff": 1.0}, "backoff"),
        ({"parameters": [1]}, "parameters"),
        ({"remap": "a:=b"}, "remap"),
        ({"args": "xyz"}, "args"),
        ({"args": 1}, "args"),
    ],
)
def test_bad_child_specs_are_named(options: dict[str, Any], option: str) -> None:
    factory = options.pop("factory", GpsDriver)
    with pytest.raises(DeclarationError, match=rf"Child\(.*\): {option}\b"):
        Child(factory, **options)


@pytest.mark.parametrize("factory", [lambda: None, GpsDriver().__class__.__eq__])
def test_a_child_needs_an_id(factory: Any) -> None:
    if factory.__name__ == "<lambda>":
        with pytest.raises(DeclarationError, match="give it one: name="):
            Child(factory)
    assert Child(factory, name="x").name == "x"


@pytest.mark.parametrize("stranger", [camera, 42, None, "gps", Supervisor])
def test_only_children_can_be_children(stranger: Any) -> None:
    for make in (lambda: Supervisor("robot", children=[stranger]), lambda: Supervisor("robot", stranger)):
        with pytest.raises(DeclarationError, match="a child must be a Child or a Supervisor"):
            make()


def test_a_class_stands_for_a_child_wherever_a_child_is_given() -> None:
    child = Child(GpsDriver)
    assert Supervisor("robot", GpsDriver) == Supervisor("robot", children=[GpsDriver]) == Supervisor("robot", child)
    assert DynamicSupervisor("pool", GpsDriver) == DynamicSupervisor("pool", child)


def test_a_function_in_the_place_of_a_child_is_told_how() -> None:
    with pytest.raises(DeclarationError, match=r"write Child\(camera\)"):
        Supervisor("robot", camera)  # type: ignore[arg-type]


BIG = Supervisor("big", children=[Child(GpsDriver, name=f"gps_{number}", args=("x" * 50,)) for number in range(200)])


@pytest.mark.parametrize(
    ("make", "remedy"),
    [
        (lambda: Child(BIG), r"Child\(Supervisor\('big'\)\): a Supervisor is a child as it is"),  # type: ignore[arg-type]
        (lambda: Child(Child(GpsDriver)), "a Child is a child as it is"),  # type: ignore[arg-type]
        (lambda: Child(Node()), r"write Child\(Node\)"),  # type: ignore[arg-type]
        (lambda: Supervisor("x", [Node()]), r"write Child\(Node\)"),  # type: ignore[list-item]
        (
            lambda: Supervisor("x", children=BIG),  # type: ignore[arg-type]
            r"children must be a list, write children=\[Supervisor\('big'",
        ),
        (lambda: Supervisor("x", [BIG, BIG]), "duplicate id 'big'"),
        (lambda: Supervisor(BIG), "name must be a text"),  # type: ignore[arg-type]
        (lambda: Supervisor("x", strategy=BIG), "strategy must be one_for_one, "),  # type: ignore[arg-type]
        (lambda: DynamicSupervisor("x", BIG), "template must be a Child"),  # type: ignore[arg-type]
        (lambda: DynamicSupervisor("x", camera), r"write Child\(camera\)"),  # type: ignore[arg-type]
        (lambda: Child(GpsDriver, name=BIG), "name must be a text"),  # type: ignore[arg-type]
        (lambda: Child(GpsDriver, parameters=BIG), "parameters must be a mapping"),  # type: ignore[arg-type]
    ],
)
def test_a_tree_in_the_wrong_place_is_told_in_one_short_line(make: Callable[[], object], remedy: str) -> None:
    with pytest.raises(DeclarationError, match=remedy) as told:
        make()
    assert len(str(told.value)) < 320
    assert "\n" not in str(told.value)


def test_the_children_follow_the_name_or_are_listed() -> None:
    children = [Child(GpsDriver)]
    assert Supervisor("robot", children) == Supervisor("robot", children=children) == Supervisor("robot", *children)
    assert Supervisor("robot", GpsDriver, children=[Child(camera)]).children == (Child(GpsDriver), Child(camera))
    assert repr(Supervisor("robot", children)) == "Supervisor('robot', children=(Child(GpsDriver, name='gps_driver'),))"
    assert repr(Supervisor("robot")) == "Supervisor('robot')"


def test_ids_are_unique() -> None:
    with pytest.raises(DeclarationError, match="duplicate id 'gps_driver'"):
        Supervisor("robot", children=[Child(GpsDriver), Child(GpsDriver)])
    with pytest.raises(DeclarationError, match="duplicate id 'camera'"):
        Supervisor("robot", children=[Child(camera), Supervisor("camera")])


@pytest.mark.parametrize("make", [lambda **o: Child(GpsDriver, **o), lambda **o: Supervisor("legs", **o)])
def test_significant_and_permanent_do_not_go_together(make: Any) -> None:
    with pytest.raises(DeclarationError) as refused:
        make(significant=True)
    assert "significant=True" in str(refused.value)
    assert "restart=permanent" in str(refused.value)


def test_significant_needs_an_auto_shutdown() -> None:
    watchdog = Child(GpsDriver, restart=transient, significant=True)
    for build in (lambda: Supervisor("robot", children=[watchdog]), lambda: DynamicSupervisor("pool", watchdog)):
        with pytest.raises(DeclarationError) as refused:
            build()
        assert "significant=True" in str(refused.value)
        assert "auto_shutdown=never" in str(refused.value)
    Supervisor("robot", children=[watchdog], auto_shutdown=any_significant)
    DynamicSupervisor("pool", watchdog, auto_shutdown=all_significant)


def test_names_come_from_the_class_in_snake_case() -> None:
    assert Child(GpsDriver).name == "gps_driver"
    assert Child(IMUReader).name == "imu"
    assert Child(camera).name == "camera"
    assert Child(GpsDriver, name="front_gps").name == "front_gps"


def test_declarations_are_values() -> None:
    one = Child(GpsDriver, parameters={"port": 1}, remap={"fix": "gps/fix"}, args=[1, 2], namespace="/front")
    same = Child(GpsDriver, parameters={"port": 1}, remap={"fix": "gps/fix"}, args=(1, 2), namespace="/front")
    assert one == same
    assert one != one.replace(restart=temporary)
    assert one != 1
    assert pickle.loads(pickle.dumps(Supervisor("robot", children=[one]))) == Supervisor("robot", children=[same])
    with pytest.raises(TypeError, match="unhashable"):
        hash(one)


def test_declarations_never_change() -> None:
    declared = Child(GpsDriver)
    with pytest.raises(AttributeError, match=r"never changes; \.replace\(stop=\.\.\.\)"):
        declared.stop = 1.0
    with pytest.raises(AttributeError, match="never changes"):
        del declared.stop
    parameters = {"port": 1}
    declared = Child(GpsDriver, parameters=parameters)
    parameters["port"] = 2
    assert declared.parameters == {"port": 1}


def test_a_changed_copy_is_checked_like_a_new_one() -> None:
    declared = Child(GpsDriver)
    assert declared.replace(stop=1.0).stop == 1.0
    assert declared.replace(factory=camera).name == "gps_driver"
    with pytest.raises(DeclarationError, match="stop"):
        declared.replace(stop=-1)


def test_reprs_show_what_is_not_default() -> None:
    assert repr(Child(GpsDriver, restart=transient)) == "Child(GpsDriver, name='gps_driver', restart='transient')"
    assert repr(Supervisor("legs", strategy=one_for_all)) == "Supervisor('legs', strategy='one_for_all')"
    pool = DynamicSupervisor("pool", Child(camera), max_children=3)
    assert repr(pool) == "DynamicSupervisor('pool', Child(camera, name='camera'), max_children=3)"


def test_an_instance_of_a_template_has_its_own_name_arguments_and_parameters() -> None:
    pool = DynamicSupervisor("pool", Child(camera, args=(1,), parameters={"fps": 30, "hdr": False}, stop=2.0))
    instance = pool.instance("left", (2,), {"fps": 10})
    assert (instance.name, instance.args, instance.parameters) == ("left", (1, 2), {"fps": 10, "hdr": False})
    assert instance.stop == 2.0
    assert pool.instance("plain").parameters == pool.template.parameters
    assert (pool.strategy, pool.kind) == ("one_for_one", "supervisor")


@pytest.mark.parametrize(
    ("options", "option"),
    [
        ({"max_children": -1}, "max_children"),
        ({"max_children": 1.5}, "max_children"),
        ({"intensity": None}, "intensity"),
        ({"auto_shutdown": ""}, "auto_shutdown"),
        ({"restart": ""}, "restart"),
        ({"restart": transient, "significant": 1}, "significant"),
    ],
)
def test_bad_dynamic_supervisors_are_named(options: dict[str, Any], option: str) -> None:
    with pytest.raises(DeclarationError, match=rf"DynamicSupervisor\('pool'\): {option} must be"):
        DynamicSupervisor("pool", Child(camera), **options)


def test_a_template_is_a_child() -> None:
    with pytest.raises(DeclarationError, match="template must be a Child"):
        DynamicSupervisor("pool", Supervisor("legs"))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "options",
    [
        {"first": 0.0, "most": 1.0},
        {"first": 2.0, "most": 1.0},
        {"first": 0.1, "most": math.inf},
        {"first": "1", "most": 2.0},
        {"first": 0.1, "most": 1.0, "factor": 0.5},
        {"first": 0.1, "most": 1.0, "jitter": -0.1},
        {"first": 0.1, "most": 1.0, "jitter": math.nan},
    ],
)
def test_bad_backoffs_are_named(options: dict[str, Any]) -> None:
    with pytest.raises(DeclarationError, match="Backoff: "):
        Backoff(**options)


def test_a_backoff_doubles_up_to_its_most() -> None:
    backoff = Backoff(0.1, 1.0, jitter=0.0)
    assert [backoff.delay(earlier, Random()) for earlier in range(6)] == [0.1, 0.2, 0.4, 0.8, 1.0, 1.0]
    assert backoff.delay(10_000, Random()) == 1.0
    assert backoff.reset_after == 0.55


@given(st.floats(0.001, 10), st.floats(1, 100), st.floats(1, 4), st.floats(0, 1), st.integers(0, 5000), st.integers())
def test_a_backoff_stays_within_its_bounds_and_follows_its_seed(
    first: float, span: float, factor: float, jitter: float, earlier: int, seed: int
) -> None:
    backoff = Backoff(first, first * span, factor, jitter)
    delay = backoff.delay(earlier, Random(seed))
    assert first <= delay <= first * span * (1 + jitter)
    assert delay == backoff.delay(earlier, Random(seed))


def test_one_tree_can_be_declared_from_another() -> None:
    legs = Supervisor("legs", children=[Child(GpsDriver)], strategy=rest_for_one)
    assert legs.replace(name="arms").children == legs.children
    assert Supervisor("robot", children=[legs, legs.replace(name="arms")]).children[1].name == "arms"
